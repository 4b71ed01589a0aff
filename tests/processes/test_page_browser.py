"""The real page in a real browser, on a squad that clears a building behind a radio."""

import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

import pytest
from PIL import Image
from playwright.sync_api import Browser, Route, expect

from bootprint.display import shown
from bootprint.geodesy import ground_offset
from bootprint.messages import Observation, Track
from bootprint.topics import SUBJECT_OF
from proving_ground.exercises.event_time.line import Line
from proving_ground.exercises.event_time.shown_play import Pace, ShownPlay, walked_exercise
from proving_ground.exercises.exercise import Exercise
from sa_hub.history.archive import Archive
from sa_hub.page.access import new_token
from sa_hub.page.settings import PageSettings
from support.browser import CAN_RUN, WHY_NOT, Tab, running_chromium, tab
from support.tiles import EXTENT, vector_tile, write_mbtiles, write_pmtiles
from support.waiting import wait_until

pytestmark = [
    pytest.mark.processes,
    pytest.mark.xdist_group("page"),  # one squad and one browser for all
    pytest.mark.timeout(400),
    pytest.mark.skipif(not CAN_RUN, reason=WHY_NOT),
]
expect.set_options(timeout=90_000)  # a page whose map is drawn in software on a busy machine takes its time
Said = TypeVar("Said", Observation, Track)
Walked = tuple[Exercise, dict[str, Line]]
SILENT = "a3"
BEGIN_S = 45.0
"""Event seconds into the exercise at which somebody looks: one is lost by then, others walk for minutes more."""


@pytest.fixture(scope="module")
def walked() -> Walked:
    return walked_exercise(
        "building-clearing", 2, {SILENT: 8.0}, {"heartbeat_s": 8.0, "stale_s": 14.0, "lost_s": 25.0}
    )


@pytest.fixture(scope="module")
def squad(walked: Walked, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ShownPlay]:
    folder = tmp_path_factory.mktemp("page")
    archive = Archive(f"sqlite:///{folder / 'history.db'}")
    with ShownPlay(*walked, folder, Pace(1.0, BEGIN_S), archive=archive) as play:
        wait_until(lambda: play.elapsed_s >= BEGIN_S, timeout_s=240.0, what="the squad's way until then")
        yield play
    archive.close()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with running_chromium() as found:
        yield found


@pytest.fixture(scope="module")
def looking(chromium: Browser, squad: ShownPlay) -> Iterator[Tab]:
    with tab(chromium, squad.address) as found:
        found.wait("squad.state.tracks.size === 8 && squad.map.ready && squad.fitted")
        yield found
        assert found.faults == []


def test_soldiers_move_on_the_map(looking: Tab) -> None:
    looking.says("void (squad.before = new Map(squad.map.overlay.drawn))")
    looking.wait(
        """[...squad.map.overlay.drawn].some(([id, { at }]) => (was => was
        && Math.hypot(at[0] - was.at[0], at[1] - was.at[1]) > 2)(squad.before.get(id)))"""
    )


def test_symbols_stand_where_the_map_has_their_places(looking: Tab) -> None:
    # Waited for: the map may have been moved since the last drawing.
    looking.wait(
        """(apart => apart.length >= 7 && Math.max(...apart) < 0.5)
        ([...squad.map.overlay.drawn.values()].map(({ mark, at }) => (place =>
        Math.hypot(place.x - at[0], place.y - at[1]))(squad.map.map.project(mark.place))))"""
    )
    inked = looking.says(
        """(({ canvas, drawn }) => [...drawn.values()].map(each => each.at)
        .filter(([x, y]) => x > 0 && y > 0 && x < canvas.clientWidth && y < canvas.clientHeight)
        .map(([x, y]) => canvas.getContext("2d")
        .getImageData(x * devicePixelRatio, y * devicePixelRatio, 1, 1).data[3]))(squad.map.overlay)"""
    )
    assert len(inked) >= 7, "everybody but the lost one is in view"
    assert min(inked) > 100


