"""The air and barometers: the standard atmosphere by its published table, weather, doors, lifts, wind, the unit."""

from dataclasses import replace

import numpy as np
import pytest

from proving_ground.sensors import (
    Air,
    Area,
    BarometerQuality,
    DoorSlam,
    LiftShaft,
    Mounting,
    measure_pressure,
)
from proving_ground.sensors.air import standard_pressure_pa
from support.moving import Straight, Track

EXACT = BarometerQuality("none", 10.0, 0.0, 0.0, 0.0, 0.0, 1e-6)
CALM = Air(drift_pa_per_sqrt_h=0.0)
HERE = np.zeros((1, 3))


def pressure_at(air: Air, time_s: np.ndarray, place_m: np.ndarray | None = None) -> np.ndarray:
    place = np.zeros((len(time_s), 3)) if place_m is None else place_m
    return air.pressure_pa(time_s, place, np.zeros(len(time_s)))


def test_the_standard_atmosphere_is_that_of_the_table() -> None:
    """ISO 2533: 1013.25, 954.61, 898.74 and 540.20 hPa at 0, 500, 1000 and 5000 m."""
    np.testing.assert_allclose(
        standard_pressure_pa(np.array([0.0, 500.0, 1000.0, 5000.0])),
        [101_325, 95_461, 89_874, 54_020],
        atol=2.0,
    )


def test_ten_metres_of_stairs_take_a_hundred_and_twenty_pascal() -> None:
    climb = Track(np.array([0.0, 20.0]), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 10.0]]))
    series = measure_pressure(climb, 20.0, Mounting(), EXACT, CALM, np.random.default_rng(1))
    # ρg = 1.225·9.80665 = 12.01 Pa/m at sea level.
    assert series.pressure_pa[0] - series.pressure_pa[-1] == pytest.approx(12.01 * 9.95, rel=0.002)
    np.testing.assert_allclose(series.time_s, np.arange(200) / 10.0)


def test_a_slow_barometer_lags_by_its_response() -> None:
    """A steady climb of 1 m/s is shown late by the time constant: 12 Pa/s · 0.5 s behind."""
    climb = Straight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    slow, quick = (
        measure_pressure(
            climb, 10.0, Mounting(), replace(EXACT, response_s=response_s), CALM, np.random.default_rng(1)
        )
        for response_s in (0.5, 0.0)
    )
    late_pa = slow.pressure_pa - quick.pressure_pa
    assert late_pa[0] == pytest.approx(0.0, abs=0.1)
    # The filter's own sampling at 40 Hz gives half a period back.
    assert late_pa[-1] == pytest.approx(12.0 * (0.5 - 0.0125), rel=0.01)


def test_the_origin_s_height_counts() -> None:
    air = replace(CALM, origin_height_m=990.0)
    np.testing.assert_allclose(pressure_at(air, np.zeros(1), np.array([[0.0, 0.0, 10.0]])), 89_874, atol=2.0)


def test_weather_is_a_random_walk_shared_by_all_who_breathe_it() -> None:
    changes = []
    for seed in range(300):
        one_h = pressure_at(Air(drift_pa_per_sqrt_h=100.0, seed=seed), np.array([0.0, 900.0, 3600.0]))
        changes.append(one_h[1:] - one_h[0])
    np.testing.assert_allclose(np.std(changes, axis=0), [50.0, 100.0], rtol=0.12)
    air = Air(drift_pa_per_sqrt_h=100.0, seed=7)
    asked_early, asked_late = (pressure_at(air, np.arange(0.0, end, 1.0)) for end in (60.0, 600.0))
    np.testing.assert_array_equal(asked_early, asked_late[:60])


def test_a_door_slams_for_a_moment_and_nearby() -> None:
    door = DoorSlam(time_s=5.0, place_m=np.zeros(3), peak_pa=40.0)
    time_s = np.arange(0.0, 10.0, 0.01)
    near, far = (
        pressure_at(replace(CALM, doors=(door,)), time_s, np.tile([east, 0.0, 0.0], (1000, 1))) - 101_325.0
        for east in (0.0, 24.0)
    )
    assert (near[time_s <= 5.0] == 0.0).all()
    assert 20.0 < np.abs(near).max() < 40.0
    assert np.abs(near[time_s > 8.0]).max() < 0.1
    assert np.abs(far).max() == pytest.approx(np.abs(near).max() * np.exp(-2.0))


def test_a_lift_pushes_the_air_only_while_it_goes() -> None:
    """Up at 1.5 m/s from 10 s to 20 s: 4·1.5² = 9 Pa on top of what the height takes."""
    ride = Track(
        np.array([0.0, 10.0, 20.0, 30.0]), np.array([[0.0, 0, 0], [0.0, 0, 0], [0.0, 0, 15], [0.0, 0, 15]])
    )
    lift = LiftShaft(Area.box(-1.0, -1.0, 1.0, 1.0))
    with_lift, without = (
        measure_pressure(ride, 30.0, Mounting(), EXACT, air, np.random.default_rng(1)).pressure_pa
        for air in (replace(CALM, lifts=(lift,)), CALM)
    )
    push = with_lift - without
    np.testing.assert_allclose(push[110:190], 9.0, atol=1e-3)
    np.testing.assert_allclose(push[[50, 250]], 0.0, atol=1e-3)


def test_wind_is_felt_outdoors_and_hardly_within() -> None:
    """½ρv² of 10 m/s is 61 Pa; gusts of a third of the wind make 41 Pa of it."""
    air = replace(CALM, wind_m_s=10.0, indoors=(Area.box(0.0, 0.0, 10.0, 10.0),))
    time_s = np.arange(0.0, 2000.0, 1.0)
    outside, inside = (pressure_at(air, time_s, np.tile([east, 5.0, 0.0], (2000, 1))) for east in (-1.0, 1.0))
    assert outside.std() == pytest.approx(41.0, rel=0.25)
    assert inside.std() < 0.25 * outside.std()
    # Gusts last some seconds: a second apart they are alike, half a minute apart they are not.
    assert np.corrcoef(outside[1:], outside[:-1])[0, 1] > 0.85
    assert abs(np.corrcoef(outside[30:], outside[:-30])[0, 1]) < 0.3


def test_the_unit_s_errors_have_their_sizes() -> None:
    still = Straight()
    biases = []
    for seed in range(100):
        unit = replace(EXACT, bias_pa=50.0)
        series = measure_pressure(still, 0.3, Mounting(), unit, CALM, np.random.default_rng(seed))
        biases.append(series.pressure_pa[0] - 101_325.0)
    assert np.std(biases) == pytest.approx(50.0, rel=0.25)
    noisy = replace(EXACT, noise_pa=1.3, resolution_pa=0.16)
    series = measure_pressure(still, 300.0, Mounting(), noisy, CALM, np.random.default_rng(1))
    assert series.pressure_pa.std() == pytest.approx(1.3, rel=0.05)
    np.testing.assert_allclose(series.pressure_pa / 0.16, np.round(series.pressure_pa / 0.16), atol=1e-6)
    wandering = replace(EXACT, instability_pa=2.0)
    series = measure_pressure(still, 600.0, Mounting(), wandering, CALM, np.random.default_rng(1))
    assert 0.5 < np.ptp(series.pressure_pa) < 30.0
