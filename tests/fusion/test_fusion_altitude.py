"""Lifts by air pressure and floors where climbing ends (METHODS A8)."""

import math

import numpy as np
import pytest

from bootprint.clock import NS_PER_S
from bootprint.messages import FootStep, Pressure, upper_triangle
from fusion.altitude import Landing, LiftWatch, pressure_height_m
from fusion.config import AltitudeConfig

CONFIG = AltitudeConfig()
PA_PER_M = 11.9  # near the ground, by the barometric formula


def standing(place: str, time_s: float) -> FootStep:
    return step(time_s, (0.0, 0.0, 0.0), "standing")


def step(time_s: float, way: tuple[float, float, float], motion: str = "walking") -> FootStep:
    return FootStep(
        time_ns=round(time_s * NS_PER_S),
        start_time_ns=round((time_s - 0.5) * NS_PER_S),
        displacement_m=way,
        heading_change_rad=0.0,
        covariance=upper_triangle(np.zeros((4, 4))),
        motion=motion,  # type: ignore[arg-type]
    )


def ridden(height_at: object, *, walks: bool, outdoors: bool = False, lasts_s: float = 40.0) -> float:
    """How far up a soldier is said to have been carried; feet report every half second."""
    watch, total = LiftWatch(CONFIG), 0.0
    for tick in range(round(lasts_s * 10)):
        time_s = tick / 10
        if tick % 5 == 0:
            watch.step("left_foot", step(time_s, (0.7, 0.0, 0.0)) if walks else standing("left_foot", time_s))
        pressure_pa = 100_000.0 - PA_PER_M * height_at(time_s)  # type: ignore[operator]
        sample = Pressure(time_ns=round(time_s * NS_PER_S), pressure_pa=pressure_pa)
        climb = watch.pressure(sample, outdoors=outdoors)
        total += climb.up_m if climb else 0.0
    assert not watch.rides
    return total


def lift(time_s: float) -> float:
    """Three storeys down at 1.5 m/s from 10 s on."""
    return -min(max(time_s - 10.0, 0.0) * 1.5, 10.5)


def test_height_by_pressure_is_that_of_the_standard_atmosphere() -> None:
    assert pressure_height_m(101_325.0) == 0.0
    assert pressure_height_m(89_874.6) == pytest.approx(1000.0, abs=1.0)  # ISO 2533's table


def test_a_lift_is_ridden_as_far_as_the_pressure_says() -> None:
    assert ridden(lift, walks=False) == pytest.approx(-10.5, abs=0.4)


def test_nobody_rides_who_walks_or_stands_under_the_sky() -> None:
    assert ridden(lift, walks=True) == 0.0
    assert ridden(lift, walks=False, outdoors=True) == 0.0


def test_weather_and_a_slammed_door_are_no_lift() -> None:
    assert ridden(lambda time_s: 0.02 * time_s, walks=False) == 0.0
    slam = lambda time_s: 2.5 * math.exp(-time_s / 0.4) * math.sin(12.6 * time_s)  # noqa: E731
    assert ridden(lambda t: slam(t - 15.0) if t > 15.0 else 0.0, walks=False) == pytest.approx(0.0, abs=0.3)


def test_stairs_end_on_the_level_and_a_landing_is_no_floor() -> None:
    landing = Landing(CONFIG, 3.9)
    assert not any(landing.step(step(second, (0.3, 0.0, 0.17), "stairs")) for second in range(1, 20))
    ended = [landing.step(step(20 + second, (0.7, 0.0, 0.0))) for second in range(5)]
    assert ended == [False, False, True, False, False]  # after two metres, once
    assert landing.floor_m(7.5) == pytest.approx(7.8)
    assert landing.floor_m(5.9) is None
    assert landing.is_between(5.9)
    assert not Landing(CONFIG, None).is_between(5.9)
