"""The altimeter: what pressure means on the level, on stairs, on a slope and in a lift; which floor that is."""

import numpy as np
import pytest

from pdr_engine.body.altitude.altimeter import LAG_S, Altimeter, pressure_height_m
from pdr_engine.body.altitude.climb import Belief, Way
from pdr_engine.body.altitude.floors import FloorCounter
from pdr_engine.body.altitude.height_filter import HeightFilter
from pdr_engine.body.altitude.vertical import VerticalChannel

PA_PER_M = 12.0  # near the ground; the standard atmosphere has 12.01 at sea level
STEP_S = 0.5
S = 1_000_000_000


class Probe(Altimeter):
    """An altimeter that knows when and how high the test has brought it."""

    test_time_s = 0.0
    test_height_m = 0.0


def walk(
    altimeter: Probe, way: list[tuple[float, float, bool]], noise_pa: float = 0.5, drift_pa_s: float = 0.0
) -> None:
    """Go on: stretches of (seconds, climb m/s, whether with steps), 10 Hz, from where the altimeter is."""
    rng = np.random.default_rng(3)
    for seconds, climb, steps in way:
        start_s = altimeter.test_time_s
        for time_s in np.arange(start_s, start_s + seconds, 0.1):
            altimeter.test_height_m += 0.1 * climb
            if steps and np.floor(time_s / STEP_S) != np.floor((time_s - 0.1) / STEP_S):
                altimeter.step(round(time_s * S))
            pressure = 101_325.0 - PA_PER_M * altimeter.test_height_m + drift_pa_s * time_s
            altimeter.pressure(round(time_s * S), pressure + rng.normal(0.0, noise_pa))
        altimeter.test_time_s = start_s + seconds


def test_the_standard_atmosphere() -> None:
    assert pressure_height_m(101_325.0) == pytest.approx(0.0)
    assert pressure_height_m(89_874.6) == pytest.approx(1000.0, abs=0.5)  # ISO 2533, table


def test_weather_is_no_height() -> None:
    """36 Pa in ten minutes, 3 m of air, on a level walk."""
    altimeter = Probe()
    walk(altimeter, [(600.0, 0.0, True)], drift_pa_s=0.06)
    assert abs(altimeter.height_m) < 0.3
    assert altimeter.way == "level"


@pytest.mark.parametrize(("sign", "riser"), [(1.0, 0.16), (-1.0, 0.16), (1.0, 0.185)])
def test_stairs_are_climbed_by_risers(sign: float, riser: float) -> None:
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True), (23.0, sign * riser / STEP_S, True)])
    assert altimeter.way == "stairs"
    assert altimeter.climb(None).stairs > 0.9
    assert altimeter.climb(None).up == (sign > 0.0)
    walk(altimeter, [(10.0, 0.0, True)])
    assert altimeter.way == "level"
    assert altimeter.height_m == pytest.approx(sign * 46 * riser, abs=0.35)
    assert altimeter.riser_m == pytest.approx(riser, abs=0.008)


def test_a_lift_has_height_without_steps() -> None:
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True), (5.0, 0.0, False), (9.0, 1.0, False)])
    assert altimeter.way == "lift"
    assert altimeter.climb(None).stairs < 0.05
    assert altimeter.height_m == pytest.approx(altimeter.test_height_m, abs=0.8)  # now: no lag
    walk(altimeter, [(5.0, 0.0, False), (10.0, 0.0, True)])
    assert altimeter.height_m == pytest.approx(9.0, abs=0.3)


def test_a_slope_is_no_stairs() -> None:
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True), (40.0, 0.12, True)])  # 6 cm a step
    assert altimeter.way == "slope"
    assert altimeter.climb(None).stairs < 0.05
    walk(altimeter, [(10.0, 0.0, True)])
    assert altimeter.height_m == pytest.approx(4.8, abs=0.6)


def test_a_known_height_sets_the_level_and_later_ones_correct_it() -> None:
    altimeter = Probe()
    walk(altimeter, [(10.0, 0.0, True)])
    altimeter.reference(10 * S, 523.0, 2.0)
    assert altimeter.height_m == pytest.approx(523.0, abs=0.05)
    assert altimeter.sigma_m == pytest.approx(2.0, rel=0.05)
    # A second, independent one of the same sigma lies in the middle, but for what drifted since.
    altimeter.reference(10 * S, 525.0, 2.0)
    assert altimeter.height_m == pytest.approx(524.0, abs=0.1)


