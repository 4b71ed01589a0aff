"""Calibration of a magnetometer from a turn in all directions: the ellipsoid that its samples lie on.

In an undisturbed field every attitude shows the same strength: measured fields lie on a sphere. Iron that turns
with the sensor shifts it (hard iron) and stretches it (soft iron). The quadric x'Ax + 2b'x = 1 is fitted by linear
least squares (after Li and Griffiths 2004, here without their constraint: what is no ellipsoid is refused); its
centre −A⁻¹b is the offset, and the square root of A, scaled, maps it back to a sphere. A rotation between the
magnetometer's axes and those of the inertial unit cannot be seen this way: the maker's alignment is believed.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from bootprint.errors import RecordingError
from bootprint.messages import Float64Array

LEAST_SAMPLES = 100
LEAST_DIRECTIONS = 20
MOST_RESIDUAL = 0.05  # of the strength
MOST_STRETCH = 1.6  # of the longest axis over the shortest: boots and housings do less
_LEAST_SPREAD_UT = 1e-6
_REACH_RAD = np.radians(30.0)
# The middle of each face, edge and corner of a cube: 26 directions, nowhere more than 28° to the nearest.
_DIRECTIONS = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
DIRECTIONS = _DIRECTIONS / np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True)
class EllipsoidFit:
    """field = ``matrix`` (3, 3) · (measured − ``offset_ut`` (3,)), and how good that is.

    ``strength_ut``: of every calibrated sample, were it perfect; ``residual_ut``: how far (RMS) they are from it;
    ``raw_residual_ut``: how far the measured ones were from their mean strength; ``directions``: how many of
    `DIRECTIONS` the samples cover.
    """

    offset_ut: Float64Array
    matrix: Float64Array
    strength_ut: float
    residual_ut: float
    raw_residual_ut: float
    directions: int


def fit_ellipsoid(mag_ut: Float64Array, strength_ut: float | None = None) -> EllipsoidFit:
    """Fit to samples (n, 3) µT; RecordingError where they do not tell enough.

    ``strength_ut`` of the field there scales the result; without it the mean gain of the sensor is believed.
    """
    if len(mag_ut) < LEAST_SAMPLES:
        raise RecordingError(f"{len(mag_ut)} magnetic samples are too few, want at least {LEAST_SAMPLES}")
    offset, shape = _quadric(mag_ut)
    scale = strength_ut if strength_ut is not None else float(np.linalg.det(shape)) ** (-1.0 / 3.0)
    calibrated = (mag_ut - offset) @ (scale * shape).T
    strengths, raw = np.linalg.norm(calibrated, axis=1), np.linalg.norm(mag_ut, axis=1)
    fit = EllipsoidFit(
        offset_ut=offset,
        matrix=scale * shape,
        strength_ut=scale,
        residual_ut=float(np.sqrt(np.mean((strengths - scale) ** 2))),
        raw_residual_ut=float(np.std(raw)),
        directions=_covered(calibrated / strengths[:, None]),
    )
    _check(fit)
    return fit


def _quadric(mag_ut: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Centre (3,) of the best quadric, and the symmetric matrix (3, 3) that maps it onto the unit sphere."""
    middle = mag_ut.mean(axis=0)
    size = float((mag_ut - middle).std())
    if not size > _LEAST_SPREAD_UT:
        raise RecordingError("the magnetic samples are all the same: is the magnetometer running?")
    x, y, z = ((mag_ut - middle) / size).T
    columns = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z])
    solution = np.linalg.lstsq(columns, np.ones(len(x)), rcond=None)[0]
    a, b, c, d, e, f = solution[:6]
    form = np.array([[a, d, e], [d, b, f], [e, f, c]])
    if np.linalg.eigvalsh(form).min() <= 1e-6:
        raise RecordingError("the magnetic samples lie on no ellipsoid: turn the boot in all directions")
    centre = -np.linalg.solve(form, solution[6:])
    values, vectors = np.linalg.eigh(form / (1.0 + centre @ form @ centre))
    return middle + size * centre, (vectors * np.sqrt(values)) @ vectors.T / size


def _covered(unit: Float64Array) -> int:
    """How many of the directions have a sample (n, 3) nearby."""
    return int(((unit @ DIRECTIONS.T).max(axis=0) > np.cos(_REACH_RAD)).sum())


def _check(fit: EllipsoidFit) -> None:
    if fit.directions < LEAST_DIRECTIONS:
        raise RecordingError(
            f"the magnetic samples cover {fit.directions} of {len(DIRECTIONS)} directions, want at least "
            f"{LEAST_DIRECTIONS}: turn the boot in all directions, upside down too"
        )
    axes = np.linalg.eigvalsh(fit.matrix)
    if axes[-1] > MOST_STRETCH * axes[0]:
        raise RecordingError(
            f"the fitted ellipsoid is {axes[-1] / axes[0]:.1f} times as long as wide, no boot does more than "
            f"{MOST_STRETCH:g}: turn more slowly and in all directions"
        )
    if fit.residual_ut > MOST_RESIDUAL * fit.strength_ut:
        raise RecordingError(
            f"calibrated samples still differ by {fit.residual_ut:.1f} µT of {fit.strength_ut:.1f} µT (want "
            f"{100 * MOST_RESIDUAL:g} %): turn the boot outdoors, away from iron, without walking about"
        )
