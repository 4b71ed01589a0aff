"""Blue-on-blue with whole hubs: warned in time of what appears in the picture, and of what happens out there."""

import math
from collections.abc import Callable
from itertools import pairwise

import pytest

from bootprint.awareness import Aim, FriendlyWarning
from bootprint.bus import Envelope
from bootprint.display import shown
from bootprint.geodesy import ground_offset
from bootprint.messages import Observation
from sa_hub.awareness.settings import WarningSettings
from support.hub_squad import ORIGIN, START_NS, Air, S, Walk, hub, link, own_identity, position

NET = link("squad", 4800)
STILL = Walk(speed_m_s=0.0)
ONLY_AIM = WarningSettings(facing=False)


def warnings(air: Air, receiver: str = "a1") -> list[tuple[float, FriendlyWarning]]:
    """What a hub warned of, and when."""
    return [
        ((e.message.time_ns - START_NS) / S, e.message)
        for name, e in air.outputs
        if name == receiver and isinstance(e.message, FriendlyWarning)
    ]


def changes(air: Air) -> list[tuple[float, tuple[str, ...]]]:
    """When the reasons changed."""
    found: list[tuple[float, tuple[str, ...]]] = []
    for at_s, warning in warnings(air):
        if warning.reasons != (found[-1][1] if found else ()):
            found.append((at_s, warning.reasons))
    return found


