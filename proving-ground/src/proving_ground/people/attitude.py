"""Attitudes from yaw, pitch and roll, fast: motion is asked for hundreds of times a second for every soldier."""

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.people.legs import FloatArray


def attitude_of(euler_rad: FloatArray, turn_rad: FloatArray | None = None) -> Rotation:
    """Body to ENU from yaw, pitch (down positive) and roll (n, 3), then a small turn (n, 3) in body axes.

    As ``from_euler("ZYX", euler)``, times the turn to second order, at a tenth of the time.
    """
    half = 0.5 * euler_rad.T
    (cy, cp, cr), (sy, sp, sr) = np.cos(half), np.sin(half)
    x = cy * cp * sr - sy * sp * cr
    y = cy * sp * cr + sy * cp * sr
    z = sy * cp * cr - cy * sp * sr
    w = cy * cp * cr + sy * sp * sr
    if turn_rad is not None:
        a, b, c = 0.5 * turn_rad.T
        d = 1.0 - 0.5 * (a * a + b * b + c * c)
        x, y, z, w = (
            w * a + x * d + y * c - z * b,
            w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d,
            w * d - x * a - y * b - z * c,
        )
    return Rotation.from_quat(np.column_stack([x, y, z, w]))


def along_heading(yaw_rad: FloatArray, vector: FloatArray) -> FloatArray:
    """Vectors (n, 3) forward, left, up of these headings (n,) in ENU."""
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    forward, left, up = vector.T
    return np.column_stack([cosine * forward - sine * left, sine * forward + cosine * left, up])
