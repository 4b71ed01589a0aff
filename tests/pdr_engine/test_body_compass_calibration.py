"""Calibration of a worn compass (A5), deviations by place (B5), misalignment by virtual positions (B4)."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.errors import RecordingError
from pdr_engine.body.azimuth.calibration import (
    azimuths_of,
    fit_closed,
    fit_static,
    fit_straight,
    in_device_axes,
    turned,
)
from pdr_engine.body.azimuth.deviation_map import DeviationMap

HORIZONTAL, DOWN = 21.0, 43.0


def level_field(azimuth_rad: np.ndarray) -> np.ndarray:
    """Ahead, left, up of one who faces these azimuths from magnetic north (n, 3)."""
    return np.column_stack(
        [HORIZONTAL * np.cos(azimuth_rad), HORIZONTAL * np.sin(azimuth_rad), np.full(len(azimuth_rad), -DOWN)]
    )


def test_the_circle_is_found_again() -> None:
    """measured = (corrected − offset)/scale with scale 1.2 and 1/1.2, offsets 4 and −6 µT."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, 200)
    true = level_field(azimuth)[:, :2]
    measured = (true - [4.0, -6.0]) / [1.2, 1.0 / 1.2]
    fit = fit_static(measured)
    # The product of the scales is believed to be 1, as it is here.
    np.testing.assert_allclose(fit.scale, [1.2, 1.0 / 1.2], rtol=1e-6)
    np.testing.assert_allclose(fit.offset_ut, [4.0, -6.0], atol=1e-6)
    assert fit.horizontal_ut == pytest.approx(HORIZONTAL)
    assert fit.residual_ut < 1e-6 < 3.0 < fit.raw_residual_ut


@pytest.mark.parametrize(
    ("points", "complaint"),
    [
        (np.zeros((10, 2)), "too few"),
        (np.ones((100, 2)), "never changes"),
        (level_field(np.linspace(0.0, 2.0, 100))[:, :2], "covers"),
        (np.random.default_rng(0).normal(0.0, 10.0, (300, 2)), "still differ"),
        (level_field(np.linspace(0.0, 6.28, 100))[:, :2] * [1.0, 0.4], "half as long again"),
    ],
)
def test_what_is_no_turn_is_said(points: np.ndarray, complaint: str) -> None:
    with pytest.raises(RecordingError, match=complaint):
        fit_static(points)


def test_a_straight_way_out_and_back_tells_virtual_pitch_and_roll() -> None:
    rng = np.random.default_rng(0)
    azimuth = np.array([1.0] * 60 + [1.0 + math.pi] * 60)
    pitch, roll = math.radians(1.48), math.radians(4.92)  # the source's
    # What the device sees is the level field with the virtual angles not yet taken off.
    level = level_field(azimuth + rng.normal(0.0, 0.03, 120))
    seen = Rotation.from_euler("yx", [pitch, roll]).inv().apply(level)
    fit = fit_straight(seen, azimuth)
    # A straight way tells one combination of both: what matters is that the azimuths are right.
    assert fit.before > math.radians(5.0)
    assert fit.after < math.radians(2.5)
    errors = azimuths_of(turned(seen, fit.pitch_rad, fit.roll_rad)) - azimuth
    assert abs(math.degrees(float(np.mean(np.sin(errors))))) < 0.7


def test_a_closed_walk_is_closed() -> None:
    azimuth = np.repeat([0.2, 0.2 + 0.5 * np.pi, 0.2 + np.pi, 0.2 + 1.5 * np.pi], 50)
    seen = Rotation.from_euler("yx", np.radians([2.0, -4.0])).inv().apply(level_field(azimuth))
    fit = fit_closed(seen, np.full(200, 0.7))
    assert fit.before > 8.0
    assert fit.after < 0.1 * fit.before
    errors = np.degrees(azimuths_of(turned(seen, fit.pitch_rad, fit.roll_rad)) - azimuth)
    assert np.abs((errors + 180.0) % 360.0 - 180.0).max() < 1.5


def test_too_few_steps_are_no_track() -> None:
    with pytest.raises(RecordingError, match="too few"):
        fit_closed(np.ones((5, 3)), np.ones(5))


def test_the_device_s_matrix_does_the_same_as_the_level_formulas() -> None:
    """Of a unit that is worn in any attitude."""
    rng = np.random.default_rng(4)
    frame = Rotation.random(random_state=1).as_matrix()
    measured_level = rng.normal(0.0, 20.0, (120, 3))
    static = fit_static((level_field(np.linspace(0.0, 6.28, 200))[:, :2] - [4.0, -6.0]) / [1.2, 0.9])
    matrix, offset = in_device_axes(static, None, frame)
    in_device = measured_level @ frame  # rows: device = frameᵀ · level
    again = (in_device - offset) @ matrix.T @ frame.T
    expected = measured_level.copy()
    expected[:, :2] = static.scale * measured_level[:, :2] + static.offset_ut
    np.testing.assert_allclose(again, expected, atol=1e-9)


def test_deviations_of_one_walk_correct_the_next() -> None:
    first = DeviationMap()
    rng = np.random.default_rng(0)
    for _ in range(30):
        first.learn(np.array([10.0, -3.0]), 0.35 + rng.normal(0.0, 0.05), 0.10)
    again = DeviationMap(first.cells())
    deviation, sigma = again.deviation_rad(np.array([11.0, -2.0]))
    # Bayes: 30 steps of 10° against a prior of 6°: 36/(36 + 100/30) = 0.915 of 0.25
    assert deviation == pytest.approx(0.915 * 0.25, abs=0.02)
    assert math.degrees(sigma) == pytest.approx(math.sqrt(0.915 * 100.0 / 30.0), abs=0.01)
    assert again.deviation_rad(np.array([50.0, 50.0]))[0] == 0.0
