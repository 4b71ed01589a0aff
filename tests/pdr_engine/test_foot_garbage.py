"""Streams that no sensor should give: stamps too close, sizes that cannot be, wrong units, and plain garbage."""

import math

import numpy as np
import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Origin, convert
from bootprint.messages import ImuBatch
from bootprint.topics import Identity
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.foot import METHODS, FootNavigator
from pdr_engine.foot.memory import RING
from support.foot_streams import START_NS, Stream, Track, navigate, still, walk

ME = Identity("bp", "alpha", "a1")
PLACE = Origin(latitude_deg=59.0, longitude_deg=18.0)
WALK = walk(6)
SECOND_NS = 1_000_000_000
INTERVALS_NS = (5e6, 1.25e6, 16.7e6, 50e6, 70e6, 1e4, 1.0)


def walked_m(track: Track) -> float:
    return sum(step.horizontal_length_m for step in track.steps)


def intervals(rng: np.random.Generator, count: int) -> np.ndarray:
    """Time from stamp to stamp, ns: even, exponential or any, and now and then back or far ahead."""
    kind = rng.integers(0, 3)
    step = np.full(count, rng.choice(INTERVALS_NS))
    if kind == 1:
        step = rng.exponential(5e6, count)
    if kind == 2:
        step = rng.choice([1.0, 1e3, 1e6, 5e6, 49e6, 51e6, 9e8, 2e9], count)
    if rng.random() < 0.5:
        leaps = rng.random(count) < 0.01
        step[leaps] = rng.choice([-1.0, -1e7, -1e9, -1e15, 6e7, 9e8, 3e9, 1e17], leaps.sum())
    return step.astype(np.int64)


