"""Speed and course of a receiver: the heading they tell, and hold (METHODS D9)."""

import math
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope
from bootprint.geodesy import LocalFrame, wrap_angle
from bootprint.messages import GnssFix, Position
from fusion.config import FusionConfig, VelocityConfig
from fusion.engine import FusionCore
from fusion.velocity import CourseFit, Way, velocity_m_s
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    ORIGIN,
    RIGHT,
    SPEED_M_S,
    T0,
    WHO,
    SimulatedWalk,
    envelope,
    in_time_order,
    straight,
)

FRAME = LocalFrame(ORIGIN)
CONFIG = VelocityConfig()


def fix(second: int, place: np.ndarray, yaw: float, speed_m_s: float | None = SPEED_M_S) -> GnssFix:
    latitude, longitude, height = FRAME.to_geodetic(float(place[0]), float(place[1]), 0.0)
    return GnssFix(
        time_ns=T0 + second * NS,
        sequence=second,
        fix_kind="3d",
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        horizontal_accuracy_m=3.0,
        speed_m_s=speed_m_s,
        course_rad=(0.5 * math.pi - yaw) % math.tau,
    )


def test_a_course_is_clockwise_from_north_and_none_when_standing() -> None:
    velocity = velocity_m_s(fix(0, np.zeros(2), 0.0, 2.0))
    assert velocity is not None
    np.testing.assert_allclose(velocity, [2.0, 0.0], atol=1e-12)
    assert velocity_m_s(fix(0, np.zeros(2), 0.0, 0.1)) is None
    assert velocity_m_s(fix(0, np.zeros(2), 0.0, None)) is None


def test_the_turn_is_found_and_its_sigma_is_that_of_many_draws() -> None:
    rng = np.random.default_rng(2)
    sigma_m, turn = 0.3, 2.5
    exact = msgspec.structs.replace(CONFIG, repeats=1.0, lasting_rad=0.0)
    errors, stated = [], []
    for _ in range(300):
        fit = CourseFit(exact)
        for number in range(25):
            walked = 1.3 * np.array([math.cos(0.2 * number), math.sin(0.2 * number)])
            told = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]) @ walked
            fit.add(Way(told + rng.normal(0.0, sigma_m, 2), walked, sigma_m))
        assert fit.turn is not None
        errors.append(wrap_angle(fit.turn[0] - turn))
        stated.append(fit.turn[1])
    assert np.std(errors) == pytest.approx(np.mean(stated), rel=0.15)


def test_ways_that_do_not_look_like_one_walk_tell_no_turn() -> None:
    rng, fit = np.random.default_rng(5), CourseFit(CONFIG)
    for _ in range(20):
        fit.add(Way(rng.normal(size=2), rng.normal(size=2), 0.1))
    assert fit.turn is None


def play(
    walk: SimulatedWalk, config: FusionConfig, fixes: Iterator[GnssFix]
) -> tuple[list[Position], FusionCore]:
    core = FusionCore(config, WHO, ORIGIN)
    satellites: list[Envelope] = [envelope("gnss", "gnss", one) for one in fixes]
    everything = in_time_order(walk.messages(LEFT), walk.messages(RIGHT), satellites)
    out = [one for each in everything for one in core.handle(each)]
    return [one.message for one in [*out, *core.close()] if isinstance(one.message, Position)], core


def fixes_on(walk: SimulatedWalk, yaw: float, until_s: int, *, courses: bool) -> Iterator[GnssFix]:
    """Places that all err alike by 4 m; courses that err by three degrees, differently each time."""
    rng = np.random.default_rng(7)
    for second in range(1, until_s):
        place = walk.body(LEFT, RIGHT, time_s=float(second)) + np.array([4.0, -2.0])
        wrong = yaw + rng.normal(0.0, math.radians(3.0))
        yield fix(second, place, wrong, SPEED_M_S if courses else None)


def test_at_the_door_the_heading_is_known_after_a_few_metres() -> None:
    """Twelve seconds of satellites, then a house: by places alone the soldier is not placed, by courses well."""
    yaw = 0.9
    walk = SimulatedWalk(straight(yaw), 60.0)
    config = FusionConfig()
    with_courses, core = play(walk, config, fixes_on(walk, yaw, 13, courses=True))
    without, blind = play(walk, config, fixes_on(walk, yaw, 13, courses=False))
    assert (core.counters["placed"], blind.counters["placed"]) == (1, 0)
    last = with_courses[-1]
    east, north = walk.body(LEFT, RIGHT, time_s=60.0) + np.array([4.0, -2.0])
    assert math.hypot(last.east_m - east, last.north_m - north) < 6.0  # of 84 m: four degrees
    assert without[-1].mode == "unplaced" or without[-1].covariance_m2[0] > 4.0 * last.covariance_m2[0]


def test_a_wrong_heading_of_a_placed_soldier_is_mended_by_courses() -> None:
    start = msgspec.structs.replace(EAST, azimuth_deg=100.0, azimuth_sigma_deg=8.0)
    walk = SimulatedWalk(straight(0.0), 40.0)
    _, core = play(walk, FusionConfig(start=start), fixes_on(walk, 0.0, 40, courses=True))
    boots = core.estimator.boots
    mounted = boots.filter.state[boots.feet["left_foot"].block.yaw] - LEFT.mounting_rad
    assert abs(wrap_angle(float(mounted))) < math.radians(3.0)
    assert core.counters["courses_accepted"] > 20
