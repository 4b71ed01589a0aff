"""Wrong clocks, restarts and absurd numbers: counted, said in health, and never the end of positions."""

import itertools
import math
from collections.abc import Callable, Iterator

import msgspec
import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import Fix, FootPose, FootStep, GnssFix, Health, Position
from fusion.config import FusionConfig, StartConfig
from fusion.engine import FusionCore
from fusion.feet import StepLedger
from support.foot_walks import NS, T0, WHO, envelope

ORIGIN = Origin(latitude_deg=59.35, longitude_deg=18.07, height_m=40.0)
FRAME = LocalFrame(ORIGIN)
EAST = StartConfig(east_m=0.0, north_m=0.0, azimuth_deg=90.0)
CONFIG = FusionConfig(feet=("left_foot",), start=EAST)
STEP_M = 1.3
SMALL = (1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-6)
Change = Callable[[Envelope], Envelope]


def second_of_walk(number: int, begin_ns: int = T0) -> Iterator[Envelope]:
    """A step of 1.3 m that ends now, then the ten poses of the next: straight east at 1.3 m/s."""
    time_ns = begin_ns + number * NS
    yield envelope(
        "foot_step",
        "left_foot",
        FootStep(
            time_ns=time_ns,
            sequence=number,
            start_time_ns=time_ns - NS,
            displacement_m=(STEP_M, 0.0, 0.0),
            heading_change_rad=0.0,
            covariance=SMALL,
            motion="walking",
        ),
    )
    for tenth in range(10):
        yield envelope(
            "foot_pose",
            "left_foot",
            FootPose(
                time_ns=time_ns + tenth * NS // 10,
                sequence=10 * number + tenth,
                step_sequence=number,
                displacement_m=(STEP_M * tenth / 10, 0.0, 0.0),
                heading_change_rad=0.0,
                speed_m_s=STEP_M,
                in_stance=False,
            ),
        )


def gnss(number: int, time_s: float, east_m: float, stamped_off_s: float = 0.0) -> Envelope:
    latitude, longitude, _ = FRAME.to_geodetic(east_m, 0.0, 0.0)
    message = GnssFix(
        time_ns=T0 + round((time_s + stamped_off_s) * NS),
        sequence=number,
        fix_kind="3d",
        latitude_deg=latitude,
        longitude_deg=longitude,
        horizontal_accuracy_m=2.0,
    )
    return envelope("gnss", "gnss", message)


def true_east(time_s: float) -> float:
    """The foot of `second_of_walk`: at 1.3 m when the first step has ended."""
    return STEP_M * (1.0 + time_s)


