"""Event time at a speed, and event time that follows the data."""

import pytest

from bootprint.clock import DataClock, ScaledClock, make_clock
from bootprint.errors import ConfigError

ORIGIN_NS = 1_700_000_000_000_000_000
S = 1_000_000_000


class Host:
    """A host clock set by hand."""

    def __init__(self) -> None:
        self.now_ns = ORIGIN_NS

    def __call__(self) -> int:
        return self.now_ns


def test_event_time_runs_at_speed_from_the_origin() -> None:
    host = Host()
    clock = ScaledClock(10.0, ORIGIN_NS, host)
    assert clock.now_ns() == ORIGIN_NS
    host.now_ns += 3 * S
    assert clock.now_ns() == ORIGIN_NS + 30 * S
    host.now_ns = ORIGIN_NS - 1 * S
    assert clock.now_ns() == ORIGIN_NS - 10 * S


def test_host_seconds_are_event_seconds_divided_by_speed() -> None:
    host = Host()
    clock = ScaledClock(10.0, ORIGIN_NS, host)
    host.now_ns += 3 * S
    assert clock.host_seconds_since(ORIGIN_NS + 10 * S) == pytest.approx(2.0)
    assert clock.host_seconds_until(ORIGIN_NS + 35 * S) == pytest.approx(0.5)
    assert clock.host_seconds_until(ORIGIN_NS) == 0.0


def test_stamps_do_not_move_a_scaled_clock() -> None:
    clock = ScaledClock(1.0, ORIGIN_NS, Host())
    clock.observe(ORIGIN_NS + 99 * S)
    assert clock.now_ns() == ORIGIN_NS


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_speed_must_be_positive(speed: float) -> None:
    with pytest.raises(ValueError, match="speed must be positive"):
        ScaledClock(speed, ORIGIN_NS)


def test_the_data_clock_follows_the_newest_stamp() -> None:
    clock = DataClock()
    assert clock.now_ns() == 0
    for stamp_ns in (5, 9, 7):
        clock.observe(stamp_ns)
    assert clock.now_ns() == 9
    assert clock.host_seconds_since(3) is None
    assert clock.host_seconds_until(1_000 * S) == 0.0


def test_the_command_line_chooses_the_clock() -> None:
    assert isinstance(make_clock("max", None), DataClock)
    clock = make_clock("2", 1_700_000_000.0)
    assert isinstance(clock, ScaledClock)
    # Its origin stands still at any speed: 1 s of event time there is half a second of host time.
    since_s = clock.host_seconds_since(ORIGIN_NS)
    earlier_s = clock.host_seconds_since(ORIGIN_NS - 1 * S)
    assert since_s is not None
    assert earlier_s is not None
    assert earlier_s - since_s == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize(
    ("speed", "origin_s", "said"),
    [
        ("abc", None, "--speed 'abc' must be a positive number or 'max'"),
        ("nan", None, "--speed 'nan'"),
        ("0", None, "--speed '0'"),
        ("1e6", None, "--speed '1e6'"),
        ("1", float("nan"), "--clock-origin nan must be UTC seconds since 1970"),
        ("max", float("inf"), "--clock-origin inf"),
        ("1", -1.0, "--clock-origin -1.0"),
        ("1", 4_102_444_800.0, "--clock-origin 4102444800.0"),
    ],
)
def test_a_clock_that_cannot_be_is_refused(speed: str, origin_s: float | None, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        make_clock(speed, origin_s)


def test_a_clock_that_is_wrong_is_wrong_by_its_offset() -> None:
    right, ahead = make_clock("1", None), make_clock("1", None, 3600.0)
    assert (ahead.now_ns() - right.now_ns()) / 1e9 == pytest.approx(3600.0, abs=5.0)
