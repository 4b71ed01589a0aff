"""The whole core on simulated walks: placed, held together, corrected, honest, and the same bytes every time."""

import math
from collections.abc import Iterable
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint import wire
from bootprint.bus import Envelope, MemoryBus
from bootprint.geodesy import LocalFrame
from bootprint.messages import Fix, FootPose, FootStep, GnssFix, Message, Position, upper_triangle
from fusion.config import Coupling, FeetConfig, FusionConfig, SilenceConfig, StartConfig
from fusion.engine import SUBJECTS, FusionCore
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    envelope,
    in_time_order,
    rectangle,
    straight,
)

FRAME = LocalFrame(ORIGIN)
DUAL = FusionConfig(gnss_sources=(), start=EAST)
SINGLE = FusionConfig(feet=("left_foot",), gnss_sources=(), start=EAST)
SLOW_DUAL, SLOW_SINGLE = (msgspec.structs.replace(config, rate_hz=1.0) for config in (DUAL, SINGLE))


def run(config: FusionConfig, *streams: list[Envelope]) -> tuple[list[Position], FusionCore]:
    core = FusionCore(config, WHO, ORIGIN)
    return feed(core, in_time_order(*streams)), core


def feed(core: FusionCore, envelopes: Iterable[Envelope]) -> list[Position]:
    out = [message for item in envelopes for message in core.handle(item)]
    return positions([*out, *core.close()])


def positions(envelopes: Iterable[Envelope]) -> list[Position]:
    return [item.message for item in envelopes if isinstance(item.message, Position)]


def seconds(position: Position) -> float:
    return (position.time_ns - T0) / NS


def horizontal_error(position: Position, truth: np.ndarray) -> float:
    return math.hypot(position.east_m - truth[0], position.north_m - truth[1])


def satellites(
    walk: SimulatedWalk,
    times: Iterable[float],
    error_m: float = 0.0,
    at: dict[float, tuple[float, float]] | None = None,
) -> list[Envelope]:
    """Fixes of 2 m stated accuracy on the body, with white errors, moved by ``at[time]`` m."""
    out = []
    for number, time_s in enumerate(times):
        east, north = walk.body(LEFT, RIGHT, time_s=time_s) + walk.rng.normal(size=2) * error_m
        extra = (at or {}).get(time_s, (0.0, 0.0))
        out.append(gnss(number, time_s, east + extra[0], north + extra[1]))
    return out


def gnss(number: int, time_s: float, east: float, north: float, accuracy_m: float | None = 2.0) -> Envelope:
    latitude, longitude, height = FRAME.to_geodetic(east, north, 0.0)
    message = GnssFix(
        time_ns=T0 + round(time_s * NS),
        sequence=number,
        fix_kind="3d",
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        horizontal_accuracy_m=accuracy_m,
        vertical_accuracy_m=3.0,
    )
    return envelope("gnss", "gnss", message)


# --- placed and moving -----------------------------------------------------------------------------------


