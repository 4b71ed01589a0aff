"""Fixes against the walked track: understated accuracies are found out, honest ones are not suspected."""

import math

import numpy as np
import pytest

from pdr_engine.body.track.honesty import Honesty

SECOND_NS = 1_000_000_000


def judged(
    error: float, stated_m: float = 5.0, seed: int = 0, turned_rad: float = 0.6, scale: float = 1.0
) -> float:
    """The accuracy believed after 150 s of fixes that err by ``error`` times what they state, alike for 30 s.

    The steps are off in direction by ``turned_rad``; the way has corners.
    """
    rng = np.random.default_rng(seed)
    honesty = Honesty()
    place, wander, believed = np.zeros(2), rng.normal(0.0, 1.0, 2), stated_m
    keep = math.exp(-1.0 / 30.0)
    for second in range(150):
        azimuth = 0.5 * math.pi * (second // 30)
        place = place + 1.4 * np.array([math.sin(azimuth), math.cos(azimuth)])
        honesty.walk(1.4 * scale, azimuth + turned_rad)
        wander = keep * wander + rng.normal(0.0, math.sqrt(1.0 - keep**2), 2)
        east, north = (place + error * stated_m / math.sqrt(2.0) * wander).tolist()
        believed = honesty.accuracy(second * SECOND_NS, east, north, stated_m)
    return believed


@pytest.mark.parametrize("seed", range(8))
def test_honest_fixes_are_not_suspected(seed: int) -> None:
    assert judged(1.0, seed=seed) == 5.0


@pytest.mark.parametrize("scale", [0.94, 0.8, 1.25])
def test_steps_off_in_direction_and_length_are_no_reason_to_suspect(scale: float) -> None:
    assert judged(0.2, stated_m=2.0, turned_rad=2.5, scale=scale) == 2.0


def test_fixes_that_err_four_times_as_much_are_believed_less() -> None:
    believed = [judged(4.0, seed=seed) for seed in range(8)]
    assert min(believed) > 7.5
    assert float(np.median(believed)) > 11.0


def test_nothing_is_said_of_few_fixes() -> None:
    honesty = Honesty()
    far = [honesty.accuracy(k * 3 * SECOND_NS, 1000.0 * (k % 2), 0.0, 5.0) for k in range(6)]
    assert far[:5] == [5.0] * 5
    assert far[5] > 100.0
