"""Device clocks mapped to UTC: monotonic whatever comes, close to the truth under jitter and drift."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensor_gateway.clock import DeviceClock
from sensor_gateway.offset_line import MinimumDelayLine
from support.sensor_device import UTC_NS

MS, S = 1_000_000, 1_000_000_000


def errors_ns(
    clock: DeviceClock, *, seconds: float, drift: float = 0.0, jitter_ms: float = 20.0, seed: int = 1
) -> list[int]:
    """Feed a 100 Hz device whose samples are delayed by 1 ms and an exponential jitter; mapped minus true UTC."""
    noise = random.Random(seed)
    errors, received = [], 0
    for number in range(int(seconds * 100)):
        device = 3 * S + number * 10 * MS
        true = UTC_NS + round(number * 10 * MS * (1.0 + drift))
        received = max(received, true + MS + round(noise.expovariate(1.0 / (jitter_ms * MS))))
        errors.append(clock.utc_ns(device, received) - true)
    return errors


def test_jitter_is_filtered_away() -> None:
    """20 ms of mean jitter: what is left is the constant delay of 1 ms, give or take a fraction."""
    errors = errors_ns(DeviceClock(), seconds=40)
    assert max(abs(error - MS) for error in errors[2000:]) < 0.5 * MS


@pytest.mark.parametrize("drift", [-100e-6, 100e-6])
def test_drift_is_followed(drift: float) -> None:
    """100 ppm for 200 s is 20 ms, which a constant offset would be wrong by."""
    errors = errors_ns(DeviceClock(), seconds=200, drift=drift)
    assert max(abs(error - MS) for error in errors[10000:]) < 2.0 * MS


@given(st.integers(0, 2**32), st.floats(-150e-6, 150e-6), st.floats(0.1, 100.0))
@settings(max_examples=20, deadline=None)
def test_the_error_is_never_more_than_the_first_delay(seed: int, drift: float, jitter_ms: float) -> None:
    """After a while: between not early (beyond the drift within a window) and a part of the jitter late."""
    errors = errors_ns(DeviceClock(), seconds=90, drift=drift, jitter_ms=jitter_ms, seed=seed)
    assert max(errors[7000:]) < (1.0 + 1.0 * jitter_ms) * MS
    assert min(errors[7000:]) > -10.0 * MS


steps = st.tuples(
    st.one_of(st.integers(1, 50 * MS), st.integers(1, 20 * S), st.integers(-(10**15), -2 * S)),
    st.one_of(st.integers(0, 50 * MS), st.integers(-100 * S, 100 * S)),
)


@given(st.lists(steps, min_size=1, max_size=60))
@settings(deadline=None)
def test_stamps_never_go_back_uncounted_for_stamps_that_advance_or_restart(
    moves: list[tuple[int, int]],
) -> None:
    """Whatever device (advance, leap, restart) and host (delay, set forward, set back) do."""
    clock = DeviceClock()
    device, received = 10**16, UTC_NS
    newest = clock.utc_ns(device, received)
    for device_step, host_step in moves:
        device, received = device + device_step, received + host_step
        counted = clock.set_backs
        mapped = clock.utc_ns(device, received)
        assert mapped > newest or clock.set_backs > counted
        newest = mapped


def test_intervals_stay_true_while_the_offset_is_corrected() -> None:
    """The first sample comes 90 ms late: the correction is spread, no interval is wrong by more than 0.5 %."""
    clock = DeviceClock()
    stamps = [clock.utc_ns(0, UTC_NS + 90 * MS)]
    stamps += [clock.utc_ns(number * 5 * MS, UTC_NS + MS + number * 5 * MS) for number in range(1, 6000)]
    intervals = [later - earlier for earlier, later in pairwise(stamps)]
    assert min(intervals) >= 5 * MS * 0.995 - 1
    assert stamps[-1] == UTC_NS + MS + 5999 * 5 * MS
    assert clock.behind_ns == 0


def test_a_restart_of_the_device_begins_a_new_epoch_and_is_counted() -> None:
    clock = DeviceClock()
    clock.utc_ns(500 * S, UTC_NS)
    assert clock.utc_ns(2 * S, UTC_NS + 7 * S) == UTC_NS + 7 * S
    assert clock.resets == 1


def test_a_wrapped_millisecond_counter_is_a_new_epoch() -> None:
    clock = DeviceClock()
    clock.utc_ns((2**32 - 1) * MS, UTC_NS)
    assert clock.utc_ns(4 * MS, UTC_NS + 5 * MS) == UTC_NS + 5 * MS
    assert clock.resets == 1


def test_a_device_that_learns_the_date_leaps_but_its_stamps_do_not() -> None:
    clock = DeviceClock()
    clock.utc_ns(10 * S, UTC_NS)
    assert clock.utc_ns(UTC_NS + 3 * S, UTC_NS + 5 * MS) == UTC_NS + 5 * MS
    assert clock.resets == 1


def test_disorder_within_a_second_is_no_restart() -> None:
    clock = DeviceClock()
    clock.utc_ns(10 * S, UTC_NS)
    assert clock.utc_ns(10 * S - 20 * MS, UTC_NS + MS) == UTC_NS - 20 * MS
    assert clock.resets == 0


def test_the_host_clock_set_forward_is_followed_after_two_seconds() -> None:
    """A computer without a battery-backed clock gets the date from the network while the boots run."""
    clock = DeviceClock()
    year = 365 * 86_400 * S
    for number in range(100):
        clock.utc_ns(number * 10 * MS, UTC_NS + number * 10 * MS)
    for number in range(100, 400):
        mapped = clock.utc_ns(number * 10 * MS, UTC_NS + year + number * 10 * MS)
    assert mapped == UTC_NS + year + 3990 * MS
    assert (clock.steps, clock.resets) == (1, 0)


def test_a_stalled_computer_does_not_move_the_offset() -> None:
    """Five seconds of backlog arrive at once: the samples keep the times at which they were taken."""
    clock = DeviceClock()
    for number in range(200):
        clock.utc_ns(number * 10 * MS, UTC_NS + number * 10 * MS)
    stamps = [clock.utc_ns(number * 10 * MS, UTC_NS + 7 * S) for number in range(200, 700)]
    assert stamps == [UTC_NS + number * 10 * MS for number in range(200, 700)]
    assert (clock.steps, clock.resets) == (0, 0)


def test_the_device_s_own_utc_goes_before_the_host_s() -> None:
    clock = DeviceClock()
    clock.observe(4 * S, UTC_NS - 60 * S)  # the computer is a minute slow
    clock.state_utc(4 * S, UTC_NS)
    assert clock.utc_ns(5 * S, UTC_NS - 59 * S) == UTC_NS + S


WEEKS_1024 = 1024 * 7 * 86_400 * S


def stamp_error_ns(clock: DeviceClock, second: int, stated_error_ns: int | None = 0) -> int:
    """One second of a 10 Hz device, whose first sample comes with its word on UTC; the last stamp's error."""
    for tenth in range(10):
        device = second * S + tenth * 100 * MS
        error = clock.utc_ns(device, UTC_NS + device) - UTC_NS - device
        if tenth == 0 and stated_error_ns is not None:
            clock.state_utc(device, UTC_NS + device + stated_error_ns)
    return error


