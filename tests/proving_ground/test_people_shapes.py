"""Stride shapes: the splines against an oracle, and what strides look like when they are mirrored or run back."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from proving_ground.people.attitude import attitude_of
from proving_ground.people.shape import (
    ACROSS,
    ALONG,
    COEFFICIENTS,
    HEIGHT,
    PIECES,
    PITCH,
    backwards,
    evaluated,
    whole,
)
from proving_ground.people.smooth import SmoothCurve, cruise, glide
from proving_ground.people.stride_shapes import SHAPES

PHASE = np.linspace(0.0, 1.0, 501)


def curve(name: str) -> np.ndarray:
    """The mean shape's channels over the phase, (501, 6)."""
    shape = SHAPES[name]
    coefficients = whole(shape.coefficients(np.array([shape.speed_m_s]), np.zeros((1, len(shape.modes)))))
    return evaluated(coefficients, np.zeros(len(PHASE), np.int64), PHASE)


def test_channels_are_the_splines_that_scipy_knows() -> None:
    coefficients = np.random.default_rng(1).normal(size=(2, 6, COEFFICIENTS))
    knots = np.arange(-3, PIECES + 4) / PIECES
    oracle = BSpline(knots, coefficients[1].T, 3)(PHASE)
    found = evaluated(coefficients, np.ones(len(PHASE), np.int64), PHASE)
    np.testing.assert_allclose(found, oracle, atol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_a_stride_begins_and_ends_at_rest(name: str) -> None:
    channels = curve(name)
    rate = np.diff(channels, axis=0)
    assert channels[0] == pytest.approx(np.zeros(6), abs=1e-12)
    assert channels[-1] == pytest.approx([1, 0, 0, 0, 0, 0], abs=1e-12)
    assert np.abs(rate[[0, -1]]).max() < 1e-4


def test_recorded_feet_behave_as_feet() -> None:
    walk, up = curve("walk"), curve("stairs_up")
    assert np.degrees(walk[:, PITCH].max()) == pytest.approx(60.0, abs=12.0)  # toe-off
    assert np.degrees(walk[:, PITCH].min()) == pytest.approx(-27.0, abs=10.0)  # heel strike
    assert np.argmax(walk[:, PITCH]) < np.argmin(walk[:, PITCH])
    assert 0.02 < walk[:, HEIGHT].max() < 0.15
    assert up[np.argmax(up[:, HEIGHT]), ALONG] < 0.8  # the foot rises before it goes on


def test_walking_backward_is_walking_run_back() -> None:
    shape = SHAPES["walk"]
    forward = whole(shape.coefficients(np.array([1.0]), np.zeros((1, len(shape.modes)))))
    index = np.zeros(len(PHASE), np.int64)
    ahead, back = evaluated(forward, index, PHASE), evaluated(backwards(forward), index, PHASE)
    np.testing.assert_allclose(back[:, ALONG], 1.0 - ahead[::-1, ALONG], atol=1e-12)
    np.testing.assert_allclose(back[:, PITCH], ahead[::-1, PITCH], atol=1e-12)
    np.testing.assert_allclose(back[:, ACROSS], -ahead[::-1, ACROSS], atol=1e-12)


def test_a_ride_is_the_curve_that_the_torso_takes_too() -> None:
    ramp = 0.2
    even = 0.5 * ramp / (1.0 - ramp)
    speed = 1.0 / (1.0 - ramp)
    knots = np.array([0.0, ramp, 1.0 - ramp, 1.0])
    torso = SmoothCurve(
        knots, np.array([[0], [even], [1 - even], [1.0]]), np.array([[0], [speed], [speed], [0]])
    )
    np.testing.assert_allclose(cruise(PHASE, np.full(len(PHASE), ramp)), torso(PHASE)[:, 0], atol=1e-12)
    assert glide(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 0.5, 1.0])


def test_fast_attitudes_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    euler, turn = rng.normal(size=(200, 3)), 1e-3 * rng.normal(size=(200, 3))
    oracle = Rotation.from_euler("ZYX", euler) * Rotation.from_rotvec(turn)
    assert (attitude_of(euler, turn).inv() * oracle).magnitude().max() < 1e-8
