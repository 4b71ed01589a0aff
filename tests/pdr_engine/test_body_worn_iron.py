"""Iron on the person is learned from turns, by its own equation; not from places, nor where it is none."""

import math

import numpy as np
import pytest

from bootprint.geomagnetism import EarthField
from pdr_engine.body.azimuth.worn_iron import MOST_HARD_UT, WornIron
from pdr_engine.body.settings import HeadingSettings

EARTH = EarthField(0.0, 21.0, -43.0)
STEP_S = 0.5
# Ahead, left, up in the axes of a unit that lies on its side: ahead is its z, left its x, up its y.
FRAME = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
HARD = np.array([5.0, -3.0, 6.0])


def walked(
    hard_ut: np.ndarray,
    yaws: np.ndarray,
    soft: np.ndarray | None = None,
    place_ut: float = 0.0,
    drift_rad_s: float = 0.0,
    seed: int = 3,
) -> WornIron:
    """Steps while the unit turns through ``yaws``; ``place_ut``: of iron in places, alike over ten steps."""
    rng = np.random.default_rng(seed)
    iron = WornIron(HeadingSettings())
    iron.know_earth_field(EARTH)
    place = np.zeros(3)
    for number, yaw in enumerate(yaws.tolist()):
        if number % 10 == 0:
            place = rng.normal(0.0, place_ut, 3)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        device = FRAME.T @ (turn @ (np.array([0.0, 21.0, -43.0]) + place))
        field = device + (0.0 if soft is None else soft @ device) + hard_ut + rng.normal(0.0, 0.3, 3)
        iron.step(FRAME @ field, FRAME, yaw + drift_rad_s * number * STEP_S, STEP_S, learns=True)
    return iron


ABOUT = np.repeat(np.arange(24) * 0.5 * math.pi, 20)  # corners, 20 steps apart


def test_hard_iron_is_learned_from_turns_whatever_the_gyro_s_zero_and_drift() -> None:
    iron = walked(HARD, ABOUT + 1.0, drift_rad_s=0.01)
    np.testing.assert_allclose(iron.hard_ut, HARD, atol=1.0)
    assert iron.sure(FRAME)


def test_what_is_learned_is_taken_off() -> None:
    iron = walked(HARD, ABOUT)
    level = FRAME @ (FRAME.T @ np.array([21.0, 0.0, -43.0]) + HARD)
    corrected = iron.corrected(level[None], FRAME)[0]
    assert abs(math.atan2(level[1], level[0])) > math.radians(8.0)
    assert abs(math.atan2(corrected[1], corrected[0])) < math.radians(2.0)


def test_soft_iron_is_told_from_hard() -> None:
    """A unit whose ahead axis (its z) reads 4 % too much: its field is longer that way."""
    soft = np.diag([0.0, 0.0, 0.04])
    iron = walked(np.zeros(3), np.tile(ABOUT, 4), soft)
    assert iron.soft[2, 2] - iron.soft[0, 0] == pytest.approx(0.04, abs=0.02)
    assert np.linalg.norm(iron.hard_ut[[0, 2]]) < 1.0


def test_a_straight_way_tells_nothing_and_no_iron_is_not_corrected() -> None:
    assert not walked(HARD, np.zeros(400)).sure(FRAME)
    assert not walked(np.zeros(3), ABOUT).sure(FRAME)


def test_iron_of_places_is_not_taken_for_worn_iron() -> None:
    sure = [walked(np.zeros(3), ABOUT[:240], place_ut=12.0, seed=seed).sure(FRAME) for seed in range(8)]
    assert sum(sure) == 0


def test_it_stays_within_bounds() -> None:
    iron = walked(np.array([60.0, 0.0, -60.0]), np.tile(ABOUT, 4))
    assert float(np.abs(iron.hard_ut).max()) <= MOST_HARD_UT


def test_a_break_of_the_stream_costs_north_not_the_iron() -> None:
    iron = walked(HARD, ABOUT)
    before = iron.hard_ut
    iron.lose(1.0)
    for _ in range(200):
        # North is somewhere else in the gyro's frame now: 1 rad further.
        turn = np.array(
            [[math.cos(1.0), math.sin(1.0), 0.0], [-math.sin(1.0), math.cos(1.0), 0.0], [0.0, 0.0, 1.0]]
        )
        field = FRAME.T @ (turn @ np.array([0.0, 21.0, -43.0])) + HARD
        iron.step(FRAME @ field, FRAME, 0.0, STEP_S, learns=True)
    np.testing.assert_allclose(iron.hard_ut, before, atol=1.0)


def test_north_is_told_without_the_iron() -> None:
    """North is where the gyro has its y axis, and who faces 0.4 rad left of its x axis goes to π/2 − 0.4."""
    azimuth, sigma = walked(HARD, ABOUT).azimuth(0.4)
    assert azimuth == pytest.approx(0.5 * math.pi - 0.4, abs=0.06)
    assert 0.0 < sigma < 0.1
