"""Propagation of one foot by a step: ``p ← p + Rz(ψ)·d``, ``ψ ← ψ + Δψ`` (planar pose composition).

Pose is (east m, north m, up m, yaw rad); a step is (forward m, left m, up m, heading change rad) in the pose's own
heading. Smith, Self and Cheeseman, "Estimating uncertain spatial relationships" (1990): compounding ⊕ and its
Jacobians.
"""

import math

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import Vector3, symmetric
from fusion.config import FeetConfig
from fusion.state import Array

_LARGEST = 1e6  # m², rad²: of a step that could have ended anywhere within a kilometre


def rotate(yaw_rad: float, vector: Vector3) -> Vector3:
    """A vector turned counter-clockwise about up."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    forward, left, up = vector
    return cosine * forward - sine * left, sine * forward + cosine * left, up


def yaw_derivative(yaw_rad: float, vector: Vector3) -> Vector3:
    """``∂(Rz(ψ)·v)/∂ψ``: the turned vector, a quarter turn on, without its height."""
    east, north, _ = rotate(yaw_rad, vector)
    return -north, east, 0.0


def compose(pose: Array, displacement_m: Vector3, turn_rad: float) -> Array:
    """The pose (4,) after a step."""
    east, north, up = rotate(float(pose[3]), displacement_m)
    return np.array([pose[0] + east, pose[1] + north, pose[2] + up, wrap_angle(float(pose[3]) + turn_rad)])


def pose_jacobian(pose: Array, displacement_m: Vector3) -> Array:
    """``∂compose/∂pose`` (4, 4)."""
    jacobian = np.eye(4)
    jacobian[:3, 3] = yaw_derivative(float(pose[3]), displacement_m)
    return jacobian


def step_jacobian(pose: Array) -> Array:
    """``∂compose/∂(displacement, turn)`` (4, 4)."""
    cosine, sine = math.cos(pose[3]), math.sin(pose[3])
    jacobian = np.eye(4)
    jacobian[:2, :2] = ((cosine, -sine), (sine, cosine))
    return jacobian


def step_covariance(triangle: tuple[float, ...]) -> Array | None:
    """The step's own covariance (4, 4); None if it is none (negative, beyond reason, not positive semidefinite)."""
    covariance = symmetric(triangle)
    if np.abs(covariance).max() > _LARGEST:
        return None
    scale = float(np.trace(covariance))
    if scale < 0.0 or np.linalg.eigvalsh(covariance)[0] < -1e-9 * max(scale, 1e-12):
        return None
    return covariance


def unmodelled(displacement_m: Vector3, duration_s: float, boots: FeetConfig) -> Array:
    """Variances (4, 4) for what steps have in common (scale, gyro bias): their own covariance holds it once a step.

    Such errors correlate from step to step, white noise does not; so the defaults are larger than one step's
    share, to be right after minutes of walking rather than after one step.
    """
    scale = (boots.scale_sigma * math.hypot(*displacement_m)) ** 2
    turn = boots.heading_walk_rad_sqrt_s**2 * max(duration_s, 0.0)
    return np.diag([scale, scale, scale, turn])