def test_a_lost_soldier_says_since_when_and_goes_on_counting(looking: Tab) -> None:
    row = looking.page.locator(f'.row[data-soldier="{SILENT}"]')
    expect(row).to_have_class(re.compile(r"\blost\b"))
    words = row.locator(".age").inner_text()
    first = seconds_lost(words)
    assert first >= 25
    looking.wait(
        f"""document.querySelector('.row[data-soldier="{SILENT}"] .age').textContent !== {words!r}"""
    )
    assert seconds_lost(row.locator(".age").inner_text()) > first
    row.click()
    on_map = looking.wait(f'squad.map.overlay.drawn.get("{SILENT}")')
    looking.page.keyboard.press("Escape")
    looking.page.keyboard.press("f")
    assert on_map["label"]
    assert on_map["mark"]["label"][1]["text"].startswith("lost for")
    assert on_map["mark"]["opacity"] < 0.9


def seconds_lost(words: str) -> int:
    """The seconds of "lost for 1:20" or "lost for 50 s"."""
    found = re.fullmatch(r"lost for (?:(\d+):)?(\d+)(?: s)?", words)
    assert found, words
    return 60 * int(found[1] or 0) + int(found[2])


def test_the_floor_switch_shows_that_floor_and_pales_the_others(looking: Tab) -> None:
    for floor in (0, 1):
        looking.page.click(f'#floors [data-floor="{floor}"]')
        looking.wait(
            f"""(rooms => rooms.length > 0 && rooms.every(each => each.properties.floor === {floor}))
            (squad.map.map.querySourceFeatures("plan", {{filter: ["==", "kind", "room"]}}))"""
        )
        looking.wait(
            f"""[...squad.map.overlay.drawn.values()].every(each =>
            (each.mark.opacity > 0.3) === (squad.state.tracks.get(each.mark.id)?.floor === {floor}))"""
        )
    looking.page.keyboard.press("0")


def test_an_alert_stays_until_somebody_acknowledges_it(looking: Tab, squad: ShownPlay) -> None:
    page = looking.page
    where = page.locator("#map").bounding_box()
    page.keyboard.press("l")
    page.select_option('dialog [name="kind"]', "withdraw")
    page.fill('dialog [name="text"]', "by the stairs")
    page.click("dialog .primary")
    banner = page.locator(".alert[data-alert]")
    expect(banner).to_contain_text("WITHDRAW")
    expect(banner).to_contain_text("by the stairs")
    assert page.locator("#map").bounding_box() == where, "nothing moves under anybody's finger"
    page.keyboard.press("a")
    expect(banner).to_have_count(0)
    (alert,) = squad.desk.picture.all("alerts").values()
    assert getattr(alert, "acknowledged_by", None) == "local"
    page.click("#side-toggle")  # at this size the side is closed until it is wanted
    page.click('[data-tab="seen"]')
    expect(page.locator("#right .row.alerted")).to_contain_text("by the stairs · from Zero · seen by local")
    page.click("#side-toggle")


def test_what_a_finger_is_on_stays_while_figures_change(looking: Tab) -> None:
    page = looking.page
    page.click('.row[data-soldier="a1"]')
    button = page.locator("#card .buttons button").first.element_handle()
    before = looking.says("document.querySelector('#card dl').textContent")
    looking.wait(f"document.querySelector('#card dl').textContent !== {before!r}")
    assert button is not None
    assert button.evaluate("each => each.isConnected"), "a click that begins on it ends on it"
    page.click("#card .close")


def test_an_observation_lies_where_it_was_clicked(looking: Tab, squad: ShownPlay) -> None:
    page = looking.page
    looking.says(
        """void squad.map.map.once("click", () =>
        squad.clicked = squad.map.map.unproject([260, 330]))"""
    )
    page.keyboard.press("o")
    page.locator("#map").click(position={"x": 260, "y": 330})
    place = looking.wait("squad.clicked && [squad.clicked.lat, squad.clicked.lng]")
    page.select_option('dialog [name="code"]', "vehicle")
    page.fill('dialog [name="text"]', "two trucks")
    page.click("dialog .primary")
    looking.wait("squad.state.observations.size === 1")
    (seen,) = squad.desk.picture.all("observations").values()
    told = getattr(seen, "latitude_deg", 0.0), getattr(seen, "longitude_deg", 0.0)
    assert ground_offset(tuple(place), told) == pytest.approx((0.0, 0.0), abs=0.3)
    page.click("#side-toggle")
    page.click('[data-tab="seen"]')
    expect(page.locator("#right .body")).to_contain_text("two trucks")
    page.click("#side-toggle")


