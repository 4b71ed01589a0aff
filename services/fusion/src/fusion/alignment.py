"""Directions out of walking: a walk's own direction, and the turn between two tracks of the same walk.

A foot INS knows its heading only from where it happened to point at the start: the sensor's mounting on the boot
is unknown. But the *track* it reckons has a shape, and shapes can be laid over one another.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Vector3
from fusion.config import AlignConfig
from fusion.state import Array


@dataclass(slots=True)
class Walk:
    """A stretch of walking: its chord tells a direction, and chord against path how straight it was."""

    start: Vector3
    end: Vector3
    path_m: float = 0.0

    @classmethod
    def begin(cls, at: Vector3) -> "Walk":
        """A walk that begins here."""
        return cls(at, at)

    def go(self, to: Vector3) -> None:
        """One step more, that ended at ``to``."""
        self.path_m += math.hypot(to[0] - self.end[0], to[1] - self.end[1])
        self.end = to

    @property
    def chord_m(self) -> float:
        """Horizontal distance from start to end."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def direction_rad(self) -> float:
        """Yaw of the chord, counter-clockwise from the frame's x axis."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def sigma_rad(self, align: AlignConfig) -> float:
        """How sure the chord tells the direction that was meant.

        The end of the chord is a foot beside the line walked; and for steps whose directions scatter by θ about
        the chord, chord/path ≈ 1 − θ²/2 (circular variance), so a walk that was not straight tells little.
        """
        crooked = 2.0 * max(0.0, 1.0 - self.chord_m / max(self.path_m, self.chord_m))
        return math.sqrt((align.lateral_sigma_m / self.chord_m) ** 2 + crooked)


@dataclass(frozen=True, slots=True)
class RigidFit:
    """``place ≈ target + Rz(yaw)·(track − pivot)``: with the covariance (3, 3) of (target east, north m, yaw rad).

    ``residuals`` (k, 2) m; ``chi_square`` is their weighted sum, of ``2k − 3`` degrees of freedom.
    """

    pivot: Array
    target: Array
    yaw_rad: float
    covariance: Array
    residuals: Array
    chi_square: float


def fit_rigid(track: Array, places: Array, covariance: Array) -> RigidFit:
    """Lay a track (k, 2) over places (k, 2) whose errors have covariance (k, k), the same for both axes.

    Closed-form weighted Procrustes for the turn (Umeyama 1991 in the plane, no scale), then Gauss-Newton steps of
    generalised least squares, whose normal matrix is the covariance's inverse. Needs two distinct points.
    """
    information = np.linalg.inv(covariance)
    weights = 1.0 / np.diag(covariance)
    pivot = weights @ track / weights.sum()
    target = weights @ places / weights.sum()
    yaw = _procrustes_yaw(track - pivot, places - target, weights)
    for _ in range(3):
        rows = _design(track - pivot, yaw)
        residual = places - target - (track - pivot) @ _rotation(yaw).T
        weighted = np.einsum("kl,lai->kai", information, rows)
        normal = np.einsum("kai,kaj->ij", rows, weighted)
        step = np.linalg.solve(normal, np.einsum("kai,ka->i", weighted, residual))
        target, yaw = target + step[:2], yaw + float(step[2])
    residual = places - target - (track - pivot) @ _rotation(yaw).T
    chi_square = float(np.sum(residual * (information @ residual)))
    return RigidFit(pivot, target, yaw, np.linalg.inv(normal), residual, chi_square)


def _procrustes_yaw(track: Array, places: Array, weights: Array) -> float:
    dot = float(weights @ np.sum(track * places, axis=1))
    cross = float(weights @ (track[:, 0] * places[:, 1] - track[:, 1] * places[:, 0]))
    return math.atan2(cross, dot)


def _rotation(yaw: float) -> Array:
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


def _design(track: Array, yaw: float) -> Array:
    """``∂(target + R·track)/∂(target, yaw)``, (k, 2, 3)."""
    turned = track @ _rotation(yaw).T
    rows = np.zeros((len(track), 2, 3))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    rows[:, 0, 2], rows[:, 1, 2] = -turned[:, 1], turned[:, 0]
    return rows
