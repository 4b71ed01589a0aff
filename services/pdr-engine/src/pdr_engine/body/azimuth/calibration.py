"""Calibration of a worn compass: static by turning on the spot, dynamic by a known track (METHODS A5).

Static: clothes and accessories shift and stretch the circle that the horizontal field describes while its wearer
turns: ``Hx = Xsf·Hx_meas + X0``, ``Hy = Ysf·Hy_meas + Y0``. Dynamic: walking tilts what low-passed gravity calls
the vertical; constant virtual pitch and roll make up for it. They have no physical meaning; they are those with
which the azimuths fit a straight track out and back, or close a closed one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from bootprint.errors import RecordingError
from pdr_engine.body.pieces import FloatArray

LEAST_SAMPLES = 50
SECTORS, LEAST_SECTORS = 12, 11
MOST_RESIDUAL = 0.15  # of the circle's radius
MOST_STRETCH = 1.5
LEAST_STEPS = 20
_VIRTUAL_SIGMA_RAD = math.radians(6.0)  # the source found 1.48° and 4.92°
_STEP_SIGMA_RAD = math.radians(8.0)
_CLOSING_SHARE = 0.01  # of the way: what step lengths leave open


@dataclass(frozen=True, slots=True)
class StaticFit:
    """corrected = ``scale`` (2,) · measured + ``offset_ut`` (2,), ahead and left.

    ``residual_ut``, ``raw_residual_ut``: RMS distance from a circle, after and before.
    """

    scale: FloatArray
    offset_ut: FloatArray
    horizontal_ut: float
    residual_ut: float
    raw_residual_ut: float


def fit_static(horizontal_ut: FloatArray) -> StaticFit:
    """Fit to horizontal fields (n, 2), µT, ahead and left, of a whole turn; RecordingError where they are none."""
    if len(horizontal_ut) < LEAST_SAMPLES:
        raise RecordingError(
            f"{len(horizontal_ut)} magnetic samples are too few, want at least {LEAST_SAMPLES}"
        )
    centre, radii = _ellipse(horizontal_ut)
    size = float(np.sqrt(radii.prod()))
    scale = size / radii
    corrected = scale * (horizontal_ut - centre)
    distance = np.linalg.norm(corrected, axis=1)
    raw = np.linalg.norm(horizontal_ut, axis=1)
    fit = StaticFit(
        scale, -scale * centre, size, float(np.sqrt(np.mean((distance - size) ** 2))), float(raw.std())
    )
    _check(fit, corrected)
    return fit


def _ellipse(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre (2,) and half axes (2,) of the ellipse along the axes, a·x² + b·y² + c·x + d·y = 1, that fits best."""
    middle = points.mean(axis=0)
    size = float((points - middle).std())
    if not size > 1e-3:
        raise RecordingError(
            "the horizontal field never changes: turn on the spot, is the magnetometer running?"
        )
    x, y = ((points - middle) / size).T
    a, b, c, d = np.linalg.lstsq(np.column_stack([x * x, y * y, x, y]), np.ones(len(x)), rcond=None)[0]
    if a <= 1e-3 or b <= 1e-3:
        raise RecordingError(
            "the horizontal field describes no ellipse: turn on the spot, a whole turn and more"
        )
    centre = np.array([-c / (2.0 * a), -d / (2.0 * b)])
    height = 1.0 + c * c / (4.0 * a) + d * d / (4.0 * b)
    return middle + size * centre, size * np.sqrt(height / np.array([a, b]))


def _check(fit: StaticFit, corrected: FloatArray) -> None:
    azimuth = np.arctan2(corrected[:, 1], corrected[:, 0])
    sectors = len(np.unique(np.floor((azimuth + np.pi) / (2.0 * np.pi) * SECTORS)))
    if sectors < LEAST_SECTORS:
        share = 100 * sectors // SECTORS
        raise RecordingError(
            f"the turn covers {share} % of the circle: turn on the spot, a whole turn and more"
        )
    if max(fit.scale) > MOST_STRETCH * min(fit.scale):
        raise RecordingError(
            "the ellipse is half as long again as it is wide: take iron off the unit, turn again"
        )
    if fit.residual_ut > MOST_RESIDUAL * fit.horizontal_ut:
        raise RecordingError(
            f"calibrated samples still differ by {fit.residual_ut:.1f} µT of {fit.horizontal_ut:.1f} µT: "
            "turn outdoors, away from iron, upright and without walking about"
        )


