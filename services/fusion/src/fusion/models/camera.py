"""A camera's motion as a step: levelled by the attitude that it began with, so that it composes as a foot's does.

With A the attitude at the start (body to level, body axes forward, left, up), t the translation and r the rotation
vector, the level displacement is ``A t``, told in the heading ψ of the forward axis; the attitude becomes
``A exp(r)``. Errors of translation and rotation (δt, δr, both in the body's axes at the start) turn with A. A small
turn ε of the forward axis f at the end (level axes) changes its heading by

    δψ = ε_z − f_z (ε_x f_x + ε_y f_y) / (f_x² + f_y²).

And a tilt ε of the attitude at the start moves the level displacement d by ``ε × d``.
"""

import math

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import CameraMotion, Vector3, symmetric
from fusion.state import Array

_STEEP = 1e-6  # a forward axis that stands on end has no heading


def turn_matrix(rotation_rad: Vector3 | Array) -> Array:
    """The matrix (3, 3) of a rotation vector, rad (Rodrigues)."""
    angle = math.sqrt(sum(float(part) ** 2 for part in rotation_rad))
    cross = cross_matrix(rotation_rad)
    if angle < 1e-8:
        return np.asarray(np.eye(3) + cross)
    squared = (1.0 - math.cos(angle)) / angle**2 * (cross @ cross)
    return np.asarray(np.eye(3) + math.sin(angle) / angle * cross + squared)


def cross_matrix(vector: Vector3 | Array) -> Array:
    """``v ×`` as a matrix (3, 3)."""
    x, y, z = (float(part) for part in vector)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def heading(attitude: Array) -> float:
    """Heading of the forward axis, rad counter-clockwise from level x."""
    return math.atan2(float(attitude[1, 0]), float(attitude[0, 0]))


def levelled(attitude: Array, up: Vector3) -> Array:
    """The attitude turned by as little as brings ``up`` (body axes) to where level axes have it."""
    there = attitude @ np.array(up) / max(math.hypot(*up), _STEEP)
    axis, cosine = np.array([there[1], -there[0], 0.0]), float(there[2])
    sine = math.hypot(*axis)
    turn = axis * (math.atan2(sine, cosine) / max(sine, _STEEP))
    return np.asarray(turn_matrix(turn) @ attitude)


def level_step(attitude: Array, motion: CameraMotion) -> tuple[Vector3, float]:
    """Displacement (forward, left, up m, in the heading at the start) and heading change (rad)."""
    yaw = heading(attitude)
    east, north, up = (float(part) for part in attitude @ np.array(motion.translation_m))
    cosine, sine = math.cos(yaw), math.sin(yaw)
    displacement = (cosine * east + sine * north, cosine * north - sine * east, up)
    return displacement, wrap_angle(heading(attitude @ turn_matrix(motion.rotation_rad)) - yaw)


def step_covariance(attitude: Array, motion: CameraMotion, stated: Array) -> Array:
    """Covariance (4, 4) of that step, out of the motion's own (6, 6)."""
    yaw = heading(attitude)
    cosine, sine = math.cos(yaw), math.sin(yaw)
    to_heading = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    forward = (attitude @ turn_matrix(motion.rotation_rad))[:, 0]
    flat = max(float(forward[0] ** 2 + forward[1] ** 2), _STEEP)
    by_turn = np.array([-forward[2] * forward[0] / flat, -forward[2] * forward[1] / flat, 1.0])
    spread = np.zeros((4, 6))
    spread[:3, :3] = to_heading @ attitude
    spread[3, 3:] = by_turn @ attitude
    return np.asarray(spread @ stated @ spread.T)


def stated_covariance(
    motion: CameraMotion, share: float, turn_share: float, floor: tuple[float, float]
) -> Array:
    """The motion's covariance (6, 6): its own, or shares of length and turn; never below a floor.

    ``floor``: sigmas of translation (m) and rotation (rad).
    """
    length, angle = math.hypot(*motion.translation_m), math.hypot(*motion.rotation_rad)
    least = np.diag([floor[0] ** 2] * 3 + [floor[1] ** 2] * 3)
    if motion.covariance is None:
        return np.asarray(least + np.diag([(share * length) ** 2] * 3 + [(turn_share * angle) ** 2] * 3))
    return np.asarray(least + symmetric(motion.covariance))
