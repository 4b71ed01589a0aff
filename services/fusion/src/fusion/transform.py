"""Rigid moves of the boots frame into ENU, with the error of the move itself.

``p' = target + Rz(yaw)·(p − pivot)``, ``ψ' = ψ + yaw``. The error is that of (east, north, up) at the target and of
the yaw; at another point the yaw's error acts with the lever from the target.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import Vector3
from fusion.models.foot_step import rotate
from fusion.state import Array


@dataclass(frozen=True, slots=True)
class RigidTransform:
    """A turn about up and a shift; ``covariance`` (4, 4) of (east, north, up m, yaw rad) at the target.

    ``sighted``: the turn is such that who stands there, in the old frame, comes to lie in a known direction from
    the target. So it takes back what their way from the pivot has erred aside.
    """

    pivot: Vector3
    target: Vector3
    yaw_rad: float
    covariance: Array
    sighted: Vector3 | None = None

    def point(self, local: Vector3) -> Array:
        """A point of the old frame in the new one, (3,) m."""
        lever = rotate(self.yaw_rad, _minus(local, self.pivot))
        return np.array([target + part for target, part in zip(self.target, lever, strict=True)])

    def pose(self, local: Array) -> Array:
        """A pose (east, north, up, yaw) of the old frame in the new one, (4,)."""
        point = self.point((float(local[0]), float(local[1]), float(local[2])))
        return np.append(point, wrap_angle(float(local[3]) + self.yaw_rad))

    def rotation(self) -> Array:
        """The turn as a matrix (3, 3)."""
        cosine, sine = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def pose_jacobian(self) -> Array:
        """``∂pose'/∂pose`` (4, 4)."""
        jacobian = np.eye(4)
        jacobian[:3, :3] = self.rotation()
        return jacobian

    def error_jacobian(self, local: Vector3) -> Array:
        """``∂pose'/∂(move's error)`` (4, 4) at a point of the old frame."""
        east, north, _ = rotate(self.yaw_rad, _minus(local, self.pivot))
        jacobian = np.eye(4)
        jacobian[:2, 3] = (-north, east)
        return jacobian

    def turn_response(self) -> Array:
        """``∂yaw/∂(east, north m)`` of who was sighted, in the old frame, (2,); zeros if nobody was."""
        if self.sighted is None:
            return np.zeros(2)
        east, north, _ = _minus(self.sighted, self.pivot)
        return np.array([north, -east]) / (east**2 + north**2)


def _minus(one: Vector3, other: Vector3) -> Vector3:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]