def test_what_a_soldier_sees_is_placed_by_bearing_and_range(looking: Tab, squad: ShownPlay) -> None:
    page, before = looking.page, len(squad.desk.picture.all("observations"))
    page.click('.row[data-soldier="a2"]')
    page.keyboard.press("b")
    page.locator("#map").click(position={"x": 260, "y": 330})
    page.fill('dialog [name="azimuth_deg"]', "90")
    page.fill('dialog [name="range_m"]', "200")
    page.fill('dialog [name="text"]', "by the fence")
    page.click("dialog .primary")
    looking.wait(f"squad.state.observations.size === {before + 1}")
    seen = next(each for each in archived(squad, Observation) if each.text == "by the fence")
    at = place_of(squad, "a2", seen.time_ns)
    from_m = ground_offset(at, (seen.latitude_deg, seen.longitude_deg))
    assert from_m == pytest.approx((200.0, 0.0), abs=2.0)  # their word may have come after the order
    page.click("#card .close")


def archived(squad: ShownPlay, kind: type[Said]) -> list[Said]:
    """The messages of a kind that the post keeps, in the order of their time."""
    assert squad.desk.archive is not None
    kept = squad.desk.archive.messages(SUBJECT_OF[kind], 0, 2**62)
    return [each.message for each in kept if isinstance(each.message, kind)]


def place_of(squad: ShownPlay, soldier: str, time_ns: int) -> tuple[float, float]:
    """Where the post showed somebody at that time."""
    tracks = (each for each in archived(squad, Track) if each.soldier == soldier and each.time_ns <= time_ns)
    then = shown(max(tracks, key=lambda track: track.time_ns), time_ns, squad.desk.post.ages)
    return then.latitude_deg, then.longitude_deg


def test_measuring_tells_metres_degrees_and_mils(looking: Tab) -> None:
    page = looking.page
    page.keyboard.press("m")
    page.locator("#map").click(position={"x": 260, "y": 330})
    page.locator("#map").hover(position={"x": 360, "y": 330})
    text = looking.wait("squad.map.draft.places.length === 2 && squad.map.draft.text")
    metres, azimuth, mils = re.fullmatch(r"([\d.]+) m · ([\d.]+)° · (\d+) mil", text).groups()  # type: ignore[union-attr]
    per_metre = looking.says("squad.map.overlay.view.pixelsPerMetre(squad.map.map.getCenter().lat)")
    assert float(metres) == pytest.approx(100.0 / per_metre, rel=0.01)
    assert (float(azimuth), float(mils)) == pytest.approx((90.0, 1600.0), rel=0.01)
    page.click("#hint button")
    expect(page.locator("#hint")).to_be_empty()


def test_who_is_followed_stays_in_the_middle(looking: Tab) -> None:
    page = looking.page
    looking.says(
        "void (squad.began = new Map(squad.state.seen().map(each => [each.track.soldier, each.track])))"
    )
    mover = looking.wait(
        """squad.state.seen().map(each => [each.track, squad.began.get(each.track.soldier)]).find(
        ([now, then]) => then && Math.hypot(now.latitude_deg - then.latitude_deg,
        now.longitude_deg - then.longitude_deg) > 1e-5)?.[0].soldier"""
    )
    page.click(f'.row[data-soldier="{mover}"]')
    page.keyboard.press("g")
    looking.says("void (squad.from = squad.map.map.getCenter())")
    looking.wait(
        f"""(at => at && squad.map.map.getCenter().distanceTo(squad.from) > 0.5
        && Math.hypot(at[0] - squad.map.map.getContainer().clientWidth / 2,
        at[1] - squad.map.map.getContainer().clientHeight / 2) < 20)
        (squad.map.overlay.drawn.get("{mover}")?.at)"""
    )
    page.keyboard.press("g")
    page.click("#card .close")
    page.keyboard.press("f")


def test_looking_back_shows_the_picture_of_then(looking: Tab) -> None:
    page = looking.page
    looking.wait("Number(document.querySelector('#seek').max) > 1e9")
    begin_s = float(page.locator("#seek").get_attribute("min") or 0)
    moment_s = begin_s + 20.0
    page.evaluate(
        f"""(() => {{ const slider = document.querySelector("#seek"); slider.value = "{moment_s}";
        slider.dispatchEvent(new Event("input")); }})()"""
    )
    looking.wait("squad.state.past !== null")
    expect(page.locator("#line")).to_have_text("looking back")
    newest = looking.says("Math.max(...squad.state.seen().map(each => each.track.time_s))")
    assert moment_s - 15.0 < newest <= moment_s
    looking.wait("squad.state.trail('a1').length > 1")
    assert looking.says("squad.state.trail('a1').every(each => each.time_s <= squad.state.past.time_s)")
    page.click("#play")
    looking.wait(f"squad.state.past?.time_s > {moment_s} + 1")
    page.keyboard.press("Home")
    expect(page.locator("#line")).to_have_text("live")