def test_nonsense_is_left_out_and_gaps_make_unsure() -> None:
    altimeter = Probe()
    walk(altimeter, [(10.0, 0.0, True)])
    for value in (float("nan"), -5.0, 0.0, float("inf")):
        altimeter.pressure(11 * S, value)
    altimeter.pressure(2 * S, 90_000.0)  # older than the last
    assert abs(altimeter.height_m) < 0.1
    before = altimeter.sigma_m
    altimeter.test_time_s, altimeter.test_height_m = 100.0, 6.0
    walk(altimeter, [(20.0, 0.0, True)])
    assert altimeter.sigma_m > before
    assert altimeter.height_m == pytest.approx(6.0, abs=1.0)


def counter(start_floor: int = 0, storey_m: float = 3.6, storey_sigma_m: float = 0.9) -> FloorCounter:
    return FloorCounter(start_floor, storey_m, storey_sigma_m)


def stay(floors: FloorCounter, at_s: float, height_m: float, seconds: float = 20.0) -> float:
    """Stay at a height, and be on stairs for a moment; the time after that."""
    for time_s in np.arange(at_s, at_s + seconds, 0.5):
        floors.update(round(time_s * S), height_m, 0.3, True)
    floors.update(round((at_s + seconds) * S), height_m, 0.3, False)
    return at_s + seconds + 1.0


def test_floors_of_unequal_storeys_are_known_again() -> None:
    floors, found, at_s = counter(), [], 0.0
    for height in (0.0, 5.2, 8.4, 11.7, 8.3, 0.3, 5.0, -3.1):
        at_s = stay(floors, at_s, height)
        found.append(floors.floor)
    assert found == [0, 1, 2, 3, 2, 0, 1, -1]
    assert floors.probability > 0.8


def test_a_ramp_or_a_landing_is_no_floor() -> None:
    floors = counter(start_floor=2)
    at_s = stay(floors, 0.0, 0.0)
    at_s = stay(floors, at_s, 3.4)
    at_s = stay(floors, at_s, 5.0)
    assert floors.floor == 3
    stay(floors, at_s, 6.8, seconds=3.0)  # too short to be a stay
    assert floors.floor == 3


def test_several_storeys_at_once_are_counted_by_the_known_height() -> None:
    floors = counter(storey_m=2.6, storey_sigma_m=0.2)
    at_s = stay(floors, 0.0, 0.0)
    stay(floors, at_s, 7.8)
    assert floors.floor == 3
    shares = floors.probabilities(7.8)
    assert shares[3] == max(shares.values())
    assert sum(shares.values()) < 1.0


def test_a_lag_is_all_there_is_between_settled_and_now() -> None:
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True), (5.0, 0.0, False), (8.0, 1.0, False)])
    behind = altimeter.test_height_m - altimeter.settled_height_m
    assert behind == pytest.approx(LAG_S * 1.0, abs=0.8)


def test_a_floor_is_known_on_arrival_and_in_between_the_last_stays() -> None:
    floors = counter()
    at_s = stay(floors, 0.0, 0.0)
    at_s = stay(floors, at_s, 3.6)
    stay(floors, at_s, 7.2)
    assert floors.at(3.5)[0] == 1
    assert floors.at(0.2)[0] == 0
    assert min(floors.at(height)[1] for height in (0.0, 3.6, 7.2)) > 0.9
    floor, probability = floors.at(5.4)  # amid the stairs
    assert floor in (1, 2)
    assert probability < 0.5


def climb_seen(
    channel: VerticalChannel, bias_m_s2: float, at_s: np.ndarray, height_m: np.ndarray
) -> np.ndarray:
    """Heights that the channel says: exact pressure at 10 Hz, exact acceleration and a bias at 50 Hz."""
    acceleration = np.gradient(np.gradient(height_m, at_s), at_s)
    told = []
    for k, time_s in enumerate(at_s):
        channel.accelerate(round(time_s * S), 9.80665 + bias_m_s2 + float(acceleration[k]))
        if k % 5 == 0:
            channel.hold(round(time_s * S), float(height_m[k]))
        told.append(channel.height_m)
    return np.array(told, dtype=np.float64)