@dataclass(frozen=True, slots=True)
class DynamicFit:
    """Virtual ``pitch_rad`` (about left) and ``roll_rad`` (about ahead); what azimuths err by, before and after."""

    pitch_rad: float
    roll_rad: float
    before: float
    after: float


def turned(field_ut: FloatArray, pitch_rad: float, roll_rad: float) -> FloatArray:
    """Fields (n, 3) ahead, left, up in a frame with these virtual angles taken off."""
    return np.asarray(Rotation.from_euler("yx", [pitch_rad, roll_rad]).apply(field_ut))


def azimuths_of(field_ut: FloatArray) -> FloatArray:
    """From magnetic north, clockwise, of the axis ahead, (n,)."""
    return np.asarray(np.arctan2(field_ut[:, 1], field_ut[:, 0]))


def fit_straight(field_ut: FloatArray, azimuth_rad: FloatArray) -> DynamicFit:
    """By steps' mean fields (n, 3) µT and the way's known magnetic azimuth at each (n,): errors are RMS, rad."""
    _enough(field_ut)

    def miss(angles: FloatArray) -> FloatArray:
        error = azimuths_of(turned(field_ut, *angles)) - azimuth_rad
        return np.asarray((error + np.pi) % (2.0 * np.pi) - np.pi)

    def rms(angles: FloatArray) -> float:
        return float(np.sqrt(np.mean(miss(angles) ** 2)))

    return _fitted(lambda angles: miss(angles) / _STEP_SIGMA_RAD / math.sqrt(0.2 * len(field_ut)), rms)


def fit_closed(field_ut: FloatArray, length_m: FloatArray) -> DynamicFit:
    """By steps' mean fields (n, 3) µT and lengths (n,) of a walk that ends where it began: errors are gaps, m."""
    _enough(field_ut)

    def gap(angles: FloatArray) -> FloatArray:
        azimuth = azimuths_of(turned(field_ut, *angles))
        return np.array([(length_m * np.sin(azimuth)).sum(), (length_m * np.cos(azimuth)).sum()])

    def size(angles: FloatArray) -> float:
        return float(np.hypot(*gap(angles)))

    return _fitted(lambda angles: gap(angles) / (_CLOSING_SHARE * length_m.sum()), size)


def _fitted(miss: Callable[[FloatArray], FloatArray], error: Callable[[FloatArray], float]) -> DynamicFit:
    """The angles that miss least, with what is usual for them as prior."""

    def penalised(angles: FloatArray) -> FloatArray:
        return np.concatenate([miss(angles), angles / _VIRTUAL_SIGMA_RAD])

    start = np.zeros(2)
    found: FloatArray = least_squares(penalised, start).x
    return DynamicFit(float(found[0]), float(found[1]), error(start), error(found))


def _enough(field_ut: FloatArray) -> None:
    if len(field_ut) < LEAST_STEPS:
        raise RecordingError(f"{len(field_ut)} steps are too few for a track, want at least {LEAST_STEPS}")


def in_device_axes(
    static: StaticFit, dynamic: DynamicFit | None, level_frame: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Both as field = matrix · (measured − offset) of the device: matrix (3, 3) and offset (3,) µT.

    ``level_frame`` (3, 3): rows ahead, left, up in device axes, as the device is worn.
    """
    stretch = np.diag([*static.scale, 1.0])
    level_offset = np.array([*(-static.offset_ut / static.scale), 0.0])
    if dynamic is not None:
        virtual = Rotation.from_euler("yx", [dynamic.pitch_rad, dynamic.roll_rad]).as_matrix()
        stretch = virtual @ stretch
    return level_frame.T @ stretch @ level_frame, level_frame.T @ level_offset