def walk(
    core: FusionCore,
    seconds: int = 40,
    *,
    change: Change = lambda item: item,
    fix_off_s: float | None = None,
    fix_delay_s: float = 0.1,
) -> list[Position]:
    """A live walk: boots arrive when stamped, satellites (one a second) later, ticks in between."""
    arrivals = [
        (item.message.time_ns, change(item)) for number in range(seconds) for item in second_of_walk(number)
    ]
    if fix_off_s is not None:
        for number in range(10, seconds - math.ceil(fix_delay_s)):
            time_s = number + 0.5
            fix = gnss(number - 10, time_s, true_east(time_s), fix_off_s)
            arrivals.append((T0 + round((time_s + fix_delay_s) * NS), fix))
    arrivals.sort(key=lambda arrival: arrival[0])
    out: list[Envelope] = []
    ticks = itertools.count(T0, NS // 20)
    tick = next(ticks)
    for at_ns, item in arrivals:
        while tick <= at_ns:
            out += core.tick(tick)
            tick = next(ticks)
        out += core.handle(item)
    return [item.message for item in out if isinstance(item.message, Position)]


def new_core(config: FusionConfig = CONFIG) -> FusionCore:
    return FusionCore(config, WHO, ORIGIN)


def seconds_of(position: Position) -> float:
    return (position.time_ns - T0) / NS


def assert_whole(out: list[Position], seconds: int = 40) -> None:
    """Positions all the walk long, five a second, and where the foot was."""
    stamps = [position.time_ns for position in out]
    assert stamps == list(range(stamps[0], stamps[-1] + 1, NS // 5))
    assert seconds_of(out[-1]) >= seconds - 1.0
    assert out[-1].east_m == pytest.approx(true_east(seconds_of(out[-1])), abs=1.5)


# --- stamps ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("off_s", [15.0, 600.0, 3600.0, 54 * 365 * 86400.0])
def test_a_receiver_with_the_wrong_time_is_refused_said_so_and_stops_nobody(off_s: float) -> None:
    core = new_core()
    assert_whole(walk(core, fix_off_s=off_s))
    assert core.counters["implausible_stamps"] == 29
    assert core.counters["late_foot_step"] == 0
    figures = core.figures()
    assert figures.state == "degraded"
    assert "stamped" in figures.note


def test_a_receiver_five_seconds_ahead_makes_no_step_late() -> None:
    core = new_core()
    out = walk(core, fix_off_s=5.0)
    assert seconds_of(out[-1]) >= 39.0
    assert core.counters["late_foot_step"] == core.counters["late_foot_pose"] == 0


def test_two_seconds_of_poses_in_the_future_carry_nobody_along() -> None:
    def change(item: Envelope) -> Envelope:
        bad = isinstance(item.message, FootPose) and 100 <= item.message.sequence < 120
        return moved(item, 10**18) if bad else item

    core = new_core()
    assert_whole(walk(core, change=change))
    assert core.counters["implausible_stamps"] == 20
    assert core.counters["late_foot_step"] == 0


@pytest.mark.parametrize("stamp_ns", [2**63 - 1, -(2**63), T0 + 10**18, 0])
def test_a_first_stamp_that_is_wrong_is_got_over(stamp_ns: int) -> None:
    def change(item: Envelope) -> Envelope:
        first = isinstance(item.message, FootPose) and item.message.sequence == 0
        return (
            Envelope(item.address, msgspec.structs.replace(item.message, time_ns=stamp_ns)) if first else item
        )

    core, out = new_core(), []
    items = [item for number in range(40) for item in second_of_walk(number)]
    for item in items[1:]:  # the pose first, and no tick: nobody knows better
        out += core.handle(change(item))
    last = out[-1].message
    assert isinstance(last, Position)
    assert 38 * NS < last.time_ns - T0 < 40 * NS


def moved(item: Envelope, by_ns: int) -> Envelope:
    return Envelope(item.address, msgspec.structs.replace(item.message, time_ns=item.message.time_ns + by_ns))


def test_boots_an_hour_behind_the_host_get_positions_in_their_own_time() -> None:
    core, out = new_core(), []
    for tick in range(100):
        out += core.tick(T0 + 3600 * NS + tick * NS // 20)
    for number in range(40):
        for item in second_of_walk(number):
            out += core.handle(item)
        out += core.tick(T0 + (3605 + number) * NS)
    positions = [item.message for item in out if isinstance(item.message, Position)]
    assert seconds_of(positions[-1]) > 38.0
    assert positions[-1].east_m == pytest.approx(true_east(seconds_of(positions[-1])), abs=0.5)
    assert core.counters["clock_set_back"] == 1


def test_a_clock_set_back_in_the_middle_of_a_walk_is_followed() -> None:
    core, out = new_core(), []
    for number in range(60):
        begin_ns = T0 if number < 20 else T0 - 3600 * NS
        for item in second_of_walk(number, begin_ns):
            out += core.handle(item)
        out += core.tick(begin_ns + number * NS + 9 * NS // 10)
    positions = [item.message for item in out if isinstance(item.message, Position)]
    last = positions[-1]
    assert seconds_of(last) + 3600 > 58.0
    assert last.east_m == pytest.approx(true_east(seconds_of(last) + 3600), abs=0.5)
    assert last.mode == "boots"
    assert core.counters["clock_set_back"] == 1
    for tick in range(1, 120):  # what was heard before is old in the new time too
        out += core.tick(begin_ns + 60 * NS + tick * NS // 2)
    assert {item.message.mode for item in out[-20:] if isinstance(item.message, Position)} >= {"coasting"}


def test_fixes_from_the_far_future_do_not_fill_the_buffer() -> None:
    core = new_core()
    numbers = itertools.count()
    out: list[Envelope] = []
    for number in range(30):
        for item in second_of_walk(number):
            out += core.handle(item)
            for _ in range(20):
                ahead = next(numbers)
                fix = Fix(
                    time_ns=T0 + (ahead + 10**6) * NS, sequence=ahead, latitude_deg=59.0, longitude_deg=18.0
                )
                out += core.handle(envelope("fix", "map", fix))
    assert core.counters["implausible_stamps"] == 30 * 11 * 20
    assert core.figures().gauges["waiting"] < 10
    assert len(out) > 140


# --- late satellites ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("delay_s", [0.6, 0.9, 2.5])
def test_satellites_that_come_late_are_carried_along_and_used(delay_s: float) -> None:
    core = new_core()
    out = walk(core, fix_off_s=0.0, fix_delay_s=delay_s)
    assert_whole(out)
    assert core.counters["late_gnss"] > 25
    assert core.counters["gnss_accepted"] > 25
    assert out[-1].mode == "gnss"
    assert core.figures().state == "ok"
    assert out[-1].east_m == pytest.approx(true_east(seconds_of(out[-1])), abs=0.2)


def test_late_satellites_still_place_a_soldier() -> None:
    core = new_core(FusionConfig(feet=("left_foot",)))
    out = walk(core, 90, fix_off_s=0.0, fix_delay_s=2.0)
    assert core.counters["placed"] == 1
    assert out[-1].east_m == pytest.approx(true_east(seconds_of(out[-1])), abs=0.5)


def test_satellites_that_come_too_late_are_not_used_and_health_says_so() -> None:
    core = new_core()
    assert_whole(walk(core, fix_off_s=0.0, fix_delay_s=5.0))
    assert core.counters["gnss_accepted"] == 0
    assert core.counters["gnss_too_late"] == core.counters["late_gnss"] > 20
    figures = core.figures()
    assert (figures.state, figures.note.split("; ")[0]) == ("degraded", "boots")
    assert "too late" in figures.note


# --- restarts ----------------------------------------------------------------------------------------------


def test_who_joins_a_walk_under_way_does_not_claim_to_be_at_the_door() -> None:
    core, out = new_core(), []
    for number in range(500, 540):
        for item in second_of_walk(number):
            out += core.handle(item)
    positions = [item.message for item in out if isinstance(item.message, Position)]
    assert {position.mode for position in positions} == {"unplaced"}
    assert core.counters["start_refused"] == 1
    figures = core.figures()
    assert figures.state == "degraded"
    assert "start not taken" in figures.note


def test_before_the_first_step_nothing_is_claimed() -> None:
    core = new_core(msgspec.structs.replace(CONFIG, gnss_sources=()))
    nowhere = msgspec.structs.replace(gnss(0, 0.0, 0.0).message, fix_kind="none")
    out = [*core.handle(envelope("gnss", "gnss", nowhere)), *core.close()]
    assert {item.message.mode for item in out if isinstance(item.message, Position)} <= {"unplaced"}
    out = [*core.handle(next(second_of_walk(1))), *core.close()]
    assert core.counters["start_refused"] == 1


def test_a_foot_that_begins_anew_is_told_from_loss() -> None:
    ledger = StepLedger()
    for sequence in (0, 1, 4):
        entry = ledger.enter(sequence, newer=True)
    assert entry is not None
    assert entry.lost == 2
    entry = ledger.enter(2, newer=True)  # was missing, but this is later than the last: another life
    assert entry is not None
    assert (entry.lost, entry.anew, entry.unseen) == (0, True, 1)
    assert ledger.enter(1, newer=False) is None


# --- absurd numbers ----------------------------------------------------------------------------------------


def changed_step(number: int, **changes: object) -> Change:
    def change(item: Envelope) -> Envelope:
        if not isinstance(item.message, FootStep) or item.message.sequence != number:
            return item
        return Envelope(item.address, msgspec.structs.replace(item.message, **changes))

    return change


@pytest.mark.parametrize("size", [1e308, 1e155, 1e9])
def test_a_huge_covariance_is_refused_and_not_the_end(size: float) -> None:
    core = new_core()
    covariance = (size, 0.0, 0.0, 0.0, size, 0.0, 0.0, size, 0.0, size)
    assert_whole(walk(core, change=changed_step(20, covariance=covariance)))
    assert core.counters["bad_covariances"] == 1


def test_a_step_of_a_long_life_and_a_great_leap_is_implausible() -> None:
    core = new_core()
    out = walk(core, change=changed_step(20, start_time_ns=-(2**63), displacement_m=(1e9, 0.0, 0.0)))
    assert core.counters["implausible_steps"] == 1
    assert out[-1].east_m == pytest.approx(true_east(seconds_of(out[-1])) - STEP_M, abs=0.5)


def test_a_pose_a_world_away_is_refused() -> None:
    def change(item: Envelope) -> Envelope:
        if not isinstance(item.message, FootPose) or item.message.sequence % 10 != 5:
            return item
        return Envelope(
            item.address, msgspec.structs.replace(item.message, displacement_m=(1e308, 1e308, 0.0))
        )

    core = new_core()
    assert_whole(walk(core, change=change))
    assert core.counters["implausible_poses"] == 40


@pytest.mark.parametrize("field", ["horizontal_accuracy_m", "vertical_accuracy_m", "hdop", "height_m"])
def test_absurd_satellite_and_human_figures_are_survived(field: str) -> None:
    core = new_core()
    fix = msgspec.structs.replace(
        gnss(0, 20.0, 26.0).message, height_m=40.0, horizontal_accuracy_m=None, hdop=1.0
    )
    items = [item for number in range(40) for item in second_of_walk(number)]
    items.insert(225, envelope("gnss", "gnss", msgspec.structs.replace(fix, **{field: 1e308})))
    word = Fix(time_ns=T0 + 25 * NS, latitude_deg=59.35, longitude_deg=18.07, accuracy_m=1e308)
    items.insert(280, envelope("fix", "map", msgspec.structs.replace(word, height_m=1e308)))
    items.insert(290, envelope("fix", "map", msgspec.structs.replace(word, sequence=1)))
    out = [item.message for each in items for item in core.handle(each)]
    assert core.counters["fixes_out_of_range"] == 1
    assert out[-1].time_ns > T0 + 38 * NS


def test_absurd_sequence_numbers_leave_health_tellable_and_memory_bounded() -> None:
    def change(item: Envelope) -> Envelope:
        if not isinstance(item.message, FootStep) or item.message.sequence % 2 == 0:
            return item
        return Envelope(item.address, msgspec.structs.replace(item.message, sequence=2**63 - 1))

    core = new_core()
    walk(core, change=change)
    figures = core.figures()
    assert figures.counters["lost_steps"] <= 40_000
    health = Health(
        time_ns=T0, service="fusion", state="ok", counters=figures.counters, gauges=figures.gauges
    )
    assert wire.decode("health", wire.encode(health)) == health


def test_what_is_missing_is_bounded_in_all() -> None:
    ledger = StepLedger()
    for leap in range(20):
        ledger.enter(leap * 5000, newer=True)
    assert len(ledger.missing) == 1000
    entry = ledger.enter(19 * 5000 - 1, newer=False)
    assert entry is not None
    assert entry.lost == 0