def vectors(rng: np.random.Generator, count: int, size: float) -> np.ndarray:
    """Noise, rest, saturation, swings in turns, or single values of any size."""
    values = rng.normal(0.0, size, (count, 3)) * rng.choice([0.0, 1e-3, 0.1, 1.0])
    kind = rng.integers(0, 4)
    if kind == 1:
        values = np.clip(3.0 * values, -size, size)
    if kind == 2:
        values[(np.arange(count) // 100) % 2 == 0] = 0.0
    if kind == 3:
        wild = rng.random(count) < 0.01
        values[wild] = rng.choice([-1.0, 1.0], (wild.sum(), 3)) * 10.0 ** rng.uniform(
            -320, 308, (wild.sum(), 1)
        )
    return values


@pytest.mark.parametrize("seed", range(60))
def test_garbage_is_survived_and_told_in_finite_messages(seed: int) -> None:
    """Each message checks itself when it is built."""
    rng = np.random.default_rng(seed)
    count = 1200
    times = START_NS + np.cumsum(np.concatenate([intervals(rng, count // 3) for _ in range(3)]))
    accel = vectors(rng, count, 30.0) + np.array([0.0, 0.0, rng.choice([0.0, 9.81, 9.81, 9.81])])
    gyro, mag = vectors(rng, count, 10.0), vectors(rng, count, 30.0) + np.array([20.0, 0.0, -40.0])
    config = convert({"foot": {"method": METHODS[seed % len(METHODS)]}}, PdrConfig, where="test")
    core = EngineCore(config, ME, PLACE)
    for begin in range(0, count, 50):
        cut = slice(begin, begin + 50)
        field = mag[cut] if rng.random() < 0.8 else None
        batch = ImuBatch.from_arrays(0, times[cut], accel[cut], gyro[cut], field)
        for envelope in core.handle(Envelope(ME.address("imu", "left_foot"), batch)):
            wire.encode(envelope.message)
    list(core.close())
    counters = core.figures().counters
    assert counters["left_foot_accepted"] + counters["left_foot_dropped"] == count


def test_stamps_closer_than_any_sensor_s_are_refused() -> None:
    """A thousand within a microsecond would shrink the usual interval until 49 ms lack thousands of samples."""
    burst = still(5.0)
    burst.time_ns[:] = START_NS + np.arange(len(burst.time_ns))
    after = still(2.0)
    after.time_ns += 49_000_000
    track = navigate(Stream.joined(burst, after))
    assert track.counters["dropped"] == len(burst.time_ns) - 1
    assert track.counters["missing"] == 0
    assert len(track.time_ns) == len(after.time_ns) + 1


def test_what_waits_for_an_alignment_never_outgrows_the_ring() -> None:
    """Shaken at 15 Hz, where every interval is a gap, no window can be judged; then the sensor is quick."""
    slow, quick = still(300.0, rate_hz=15.0, noise=100.0), WALK
    assert len(slow.time_ns) > 2 * RING
    navigator = FootNavigator()
    navigator.process(slow.time_ns, slow.accel, slow.gyro)
    assert navigator._state["head"][0] - navigator._state["start"][0] < RING
    time_ns = quick.time_ns - quick.time_ns[0] + slow.time_ns[-1] + 5_000_000
    steps = [
        step
        for made in (navigator.process(time_ns, quick.accel, quick.gyro), navigator.finish())
        for step in made.steps
    ]
    assert sum(step.horizontal_length_m for step in steps) == pytest.approx(
        walked_m(navigate(WALK)), rel=0.01
    )


@pytest.mark.parametrize("sensor", ["accel", "gyro"])
@pytest.mark.parametrize("size", [1e6, 1e12, 1e200])
def test_a_sample_of_a_size_that_cannot_be_is_as_one_that_never_came(sensor: str, size: float) -> None:
    """Its square would stay in the detector's running sums."""
    wild, without = (
        Stream(WALK.time_ns, WALK.accel.copy(), WALK.gyro.copy()),
        np.ones(len(WALK.time_ns), bool),
    )
    getattr(wild, sensor)[500, 1] = size
    without[500] = False
    track, expected = navigate(wild), navigate(WALK.only(without))
    assert track.counters["dropped"] == 1
    assert np.array_equal(track.position_m, expected.position_m)


def test_wrong_units_have_the_foot_aligned_once_a_second_not_once_a_sample() -> None:
    """Each attempt looks at all samples that wait."""
    stream = Stream(WALK.time_ns, 1000.0 / 9.81 * WALK.accel, WALK.gyro)
    lasted_s = (WALK.time_ns[-1] - WALK.time_ns[0]) * 1e-9
    assert 0 < navigate(stream).counters["realignments"] <= lasted_s + 1.0


@pytest.mark.parametrize(
    ("scale", "told"), [(0.0, True), (1.0 / 9.81, True), (1000.0 / 9.81, True), (1.0, False)]
)
def test_an_accelerometer_that_is_dead_or_in_other_units_is_noticed(scale: float, told: bool) -> None:
    """Nothing, g, and thousandths of it."""
    stream = walk(12)
    navigator = FootNavigator()
    navigator.process(stream.time_ns, scale * stream.accel, stream.gyro)
    assert navigator.contradicts_itself is told


def test_gaps_alone_are_no_contradiction() -> None:
    stream = walk(12)
    stream.time_ns += np.arange(len(stream.time_ns)) // 250 * 2 * SECOND_NS
    navigator = FootNavigator()
    navigator.process(stream.time_ns, stream.accel, stream.gyro)
    assert navigator.counters()["realignments"] > 10
    assert not navigator.contradicts_itself


def test_a_step_across_a_clock_that_was_set_back_is_doubted() -> None:
    """Nobody knows how long that took: place and heading are as lost as after a second."""
    stream = Stream.joined(still(3.0), still(3.0))
    stream.time_ns[len(stream.time_ns) // 2 :] -= 60 * SECOND_NS
    (step,) = (step for step in navigate(stream).steps if step.realigned)
    assert math.sqrt(step.covariance[0, 0]) > 0.5
    assert math.sqrt(step.covariance[3, 3]) > 0.2


def test_what_comes_behind_a_gap_says_nothing_of_the_stance_before_it() -> None:
    """At rest until the gap, and whirled about behind it."""
    rest, whirled = still(2.0), still(1.0)
    whirled.accel[:, 0] += 40.0
    whirled.gyro[:, 1] += 8.0
    joined = Stream.joined(rest, whirled)
    count = len(rest.time_ns)
    joined.time_ns[count:] += 60_000_000
    track = navigate(joined)
    assert track.counters["gaps"] == 1
    assert track.stance[:count].all()


@pytest.mark.parametrize("rate_hz", [30.0, 40.0, 60.0, 200.0])
def test_a_slow_sensor_s_stance_lasts_from_sample_to_sample(rate_hz: float) -> None:
    step = navigate(still(4.0, rate_hz=rate_hz)).steps[-1]
    assert step.stance_s > 3.0


def test_a_stop_ends_at_every_gap() -> None:
    """Also at one that is followed by another before the filter has come so far."""
    rest = still(3.0)
    rest.time_ns[300:] += 60_000_000
    rest.time_ns[301:] += 60_000_000
    navigator = FootNavigator()
    navigator.process(rest.time_ns[:302], rest.accel[:302], rest.gyro[:302])
    assert navigator._state["done"][0] == 301
    assert navigator._state["stop_samples"][0] == 0