def test_one_wrong_statement_of_utc_is_not_believed() -> None:
    """A receiver's week counter wraps for one message."""
    clock = DeviceClock()
    statements = [0] * 5 + [WEEKS_1024] + [0] * 5 + [WEEKS_1024, -WEEKS_1024, WEEKS_1024] + [0] * 3
    assert {stamp_error_ns(clock, second, error) for second, error in enumerate(statements)} == {0}
    assert (clock.doubted, clock.steps, clock.set_backs) == (4, 0, 0)


def test_the_same_statement_over_three_ways_is_one() -> None:
    clock = DeviceClock()
    stamp_error_ns(clock, 0)
    for _ in range(5):
        clock.state_utc(S, UTC_NS + S + WEEKS_1024)
    assert stamp_error_ns(clock, 1, None) == 0


def test_statements_that_agree_are_believed_and_taken_back_when_better_ones_agree() -> None:
    """Forward with the third; back with the third and five seconds, once, instead of at half a percent."""
    clock = DeviceClock()
    errors = [stamp_error_ns(clock, second, WEEKS_1024 if 2 <= second < 6 else 0) for second in range(20)]
    assert errors[:5] == [0, 0, 0, 0, WEEKS_1024]
    assert errors[7] > WEEKS_1024 - S
    assert errors[14:] == [0] * 6
    assert (clock.steps, clock.set_backs, clock.resets) == (2, 1, 0)


def test_a_host_clock_set_back_is_followed_after_five_seconds() -> None:
    clock = DeviceClock()
    for number in range(100):
        clock.utc_ns(number * 10 * MS, UTC_NS + number * 10 * MS)
    behind = [
        clock.utc_ns(n * 10 * MS, UTC_NS - 3600 * S + n * 10 * MS) - n * 10 * MS for n in range(100, 800)
    ]
    assert min(behind[:490]) > UTC_NS - S
    assert behind[510] == UTC_NS - 3600 * S
    assert clock.set_backs == 1


def test_a_second_too_far_ahead_is_made_up_slowly() -> None:
    clock = DeviceClock()
    for number in range(100):
        clock.utc_ns(number * 10 * MS, UTC_NS + number * 10 * MS)
    stamps = [clock.utc_ns(n * 10 * MS, UTC_NS - 900 * MS + n * 10 * MS) for n in range(100, 3000)]
    assert all(later > earlier for earlier, later in pairwise(stamps))
    assert clock.set_backs == 0


def test_the_line_lies_under_its_points_and_knows_the_slope() -> None:
    line = MinimumDelayLine()
    points = [(second * S, 5 * MS + second * 50_000 + (0 if second % 4 else 3 * MS)) for second in range(50)]
    for time, offset in points:
        line.add(time, offset)
    assert line.slope == pytest.approx(50e-6, rel=1e-6)
    assert all(line.at(time) <= offset for time, offset in points)
    assert line.at(60 * S) == pytest.approx(8 * MS, abs=10)