def test_playing_stops_when_the_hub_is_out_of_reach_and_says_so_once(looking: Tab) -> None:
    page = looking.page
    asked: list[str] = []

    def lose(route: Route) -> None:
        asked.append(route.request.url)
        route.abort()

    looking.wait("Number(document.querySelector('#seek').max) > 1e9")
    page.keyboard.press("Space")
    looking.wait("squad.state.past?.playing")
    page.route("**/history/picture*", lose)
    looking.wait("squad.state.past?.playing === false")
    expect(page.locator("#toast")).to_have_text("the hub cannot be reached")
    page.wait_for_timeout(1000)  # five beats
    assert len(asked) == 1
    page.unroute("**/history/picture*")
    page.keyboard.press("Home")
    expect(page.locator("#line")).to_have_text("live")


def test_the_past_is_exported_as_a_download(looking: Tab) -> None:
    page = looking.page
    looking.wait("Number(document.querySelector('#seek').max) > 1e9")
    page.click("#export")
    page.select_option('dialog [name="format"]', "geojson")
    with page.expect_download() as download:
        page.click("dialog .primary")
    features = json.loads(download.value.path().read_text())["features"]
    assert {each["properties"]["soldier"] for each in features} >= {f"a{n}" for n in range(1, 9)}


def pixels() -> bytes:
    picture = io.BytesIO()
    Image.new("RGB", (256, 256), (30, 90, 40)).save(picture, "PNG")
    return picture.getvalue()


WORLD = ((0, 0), (EXTENT, 0), (EXTENT, EXTENT), (0, EXTENT))


def test_a_basemap_of_ones_own_lies_below_the_plan(chromium: Browser, walked: Walked, tmp_path: Path) -> None:
    write_pmtiles(tmp_path / "area.pmtiles", pixels())
    settings = PageSettings(port=0, basemap="area.pmtiles")
    with ShownPlay(*walked, tmp_path, settings=settings) as play, tab(chromium, play.address) as looking:
        looking.wait('squad.map.map.getSource("basemap") && squad.map.map.isSourceLoaded("basemap")')
        order = looking.says("squad.map.map.getStyle().layers.map(each => each.id)")
        assert order.index("ground") < order.index("basemap") < order.index("outdoor")
        assert looking.faults == []


@pytest.mark.parametrize(
    ("name", "layer", "kind"),
    [("area.pmtiles", "water", "ocean"), ("area.mbtiles", "building", "yes")],
)
def test_vector_tiles_are_drawn_by_the_names_of_their_layers(
    chromium: Browser, walked: Walked, tmp_path: Path, name: str, layer: str, kind: str
) -> None:
    write = write_pmtiles if name.endswith(".pmtiles") else write_mbtiles
    write(tmp_path / name, vector_tile(layer, WORLD, kind=kind), "pbf", [layer, "unheard_of"])
    settings = PageSettings(port=0, basemap=name)
    with ShownPlay(*walked, tmp_path, settings=settings) as play, tab(chromium, play.address) as looking:
        looking.wait(
            f"""squad.map.map.queryRenderedFeatures().some(each => each.source === "basemap"
            && each.sourceLayer === "{layer}" && each.properties.kind === "{kind}")"""
        )
        assert looking.faults == []


def test_a_viewer_signs_in_with_a_token_and_is_offered_no_changes(
    chromium: Browser, walked: Walked, tmp_path: Path
) -> None:
    token, known = new_token("eye", "view")
    settings = PageSettings(port=0, tokens=(known,))
    with (
        ShownPlay(*walked, tmp_path, settings=settings) as play,
        tab(chromium, play.address) as viewer,
    ):
        viewer.page.fill('dialog [name="token"]', token)
        viewer.page.click("dialog .primary")
        viewer.wait("squad.map.ready")
        assert viewer.page.locator('#tools [data-tool="measure"]').count() == 1
        assert viewer.page.locator('#tools [data-tool="alert"]').count() == 0