def aiming(air: Air, azimuth_deg: Callable[[float], float], **options: float) -> Callable[[int], None]:
    """At each step a1's weapon sensor tells where it points."""

    def tell(now_ns: int) -> None:
        if now_ns % (S // 5) == 0:
            azimuth_rad = math.radians(azimuth_deg((now_ns - START_NS) / S))
            aim = Aim(time_ns=now_ns, azimuth_rad=azimuth_rad, azimuth_sigma_rad=0.02, **options)
            air.say(Envelope(own_identity("a1").address("aim", "rifle"), aim))

    return tell


def pair(**options: object) -> Air:
    """Two soldiers of different squads on one net."""
    return Air({name: hub(name, NET, warnings=ONLY_AIM, **options) for name in ("a1", "b1")})


def test_who_comes_near_is_warned_of_within_two_seconds_of_the_picture() -> None:
    air = pair()
    # b1 goes 26 m north by east, then turns and comes back south, passing a1 at 11 m, and leaves again.
    walks = {"a1": Walk(east_m=80.0, speed_m_s=0.0), "b1": Walk(east_m=60.0, turn_deg=160.0)}
    us = ORIGIN.latitude_deg, ORIGIN.longitude_deg + 80.0 / 56_891.0
    in_picture: list[float] = []

    def look(now_ns: int) -> None:
        track = air.tracks.get(("a1", "b1"))
        if track is not None:
            view = shown(track, now_ns)
            if math.hypot(*ground_offset(us, (view.latitude_deg, view.longitude_deg))) < 15.0:
                in_picture.append((now_ns - START_NS) / S)

    air.run(60.0, walks, look)
    (begun, reasons), (over, none) = changes(air)
    assert (reasons, none) == (("near",), ())
    assert 25.0 < begun <= in_picture[0] + 2.0
    assert in_picture[-1] < over


def test_who_comes_into_the_line_of_a_weapon_is_warned_of_and_cleared_within_two_seconds() -> None:
    air = pair()
    walks = {"a1": STILL, "b1": Walk(east_m=80.0, speed_m_s=0.0)}  # due east
    air.run(30.2, walks, aiming(air, lambda at_s: 90.0 if 10.0 <= at_s < 20.0 else 0.0))
    (begun, reasons), (over, none) = changes(air)
    assert (reasons, none) == (("in_aim",), ())
    assert 10.0 <= begun <= 12.0
    assert 20.0 <= over <= 22.0
    _, warning = warnings(air)[0]
    assert (warning.soldier, warning.friendly, warning.state) == ("a1", "b1", "fresh")
    assert warning.distance_m == pytest.approx(80.0, abs=3.0)
    assert warning.azimuth_rad == pytest.approx(math.pi / 2.0, abs=0.05)
    assert warning.probability_pct > 50.0


def test_a_weapon_that_is_no_longer_told_of_points_nowhere() -> None:
    air = pair()
    walks = {"a1": STILL, "b1": Walk(east_m=80.0, speed_m_s=0.0)}
    air.run(10.0, walks, aiming(air, lambda _: 90.0))
    air.run(5.0, walks)
    assert changes(air)[-1][1] == ()
    assert 12.0 <= changes(air)[-1][0] <= 14.0


@pytest.mark.parametrize(("options", "warned"), [({}, True), ({"range_m": 60.0}, False)])
def test_a_weapon_reaches_as_far_as_it_says(options: dict[str, float], warned: bool) -> None:
    air = pair()
    walks = {"a1": STILL, "b1": Walk(east_m=80.0, speed_m_s=0.0)}
    air.run(10.0, walks, aiming(air, lambda _: 90.0, **options))
    assert bool(warnings(air)) == warned


@pytest.mark.parametrize(("height_m", "warned"), [(50.0, True), (56.0, True), (80.0, False)])
def test_who_is_far_above_is_in_no_line(height_m: float, warned: bool) -> None:
    air = pair()
    walks = {"a1": STILL, "b1": Walk(east_m=30.0, speed_m_s=0.0, height_m=height_m)}
    air.run(10.0, walks, aiming(air, lambda _: 90.0))
    assert bool(warnings(air)) == warned


@pytest.mark.parametrize(("floor", "warned"), [(1, True), (2, False)])
def test_a_ceiling_stands_between_floors(floor: int, warned: bool) -> None:
    core, sender = hub("a1", NET), hub("b1", NET)
    found = []
    for step in range(50):
        now_ns = START_NS + step * S // 10
        core.handle(position("a1", now_ns, STILL, floor=1))
        sender.handle(position("b1", now_ns, Walk(east_m=8.0, speed_m_s=0.0), floor=floor))
        sender.tick(now_ns)
        for frame in sender.take_frames():
            core.receive("squad", frame.data, now_ns)
        found += [e for e in core.tick(now_ns) if isinstance(e.message, FriendlyWarning)]
    assert bool(found) == warned


def test_what_we_face_is_a_line_for_want_of_a_weapons() -> None:
    air = Air({name: hub(name, NET) for name in ("a1", "b1")})
    ahead = {"a1": STILL, "b1": Walk(east_m=40.0, speed_m_s=0.0)}

    def facing(azimuth_deg: float) -> None:
        for step in range(50):
            now_ns = air.now_ns + step * S // 5
            air.hubs["a1"].handle(position("a1", now_ns, STILL, facing_rad=math.radians(azimuth_deg)))
            air.keep("a1", air.hubs["a1"].tick(now_ns))

    air.run(3.0, {"b1": ahead["b1"]})
    facing(90.0)
    assert [reasons for _, reasons in changes(air)] == [("in_facing",)]


def test_a_lost_friendly_may_still_be_where_it_was() -> None:
    air = pair()
    walks = {"a1": STILL, "b1": Walk(east_m=60.0, speed_m_s=0.0)}
    air.run(10.0, walks)
    air.run(200.0, {"a1": STILL})
    assert warnings(air) == []
    air.run(5.0, {"a1": STILL}, aiming(air, lambda _: 90.0))
    _, warning = warnings(air)[-1]
    assert (warning.reasons, warning.state) == (("in_aim",), "lost")
    assert warning.age_s > 180.0


def test_an_observed_target_draws_a_line_past_friendlies() -> None:
    air = Air({name: hub(name, NET, warnings=ONLY_AIM) for name in ("a1", "a2", "b1", "b2")})
    walks = {
        "a1": STILL,
        "a2": Walk(east_m=-60.0, speed_m_s=0.0),
        "b1": Walk(east_m=60.0, speed_m_s=0.0),
        "b2": Walk(east_m=118.0, speed_m_s=0.0),
    }
    air.run(20.0, walks)
    assert warnings(air) == []
    seen = Observation(
        time_ns=air.now_ns,
        soldier="a2",
        latitude_deg=ORIGIN.latitude_deg,
        longitude_deg=ORIGIN.longitude_deg + 120.0 / 56_891.0,
        accuracy_m=4.0,
    )
    air.say(Envelope(own_identity("a2").address("observation", "people"), seen))
    air.run(5.0, walks)
    told = {warning.friendly: warning.reasons for _, warning in warnings(air)}
    assert told == {"b1": ("in_target_line",), "b2": ("in_target_line", "near_target")}
    air.run(130.0, walks)
    assert {w.friendly: w.reasons for _, w in warnings(air)} == {"b1": (), "b2": ()}


def test_warnings_can_be_switched_off() -> None:
    air = Air({name: hub(name, NET, warnings=WarningSettings(on=False)) for name in ("a1", "b1")})
    air.run(10.0, {"a1": STILL, "b1": Walk(east_m=5.0, speed_m_s=0.0)})
    assert warnings(air) == []


def test_within_five_seconds_of_it_happening_on_a_net_of_1200_bits_a_second() -> None:
    """Twelve soldiers share the net; b1 turns about, unforeseen, until it walks into the line of a weapon."""
    narrow = link("squad", 100, header_bytes=0)
    names = [f"a{n}" for n in range(1, 9)] + ["b1", "b2", "b3", "lead"]
    air = Air({name: hub(name, narrow, warnings=ONLY_AIM) for name in names}, jitter_s=0.2, seed=4)
    walks = {name: Walk(east_m=-20.0 * n, turn_deg=35.0 * n) for n, name in enumerate(names)}
    walks |= {"a1": STILL, "b1": Walk(east_m=60.0, turn_deg=160.0)}
    in_line: list[float] = []

    def look(now_ns: int) -> None:
        east, north, _, _ = walks["b1"].at((now_ns - START_NS) / S)
        if abs(north) <= 5.0 and east > 0.0:
            in_line.append((now_ns - START_NS) / S)

    tell = aiming(air, lambda _: 90.0)

    def each_step(now_ns: int) -> None:
        look(now_ns)
        tell(now_ns)

    air.run(240.0, walks, each_step)
    entries = [late for early, late in pairwise([-9.0, *in_line]) if late - early > 1.0]
    b1 = [(at_s, warning.is_over) for at_s, warning in warnings(air) if warning.friendly == "b1"]
    assert len(entries) >= 3
    for entry in entries:
        before = [is_over for at_s, is_over in b1 if at_s <= entry]
        begun = [at_s for at_s, is_over in b1 if entry < at_s <= entry + 5.0 and not is_over]
        assert begun or (before and not before[-1]), entry
