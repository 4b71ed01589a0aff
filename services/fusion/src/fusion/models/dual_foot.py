"""Two feet belong to one body (METHODS D4): "same 3-D position", and never further apart than a bound.

While one foot stands, the other passes it. So the standing foot is compared with the *midpoint* of the step that
the other foot has just made: there they are abreast, and the half stride by which stances are staggered cancels.
``h(x) = p_standing − (p_stepped − ½·Rz(ψ_stepped − Δψ)·d)``, expected zero, σ = 1 m.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Vector3
from fusion.models.foot_step import rotate, yaw_derivative
from fusion.state import Array, FootBlock


@dataclass(frozen=True, slots=True)
class Passing:
    """A foot's step past the other: the step is the newest one composed into the state."""

    standing: FootBlock
    stepped: FootBlock
    displacement_m: Vector3
    turn_rad: float


def difference(state: Array, passing: Passing) -> Array:
    """Standing foot minus the midpoint of the other's step, (3,) m."""
    yaw = float(state[passing.stepped.yaw]) - passing.turn_rad
    half = 0.5 * np.array(rotate(yaw, passing.displacement_m))
    result: Array = state[passing.standing.position] - state[passing.stepped.position] + half
    return result


def difference_jacobian(state: Array, passing: Passing) -> Array:
    """``∂difference/∂state`` (3, n)."""
    yaw = float(state[passing.stepped.yaw]) - passing.turn_rad
    jacobian = np.zeros((3, state.size))
    jacobian[:, passing.standing.position] = np.eye(3)
    jacobian[:, passing.stepped.position] = -np.eye(3)
    jacobian[:, passing.stepped.yaw] = 0.5 * np.array(yaw_derivative(yaw, passing.displacement_m))
    return jacobian


def separation(state: Array, passing: Passing) -> float:
    """How far apart the feet are when abreast, m."""
    return math.hypot(*difference(state, passing))


def separation_jacobian(state: Array, passing: Passing) -> Array:
    """``∂separation/∂state`` (1, n); needs feet that are apart."""
    apart = difference(state, passing)
    result: Array = (apart / math.hypot(*apart)) @ difference_jacobian(state, passing)
    return result[np.newaxis, :]
