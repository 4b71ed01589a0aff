"""Compiled quaternion arithmetic: w x y z, Hamilton, arrays or tuples in, tuples out (no allocation)."""

import math
from collections.abc import Sequence
from typing import Any

from pdr_engine.foot.compiled import compiled

Quaternion = tuple[float, float, float, float]
Vector = tuple[float, float, float]


@compiled
def assign(target: Any, source: Sequence[float]) -> None:
    """Copy a vector or quaternion (a slice assignment takes numba seconds to compile)."""
    for k in range(len(source)):
        target[k] = source[k]


@compiled
def multiply(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """The product a ⊗ b: first turn by b, then by a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@compiled
def from_rotation_vector(x: float, y: float, z: float) -> Quaternion:
    """The turn by the rotation vector (x, y, z), rad."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return (math.cos(0.5 * angle), scale * x, scale * y, scale * z)


@compiled
def rotate(q: Sequence[float], x: float, y: float, z: float) -> Vector:
    """The vector (x, y, z) turned by q."""
    u = 2.0 * (q[2] * z - q[3] * y)
    v = 2.0 * (q[3] * x - q[1] * z)
    w = 2.0 * (q[1] * y - q[2] * x)
    return (
        x + q[0] * u + q[2] * w - q[3] * v,
        y + q[0] * v + q[3] * u - q[1] * w,
        z + q[0] * w + q[1] * v - q[2] * u,
    )


@compiled
def normalised(q: Sequence[float]) -> Quaternion:
    """q with length 1."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale)


@compiled
def twist(q: Sequence[float], reference: Sequence[float]) -> float:
    """Yaw of q against ``reference``: the turn about the vertical in q ⊗ reference⁻¹ (swing-twist), rad in (−π, π].

    Fails only where the foot has turned upside down; pitch of 90° is nothing special. A turn of q about the
    vertical adds exactly to it.
    """
    back = (reference[0], -reference[1], -reference[2], -reference[3])
    turn = multiply(q, back)
    return wrapped(2.0 * math.atan2(turn[3], turn[0]))


@compiled
def wrapped(angle: float) -> float:
    """The angle in (−π, π]."""
    return angle - 2.0 * math.pi * math.ceil((angle - math.pi) / (2.0 * math.pi))
