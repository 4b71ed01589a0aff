"""The ellipsoid fit: known iron is found again, and samples that do not tell enough are refused."""

import numpy as np
import pytest

from bootprint.errors import RecordingError
from pdr_engine.ellipsoid import DIRECTIONS, fit_ellipsoid

STRENGTH_UT = 48.0
HARD = np.array([12.0, -20.0, 5.0])
SOFT = np.array([[1.10, 0.05, -0.02], [0.05, 0.95, 0.03], [-0.02, 0.03, 1.02]])


def turned(count: int = 2000, seed: int = 0) -> np.ndarray:
    """Directions (n, 3), everywhere on the sphere."""
    unit = np.random.default_rng(seed).normal(size=(count, 3))
    return unit / np.linalg.norm(unit, axis=1, keepdims=True)


def measured(unit: np.ndarray, soft: np.ndarray = SOFT, noise_ut: float = 0.4) -> np.ndarray:
    noise = np.random.default_rng(1).normal(0.0, noise_ut, unit.shape)
    return STRENGTH_UT * unit @ soft.T + HARD + noise


def test_known_iron_is_found_again() -> None:
    fit = fit_ellipsoid(measured(turned()), STRENGTH_UT)
    np.testing.assert_allclose(fit.offset_ut, HARD, atol=0.1)
    np.testing.assert_allclose(fit.matrix @ SOFT, np.eye(3), atol=0.003)
    assert fit.strength_ut == STRENGTH_UT
    assert fit.residual_ut == pytest.approx(0.4, abs=0.03)  # nothing but the noise is left
    assert fit.raw_residual_ut > 10.0
    assert fit.directions == len(DIRECTIONS) == 26


def test_without_the_strength_the_mean_gain_is_kept() -> None:
    fit = fit_ellipsoid(measured(turned()))
    assert np.linalg.det(fit.matrix) == pytest.approx(1.0, abs=1e-6)
    assert fit.strength_ut == pytest.approx(STRENGTH_UT * np.linalg.det(SOFT) ** (1 / 3), rel=0.003)


@pytest.mark.parametrize("height", [0.0, 0.2, 0.5])
def test_a_boot_that_was_not_turned_over_is_refused(height: float) -> None:
    unit = turned()
    with pytest.raises(RecordingError, match="directions, want at least 20: turn the boot"):
        fit_ellipsoid(measured(unit[unit[:, 2] > height]))


def test_what_is_no_calibration_is_refused() -> None:
    unit = turned()
    with pytest.raises(RecordingError, match="too few"):
        fit_ellipsoid(measured(unit[:50]))
    with pytest.raises(RecordingError, match="all the same"):
        fit_ellipsoid(np.tile([20.0, 0.0, 40.0], (500, 1)))
    with pytest.raises(RecordingError, match="times as long as wide"):
        fit_ellipsoid(measured(unit, soft=np.diag([2.0, 1.0, 1.0])))
    with pytest.raises(RecordingError, match="still differ by"):
        fit_ellipsoid(measured(unit, noise_ut=6.0))
    sheet = np.column_stack(
        [unit[:, :2], np.sqrt(1.0 + unit[:, 0] ** 2 + unit[:, 1] ** 2)]
    )  # of a hyperboloid
    with pytest.raises(RecordingError, match="on no ellipsoid"):
        fit_ellipsoid(measured(sheet, noise_ut=0.01))