def test_the_channel_learns_a_bias_and_follows_a_climb_without_lag() -> None:
    at_s = np.arange(0.0, 60.0, 0.02)
    height = np.where(at_s > 40.0, 0.33 * (at_s - 40.0), 0.0)
    window = np.hanning(51) / np.hanning(51).sum()
    at_s, height = at_s[25:-25], np.convolve(height, window, "valid")
    channel = VerticalChannel()
    told = climb_seen(channel, 0.1, at_s, height)
    assert float(np.abs(told - height)[at_s > 35.0].max()) < 0.03
    assert channel.bias_m_s2 == pytest.approx(0.1, abs=0.02)
    assert channel.velocity_m_s == pytest.approx(0.33, abs=0.05)


def test_stairs_are_told_by_the_channel_before_the_tick_is_over() -> None:
    """The belief a tick on from the level, by a height that is a riser and a half above it."""
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True)], noise_pa=0.1)
    level = altimeter.settled_height_m
    assert abs(level) < 0.1
    assert altimeter.climb(None).stairs < 0.05
    told = [altimeter.climb(pressure_height_m(101_325.0) + rise).stairs for rise in (0.0, 0.17)]
    assert told[1] > 10.0 * told[0]


def test_later_pressure_tells_the_first_steps_of_stairs() -> None:
    """A second and a half up from the level: what was hardly stairs at its time is surely stairs by now."""
    altimeter = Probe()
    walk(altimeter, [(20.0, 0.0, True), (0.5, 0.34, True)])
    at_once = altimeter.climb(None).stairs
    walk(altimeter, [(1.5, 0.34, True)])
    later = altimeter.climb_at(round(20.4 * S))
    assert later is not None
    assert later.up
    assert later.stairs > 0.7 > at_once
    assert altimeter.climb_at(round(10.0 * S)) is None  # settled long ago
    assert altimeter.climb_at(round(30.0 * S)) is None  # not yet
    assert Altimeter().climb_at(0) is None


def climb_stairs(
    kalman: HeightFilter, risers: float, ticks: int, start_m: float, riser_m: float, drift_m: float
) -> float:
    """Ten seconds on the level, then stairs, then a while on the level; the height by pressure at the end."""
    level: tuple[Way, float] = ("level", 0.0)
    pressure_m = start_m
    step: tuple[Way, float] = ("stairs", 1.0 / ticks)
    for way, share in [*[level] * 20, *[step] * ticks, *[level] * 20]:
        pressure_m += share * (risers * riser_m + drift_m)
        kalman.predict(way, share * risers, 0.0)
        kalman.pressure(pressure_m, 0.1)
        kalman.follow_climb(way)
    return pressure_m


def test_a_climb_that_is_no_storey_is_measured_as_if_there_were_none() -> None:
    """9.6 m of risers of 16 cm in still air, where storeys of 3.6 m are told."""
    kalman = HeightFilter(0.0, storey_m=3.6, storey_sigma_m=0.1)
    climb_stairs(kalman, 60.0, 60, 0.0, 0.16, 0.0)
    assert kalman.height_m == pytest.approx(9.6, abs=0.15)
    assert kalman.storey_m == 3.6


def test_a_storey_that_is_told_measures_stairs() -> None:
    """7.0 m by risers and pressure, 7.8 told to 5 cm: the weather has taken 0.8 m."""
    told = HeightFilter(0.0, storey_m=7.8, storey_sigma_m=0.05)
    climb_stairs(told, 48.0, 48, 0.0, 0.1625, -0.8)
    assert told.height_m == pytest.approx(7.8, abs=0.15)


def test_few_of_an_edge_s_steps_are_risers() -> None:
    """A flight's steps are risers, those of its ends and landings a quarter, those on the level none."""
    level, flight, edge = 0, 3, 4  # of the models of `climb`
    shares = np.zeros(10)
    shares[[level, flight, edge]] = 0.2, 0.6, 0.2
    mean, variance = Belief(shares, shares, shares).risers_a_step
    assert mean == pytest.approx(0.6 + 0.2 / 4.0)
    assert variance == pytest.approx(0.6 + 0.2 / 6.0 - mean**2)