def test_positions_come_on_the_grid_numbered_and_over_the_walk() -> None:
    walk = SimulatedWalk(rectangle(20, 8), 60.0)
    out, _ = run(DUAL, walk.messages(LEFT), walk.messages(RIGHT))
    stamps = [position.time_ns for position in out]
    assert all(stamp % (NS // 5) == 0 for stamp in stamps)
    assert set(np.diff(stamps)) == {NS // 5}
    assert [position.sequence for position in out] == list(range(len(out)))
    assert stamps[-1] - stamps[0] > 58 * NS


def test_two_boots_mounted_anyhow_follow_the_path_they_walk() -> None:
    walk = SimulatedWalk(rectangle(20, 8), 90.0)
    out, core = run(DUAL, walk.messages(LEFT), walk.messages(RIGHT))
    later = [position for position in out if seconds(position) > 7.0]
    assert all(position.sources == ("left_foot", "right_foot") for position in later)
    assert all(position.mode == "boots" for position in later)
    errors = [horizontal_error(p, walk.body(LEFT, RIGHT, time_s=seconds(p))) for p in later]
    assert max(errors) < 0.45  # feet's own lateral offset at the start, and the heading out of three metres
    assert np.median([position.speed_m_s for position in later[:-15]]) == pytest.approx(1.4, abs=0.02)
    assert out[-1].speed_m_s == pytest.approx(0.0, abs=0.02)
    assert core.counters["duplicate_steps"] == core.counters["lost_steps"] == 0


def test_a_position_between_two_poses_is_not_the_older_pose() -> None:
    """Poses 50 ms off the grid: a swinging foot goes up to 17 cm in that time."""
    walk = SimulatedWalk(straight(0.0), 30.0)
    foot = replace(LEFT, sideways_m=0.0)
    late = [Envelope(item.address, shifted(item.message, NS // 20)) for item in walk.messages(foot)]
    out, _ = run(SINGLE, late)
    errors = [
        horizontal_error(position, walk.foot_at(foot, seconds(position) - 0.05))
        for position in out
        if 6.0 < seconds(position) < 29.0
    ]
    assert max(errors) < 0.07


def shifted(message: Message, by_ns: int) -> Message:
    """The same message, everything in it ``by_ns`` later."""
    changes = {"time_ns": message.time_ns + by_ns}
    if isinstance(message, FootStep):
        changes["start_time_ns"] = message.start_time_ns + by_ns
    return msgspec.structs.replace(message, **changes)


def test_course_and_wgs84_agree_with_the_path() -> None:
    walk = SimulatedWalk(straight(0.0), 40.0)
    out, _ = run(DUAL, walk.messages(LEFT), walk.messages(RIGHT))
    walking = out[60]
    assert walking.course_rad == pytest.approx(math.pi / 2, abs=0.02)
    assert walking.course_sigma_rad is not None
    assert walking.course_sigma_rad < 0.15
    assert walking.velocity_m_s[0] == pytest.approx(1.4, abs=0.02)
    enu = FRAME.to_enu(walking.latitude_deg, walking.longitude_deg, walking.height_m)
    assert enu == pytest.approx((walking.east_m, walking.north_m, walking.up_m), abs=1e-6)


def test_heading_is_published_as_provisional_from_the_first_step() -> None:
    """Before three metres are walked the way leads where the azimuth says, with a large sideways variance."""
    walk = SimulatedWalk(straight(0.0), 20.0)
    out, core = run(SINGLE, walk.messages(LEFT))
    early = next(position for position in out if position.east_m > 1.2)
    assert early.north_m == pytest.approx(0.0, abs=0.02)
    assert early.covariance_m2[3] > 1.4**2 * 0.05**2
    assert core.counters["placed"] == 1


def test_without_any_start_the_mode_is_unplaced_and_says_so() -> None:
    walk = SimulatedWalk(straight(0.3), 20.0)
    out, core = run(FusionConfig(gnss_sources=()), walk.messages(LEFT), walk.messages(RIGHT))
    assert {position.mode for position in out} == {"unplaced"}
    assert out[-1].reliability_pct == 0.0
    assert out[-1].covariance_m2[0] == 10_000.0**2
    assert (out[-1].east_m, out[-1].north_m) == (0.0, 0.0)
    assert out[40].speed_m_s == pytest.approx(1.4, abs=0.02)
    assert core.figures().state == "degraded"


def test_a_known_point_without_azimuth_is_a_growing_circle() -> None:
    walk = SimulatedWalk(straight(2.0), 20.0)
    config = replace_start(SINGLE, StartConfig(east_m=7.0, north_m=3.0, sigma_m=1.0))
    out, _ = run(config, walk.messages(LEFT))
    assert (out[-1].east_m, out[-1].north_m) == (7.0, 3.0)
    moved = float(np.hypot(*(walk.foot_at(LEFT, 30.0) - walk.stance(LEFT, 0.0)[:2])))
    assert out[-1].covariance_m2[0] == pytest.approx(1.0 + 0.5 * moved**2, rel=0.15)
    assert out[-1].course_rad is None


def replace_start(config: FusionConfig, start: StartConfig | None) -> FusionConfig:
    return msgspec.structs.replace(config, start=start)


def test_fix_places_and_its_azimuth_turns_a_placed_soldier() -> None:
    walk = SimulatedWalk(straight(0.0), 40.0)
    latitude, longitude, _ = FRAME.to_geodetic(50.0, 20.0, 0.0)
    first = Fix(time_ns=T0 + 3 * NS, latitude_deg=latitude, longitude_deg=longitude, azimuth_rad=0.0)
    second = replace_message(
        first, time_ns=T0 + 20 * NS, sequence=1, azimuth_rad=math.pi / 2, azimuth_sigma_rad=0.03
    )
    fixes = [envelope("fix", "map", first), envelope("fix", "map", second)]
    out, _ = run(FusionConfig(gnss_sources=()), walk.messages(LEFT), walk.messages(RIGHT), fixes)
    modes = [position.mode for position in out]
    assert modes[0] == "unplaced"
    assert modes[-1] == "boots"
    before = next(position for position in out if seconds(position) > 18.0)
    assert before.course_rad is not None
    assert math.remainder(before.course_rad, 2 * math.pi) == pytest.approx(0.0, abs=0.1)  # they said north
    at_second = next(position for position in out if seconds(position) > 20.2)
    assert (
        math.hypot(at_second.east_m - 50.0, at_second.north_m - 20.0) < 1.5
    )  # believed, whatever was walked
    assert out[-20].course_rad == pytest.approx(math.pi / 2, abs=0.1)  # then east


def replace_message(message: Fix, **changes: object) -> Fix:
    return msgspec.structs.replace(message, **changes)


# --- satellites ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.4, 2.5, -1.7])
def test_satellites_place_a_walk_of_any_direction(yaw: float) -> None:
    walk = SimulatedWalk(straight(yaw), 90.0, rng=np.random.default_rng(round(10 * yaw) % 97))
    fixes = satellites(walk, np.arange(5.0, 92.0), error_m=1.0)
    out, core = run(FusionConfig(), walk.messages(LEFT), walk.messages(RIGHT), fixes)
    assert out[0].mode == "unplaced"
    assert core.counters["placed"] == 1
    assert {position.mode for position in out[-50:]} == {"gnss"}
    assert out[-1].sources == ("left_foot", "right_foot", "gnss")
    assert horizontal_error(out[-1], walk.body(LEFT, RIGHT, time_s=seconds(out[-1]))) < 2.0
    assert out[-20].course_rad == pytest.approx((math.pi / 2 - yaw) % (2 * math.pi), abs=0.08)


def test_a_jump_of_the_satellites_is_rejected_and_reported() -> None:
    walk = SimulatedWalk(rectangle(30, 20), 60.0)
    jump = {30.0: (40.0, 0.0), 31.0: (40.0, 0.0)}
    fixes = satellites(walk, np.arange(1.0, 60.0), error_m=0.5, at=jump)
    out, core = run(FusionConfig(start=EAST), walk.messages(LEFT), walk.messages(RIGHT), fixes)
    assert core.counters["gnss_rejected"] == 2
    during = [position for position in out if 30.3 < seconds(position) < 31.8]
    assert all(position.rejected == ("gnss",) for position in during)
    assert all(horizontal_error(p, walk.body(LEFT, RIGHT, time_s=seconds(p))) < 2.0 for p in during)
    assert out[-5].rejected == ()
    assert 0 < core.figures().gauges["gnss_nis"] < 13.8


def test_biased_walk_is_pulled_back_by_satellites() -> None:
    """A boot that drifts a degree a minute leaves the line by many metres alone, and not with satellites."""
    walk = SimulatedWalk(straight(0.0), 300.0, poses=False)
    drifting = replace(LEFT, drift_rad_s=math.radians(1.0) / 60)
    steps = walk.messages(drifting)
    alone, _ = run(SLOW_SINGLE, steps)
    fixes = satellites(walk, np.arange(1.0, 300.0), error_m=1.0)
    aided, core = run(FusionConfig(feet=("left_foot",), rate_hz=1.0, start=EAST), steps, fixes)
    truth = walk.foot_at(LEFT, 301.0)
    assert horizontal_error(alone[-1], truth) > 10.0
    assert horizontal_error(aided[-1], truth) < 4.0
    assert core.counters["gnss_rejected"] == 0


def test_fixes_that_say_nothing_are_counted_and_ignored() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    bad = [
        gnss(0, 5.0, 0.0, 0.0, accuracy_m=None),
        envelope("gnss", "gnss", GnssFix(time_ns=T0 + 6 * NS, sequence=1, fix_kind="none")),
        envelope(
            "gnss",
            "gnss",
            GnssFix(
                time_ns=T0 + 7 * NS,
                sequence=2,
                fix_kind="3d",
                latitude_deg=0.0,
                longitude_deg=0.0,
                horizontal_accuracy_m=3.0,
            ),
        ),
    ]
    plain, _ = run(FusionConfig(start=EAST), walk.messages(LEFT))
    walk.rng = np.random.default_rng(1)
    out, core = run(FusionConfig(start=EAST), walk.messages(LEFT), bad)
    assert core.counters["gnss_without_accuracy"] == 1
    assert core.counters["gnss_without_position"] == 1
    assert core.counters["gnss_out_of_range"] == 1
    assert [(p.east_m, p.north_m) for p in out] == [(p.east_m, p.north_m) for p in plain]


# --- two feet --------------------------------------------------------------------------------------------


def test_opposite_heading_drifts_of_the_feet_cancel() -> None:
    """FOI's observation: each foot alone leaves the line by metres, both together stay on it."""
    walk = SimulatedWalk(straight(0.0), 120.0, poses=False)
    drift = math.radians(4.0) / 60
    left, right = replace(LEFT, drift_rad_s=drift), replace(RIGHT, drift_rad_s=-drift)
    both, _ = run(SLOW_DUAL, walk.messages(left), walk.messages(right))
    alone, _ = run(SLOW_SINGLE, walk.messages(left))
    truth = walk.body(LEFT, RIGHT, time_s=121.0)
    assert horizontal_error(alone[-1], truth) > 8.0
    assert horizontal_error(both[-1], truth) < 1.5


@pytest.mark.parametrize("coupling", ["passing", "same_position"])
def test_feet_are_never_apart_by_more_than_the_bound(coupling: Coupling) -> None:
    walk = SimulatedWalk(straight(0.0), 60.0, poses=False)
    left = replace(LEFT, drift_rad_s=math.radians(30.0) / 60)
    config = msgspec.structs.replace(DUAL, boots=FeetConfig(coupling=coupling))
    out, core = run(config, walk.messages(left), walk.messages(RIGHT))
    feet = core.estimator.boots.feet
    state = core.estimator.boots.filter.state
    apart = state[feet["left_foot"].block.position] - state[feet["right_foot"].block.position]
    if coupling == "same_position":
        assert core.counters["separation_bounded"] > 0
    assert float(np.hypot(apart[0], apart[1])) < 2.0
    assert out[-1].mode == "boots"


def test_a_silent_foot_leaves_the_other_and_joins_again() -> None:
    walk = SimulatedWalk(rectangle(20, 8), 90.0)
    right = [e for e in walk.messages(RIGHT) if not 20 * NS < e.message.time_ns - T0 < 45 * NS]
    out, core = run(DUAL, walk.messages(LEFT), right)
    silent = [position for position in out if 22.0 < seconds(position) < 44.0]
    assert {position.sources for position in silent} == {("left_foot",)}
    assert {position.mode for position in out} == {"boots"}
    assert out[-1].sources == ("left_foot", "right_foot")
    assert core.counters["feet_dropped"] == 1
    assert core.counters["lost_steps"] > 15
    assert horizontal_error(out[-1], walk.body(LEFT, RIGHT, time_s=91.0)) < 0.8


def unplugged(messages: list[Envelope], from_s: float, until_s: float) -> list[Envelope]:
    """A foot's messages when its unit was unplugged: poses that go on from the old place, then one broken step."""
    kept = [e for e in messages if not from_s * NS < e.message.time_ns - T0 < until_s * NS]
    out: list[Envelope] = []
    last, steps, poses = 0, 0, 0
    for item in kept:
        message = item.message
        if isinstance(message, FootStep):
            start_ns, broken = last or message.start_time_ns, message.sequence > steps
            message = msgspec.structs.replace(message, sequence=steps, start_time_ns=start_ns)
            if broken and not any(isinstance(e.message, FootStep) and e.message.realigned for e in out):
                message = msgspec.structs.replace(message, realigned=True, displacement_m=(0.0, 0.0, 0.0))
            last, steps = message.time_ns, steps + 1
        elif isinstance(message, FootPose):
            message = msgspec.structs.replace(message, sequence=poses, step_sequence=steps - 1)
            poses += 1
        out.append(Envelope(item.address, message))
    return out


@pytest.mark.parametrize("until_s", [23.1, 45.3])
def test_a_foot_that_was_unplugged_does_not_pull_the_body_back_to_where_that_was(until_s: float) -> None:
    walk = SimulatedWalk(straight(0.0), 90.0)
    out, core = run(DUAL, walk.messages(LEFT), unplugged(walk.messages(RIGHT), 20.0, until_s))
    errors = [horizontal_error(p, walk.body(LEFT, RIGHT, time_s=seconds(p))) for p in out[15:-5]]
    assert max(errors) < 1.0
    assert core.counters["poses_after_silence"] > 0
    assert out[-1].sources == ("left_foot", "right_foot")


def test_the_last_step_of_an_unplugged_foot_told_when_it_is_back_moves_that_foot_alone() -> None:
    """A navigator tells what it held back when the next samples come: by then the other foot is far away."""
    walk = SimulatedWalk(straight(0.0), 60.0)
    right = [e for e in walk.messages(RIGHT) if e.message.time_ns < T0 + 20 * NS]
    held = max((e for e in right if isinstance(e.message, FootStep)), key=lambda e: e.message.time_ns)
    items = in_time_order(walk.messages(LEFT), [e for e in right if e is not held])
    place = next(index for index, e in enumerate(items) if e.message.time_ns > T0 + 45 * NS)
    core = FusionCore(DUAL, WHO, ORIGIN)
    out = feed(core, [*items[:place], held, *items[place:]])
    assert core.counters["late_foot_step"] == 1
    errors = [horizontal_error(p, walk.body(LEFT, RIGHT, time_s=seconds(p))) for p in out[15:-5]]
    assert max(errors) < 1.0


# --- silence, loss, damage -------------------------------------------------------------------------------


def test_silent_boots_are_coasting_with_growing_covariance_then_lost() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    core = FusionCore(DUAL, WHO, ORIGIN)
    out = [m for item in in_time_order(walk.messages(LEFT), walk.messages(RIGHT)) for m in core.handle(item)]
    last_s = seconds(positions(out)[-1])
    assert last_s > 20.0
    for tick in range(1, 160):
        out += core.tick(T0 + round((last_s + 0.5 * tick) * NS))
    late = [position for position in positions(out) if seconds(position) > last_s + 2.0]
    assert [position.sequence for position in positions(out)] == list(range(len(positions(out))))
    modes = [position.mode for position in late]
    assert modes[0] == "coasting"
    assert modes[-1] == "lost"
    assert modes == sorted(modes)  # coasting, then lost, and no way back
    variances = [position.covariance_m2[0] for position in late]
    assert variances == sorted(variances)
    ten = next(p for p in late if seconds(p) > last_s + 11.0)
    assert math.sqrt(ten.covariance_m2[0]) == pytest.approx(1.5 * 11.0, rel=0.15)
    assert ten.speed_m_s == 0.0
    assert ten.sources == ()


def test_satellites_carry_on_when_the_boots_fall_silent() -> None:
    walk = SimulatedWalk(straight(0.0), 60.0)
    steps = [e for e in walk.messages(LEFT) if e.message.time_ns < T0 + 20 * NS]
    fixes = satellites(walk, np.arange(1.0, 60.0), error_m=0.3)
    out, _ = run(FusionConfig(feet=("left_foot",), start=EAST), steps, fixes)
    core_out = [p for p in out if seconds(p) > 40.0]
    assert core_out
    assert {position.mode for position in core_out} == {"gnss"}
    for position in core_out:
        assert horizontal_error(position, walk.body(LEFT, RIGHT, time_s=seconds(position))) < 8.0


def test_silent_boots_are_waited_for_once_and_then_positions_come_in_time_again() -> None:
    """Boots that end at 20 s, a receiver that is a quarter of a second slow, and the host's clock."""
    walk = SimulatedWalk(straight(0.0), 40.0)
    boots = [(e.message.time_ns, e) for e in walk.messages(LEFT) if e.message.time_ns < T0 + 20 * NS]
    fixes = satellites(walk, np.arange(1.0, 40.0), error_m=0.3)
    heard = sorted([*boots, *((e.message.time_ns + NS // 4, e) for e in fixes)], key=lambda item: item[0])
    core = FusionCore(FusionConfig(feet=("left_foot",), start=EAST), WHO, ORIGIN)
    delay_s: dict[float, float] = {}
    for now_s in np.arange(0.05, 39.0, 0.05):
        now_ns = T0 + round(now_s * NS)
        due = [e for at_ns, e in heard if now_ns - NS // 20 < at_ns <= now_ns]
        out = [m for e in due for m in core.handle(e)] + list(core.tick(now_ns))
        delay_s |= {seconds(position): now_s - seconds(position) for position in positions(out)}
    in_time = [delay for at, delay in delay_s.items() if at > 21.8]
    assert 2.0 < max(delay_s.values()) < 2.5  # the first one that was waited for
    assert len(in_time) > 80
    assert max(in_time) < 0.7
    assert core.counters["late_gnss"] == 0
    assert core.counters["gnss_accepted"] > 35


def test_lost_steps_widen_the_covariance_and_are_counted() -> None:
    walk = SimulatedWalk(straight(0.0), 30.0, poses=False)
    steps = walk.messages(LEFT)
    whole, _ = run(SINGLE, steps)
    holed, core = run(SINGLE, [e for e in steps if e.message.sequence not in (12, 13)])
    assert core.counters["lost_steps"] == 2
    assert horizontal_error(holed[-1], walk.foot_at(LEFT, 31.0)) == pytest.approx(2 * 1.68, abs=0.3)
    assert holed[-1].covariance_m2[0] > whole[-1].covariance_m2[0] + 2.0


def test_a_step_that_comes_late_is_not_lost() -> None:
    walk = SimulatedWalk(straight(0.0), 30.0, poses=False)
    items = in_time_order(walk.messages(LEFT))
    late = next(e for e in items if e.address.subject == "foot_step" and e.message.sequence == 12)
    items.remove(late)
    after = next(i for i, e in enumerate(items) if e.message.time_ns > late.message.time_ns + 3 * NS)
    core = FusionCore(SINGLE, WHO, ORIGIN)
    out = feed(core, [*items[:after], late, late, *items[after:]])
    assert core.counters["late_foot_step"] == 1
    assert core.counters["duplicate_steps"] == 1  # the second copy
    assert core.counters["lost_steps"] == 1
    assert horizontal_error(out[-1], walk.foot_at(LEFT, 31.0)) < 0.2


def test_a_lost_step_is_made_good_by_the_poses_that_told_its_way() -> None:
    walk = SimulatedWalk(straight(0.0), 30.0)
    items = in_time_order(walk.messages(LEFT))
    lost = [e for e in items if e.address.subject == "foot_step" and e.message.sequence in (5, 12)]
    core = FusionCore(SINGLE, WHO, ORIGIN)
    out = feed(core, [*(e for e in items if e not in lost), *lost])  # and come when all is over
    assert core.counters["lost_steps"] == core.counters["steps_made_good"] == 2
    assert core.counters["duplicate_steps"] == 2
    assert horizontal_error(out[-1], walk.foot_at(LEFT, 31.0)) < 0.3


def test_late_satellites_are_dropped_and_a_late_fix_is_taken() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    items = in_time_order(walk.messages(LEFT))
    latitude, longitude, _ = FRAME.to_geodetic(30.0, 40.0, 0.0)
    fix = Fix(time_ns=T0 + 18 * NS, latitude_deg=latitude, longitude_deg=longitude, accuracy_m=0.5)
    core = FusionCore(SINGLE, WHO, ORIGIN)
    out = feed(core, [*items, gnss(0, 10.0, 500.0, 500.0), envelope("fix", "map", fix)])
    assert core.counters["late_gnss"] == 1
    assert core.counters["late_fix"] == 1
    assert math.hypot(out[-1].east_m - 30.0, out[-1].north_m - 40.0) < 3.0
    assert math.sqrt(out[-1].covariance_m2[0]) > 0.5 + 1.5  # two seconds and more late, at 1.5 m/s


@pytest.mark.parametrize(
    ("changes", "counter"),
    [
        ({"displacement_m": (1e6, 0.0, 0.0)}, "implausible_steps"),
        ({"covariance": upper_triangle(-np.eye(4))}, "bad_covariances"),
        ({"time_ns": T0 + 10**6 * NS}, "lost_steps"),
        ({"time_ns": 0, "start_time_ns": 0}, "late_foot_step"),
    ],
)
def test_a_broken_step_is_counted_and_survived(changes: dict[str, object], counter: str) -> None:
    walk = SimulatedWalk(straight(0.0), 40.0)
    items = in_time_order(walk.messages(LEFT))
    index = next(
        i for i, e in enumerate(items) if e.address.subject == "foot_step" and e.message.sequence == 12
    )
    items[index] = Envelope(items[index].address, msgspec.structs.replace(items[index].message, **changes))
    core = FusionCore(SINGLE, WHO, ORIGIN)
    out = feed(core, items)
    assert core.counters[counter] >= 1
    assert out[-1].time_ns < T0 + 60 * NS
    assert horizontal_error(out[-1], walk.foot_at(LEFT, 41.0)) < 2.0
    assert out[-1].mode == "boots"


def test_sources_that_are_not_configured_are_counted_and_ignored() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    plain, _ = run(SINGLE, walk.messages(LEFT))
    walk.rng = np.random.default_rng(1)
    out, core = run(SINGLE, walk.messages(LEFT), walk.messages(RIGHT))
    assert out == plain
    assert core.counters["unknown_sources"] > 100


def test_a_restarted_pdr_engine_is_followed_and_owned_up_to() -> None:
    walk = SimulatedWalk(straight(0.0), 40.0, poses=False)
    items = [
        e
        if e.message.sequence < 15
        else Envelope(e.address, msgspec.structs.replace(e.message, sequence=e.message.sequence - 15))
        for e in walk.messages(LEFT)
    ]
    out, core = run(SINGLE, items)
    assert core.counters["duplicate_steps"] == 0
    assert core.counters["lost_steps"] == 0
    assert core.counters["foot_restarts"] == 1
    assert horizontal_error(out[-1], walk.foot_at(LEFT, 41.0)) < 0.2


# --- the same answer, whatever happens on the way --------------------------------------------------------


def mixed_walk() -> list[Envelope]:
    walk = SimulatedWalk(rectangle(12, 8), 16.0, stand_s=1.0)
    left, right = (
        replace(LEFT, sigmas=(0.01, 0.01, 0.01, 0.002)),
        replace(RIGHT, sigmas=(0.01, 0.01, 0.01, 0.002)),
    )
    fixes = satellites(walk, np.arange(1.0, 16.0), error_m=1.0)
    return in_time_order(walk.messages(left), walk.messages(right), fixes)


MIXED = mixed_walk()


def published(config: FusionConfig, items: Iterable[Envelope]) -> list[bytes]:
    core = FusionCore(config, WHO, ORIGIN)
    return [wire.encode(position) for position in feed(core, items)]


REFERENCE = published(FusionConfig(start=EAST), MIXED)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_any_arrival_order_within_the_window_gives_the_same_bytes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arrival = [item.message.time_ns + rng.integers(0, 3 * NS // 10) for item in MIXED]
    shuffled = [MIXED[index] for index in np.argsort(arrival, kind="stable")]
    assert shuffled != MIXED
    assert published(FusionConfig(start=EAST), shuffled) == REFERENCE


def test_ticks_change_nothing_while_the_boots_speak() -> None:
    core = FusionCore(FusionConfig(start=EAST), WHO, ORIGIN)
    out: list[Envelope] = []
    for item in MIXED:
        out += core.handle(item)
        out += core.tick(item.message.time_ns + 400_000_000)
    out += core.close()
    assert [wire.encode(position) for position in positions(out)] == REFERENCE


def test_without_a_receiver_to_wait_for_positions_come_sooner_and_are_the_same() -> None:
    boots = [item for item in MIXED if item.address.subject != "gnss"]
    waiting, quick = FusionConfig(start=EAST), FusionConfig(start=EAST, gnss_sources=())

    def worst_wait(config: FusionConfig) -> float:
        core, waits = FusionCore(config, WHO, ORIGIN), []
        for item in boots:
            waits += [item.message.time_ns - out.message.time_ns for out in core.handle(item)]
        return max(waits[10:]) / NS

    assert published(waiting, boots) == published(quick, boots)
    assert worst_wait(quick) <= 0.3 < worst_wait(waiting)


def test_over_the_memory_bus_twice_gives_the_same_bytes() -> None:
    journals = []
    for _ in range(2):
        bus = MemoryBus()
        bus.attach(
            FusionCore(FusionConfig(start=EAST), WHO, ORIGIN), [WHO.selector(subject) for subject in SUBJECTS]
        )
        for item in MIXED:
            bus.publish(item)
        journals.append([entry for entry in bus.journal if "/position/" in entry[0]])
    assert len(journals[0]) > 50
    assert journals[0] == journals[1]
    assert journals[0][0][0] == "bp/@v1/alpha/a1/position/fusion"


# --- honest ----------------------------------------------------------------------------------------------


def nees_of_a_walk(seed: int, dual: bool) -> float:
    """Normalised error squared (2-D) at the end of a walk whose errors are what the filter assumes."""
    rng = np.random.default_rng(seed)
    sigmas = (0.03, 0.03, 0.03, 0.01)
    offset, azimuth = rng.normal(size=2) * 0.5, rng.normal() * math.radians(4.0)
    walk = SimulatedWalk(rectangle(20, 12), 45.0, stated=sigmas, poses=False, rng=rng)
    feet = [replace(LEFT, sigmas=sigmas, sideways_m=0.0), replace(RIGHT, sigmas=sigmas, sideways_m=0.0)]
    config = FusionConfig(
        feet=("left_foot", "right_foot") if dual else ("left_foot",),
        gnss_sources=(),
        rate_hz=1.0,
        boots=FeetConfig(scale_sigma=0.0, heading_walk_rad_sqrt_s=0.0, pose_sigma_m=0.01),
        start=StartConfig(
            east_m=offset[0],
            north_m=offset[1],
            sigma_m=0.5,
            azimuth_deg=90.0 - math.degrees(azimuth),
            azimuth_sigma_deg=4.0,
        ),
    )
    out, _ = run(config, *[walk.messages(foot) for foot in feet[: len(config.feet)]])
    last = out[-1]
    ee, en, _, nn, _, _ = last.covariance_m2
    error = np.array([last.east_m, last.north_m]) - walk.stance(feet[0], 45.0)[:2]
    return float(error @ np.linalg.solve([[ee, en], [en, nn]], error))


@pytest.mark.parametrize("dual", [False, True])
def test_inside_95_percent_is_95_percent(dual: bool) -> None:
    squared = np.array([nees_of_a_walk(seed, dual) for seed in range(100)])
    inside_pct = 100.0 * np.mean(squared < 5.991)
    assert 90.0 <= inside_pct <= 99.0
    assert 1.4 < squared.mean() < 2.6


def test_silence_settings_are_used() -> None:
    walk = SimulatedWalk(straight(0.0), 10.0)
    config = FusionConfig(
        feet=("left_foot",), gnss_sources=(), start=EAST, silence=SilenceConfig(lost_s=5.0, drift_m_s=0.1)
    )
    core = FusionCore(config, WHO, ORIGIN)
    out = [m for item in walk.messages(LEFT) for m in core.handle(item)]
    for second in range(12, 30):
        out += core.tick(T0 + second * NS)
    assert positions(out)[-1].mode == "lost"
    assert positions(out)[-1].covariance_m2[0] < 10.0


def test_floor_is_told_only_when_storeys_are_known() -> None:
    start = StartConfig(east_m=0.0, north_m=0.0, up_m=6.4, azimuth_deg=90.0)
    walk = SimulatedWalk(straight(0.0), 10.0)
    without, _ = run(replace_start(SINGLE, start), walk.messages(LEFT))
    with_storeys, _ = run(
        msgspec.structs.replace(replace_start(SINGLE, start), floor_height_m=3.2), walk.messages(LEFT)
    )
    assert without[-1].floor is None
    assert with_storeys[-1].floor == 2


def test_poses_of_another_step_are_counted_not_believed() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    stray = FootPose(
        time_ns=T0 + 10 * NS + 1,
        sequence=100,
        step_sequence=9999,
        displacement_m=(50.0, 0.0, 0.0),
        heading_change_rad=0.0,
        speed_m_s=0.0,
        in_stance=False,
    )
    out, core = run(SINGLE, walk.messages(LEFT), [envelope("foot_pose", "left_foot", stray)])
    assert core.counters["poses_without_step"] >= 1
    for position in out:
        assert position.east_m < 40.0


def test_step_and_pose_messages_are_what_the_table_says() -> None:
    kinds = {type(item.message) for item in MIXED}
    assert kinds == {FootStep, FootPose, GnssFix}
