"""Two feet belong to one body (METHODS D4): where they are as one passes the other, and never far apart.

While one foot stands, the other passes it. So the standing foot is compared with the *midpoint* of the step that
the other foot has just made: there they are abreast, and the half stride by which stances are staggered cancels.
``h(x) = p_standing − (p_stepped − ½·Rz(ψ_stepped − Δψ)·d)``.

The papers take it as zero, give or take a metre ("same position"). Feet that walk tell much more: in the step's
axes, ``h`` is the walking width to the side where the other foot is, give or take centimetres; and a step that
turns by Δψ went along an arc whose middle lies off the chord by its sagitta, |d|·Δψ/8. This ties the tracks'
*directions* to each other, so that the feet's heading drifts are averaged by their covariances.
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


def axes(state: Array, passing: Passing) -> Array:
    """Ahead, left and up of the step as rows (3, 3); of a step that goes somewhere."""
    yaw = float(state[passing.stepped.yaw]) - passing.turn_rad
    direction = yaw + math.atan2(passing.displacement_m[1], passing.displacement_m[0])
    cosine, sine = math.cos(direction), math.sin(direction)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def abreast(state: Array, passing: Passing, side: float, width: int) -> Array:
    """The difference in the step's axes minus what it should be, (3,) m: ``(0, side·w − |d|·Δψ/8, 0)``.

    ``side`` is +1 where the standing foot is to the left, −1 to the right, 0 where nobody knows; ``width`` the
    place of w in the state.
    """
    result: Array = axes(state, passing) @ difference(state, passing)
    result[1] -= side * float(state[width]) - sagitta_m(passing.displacement_m, passing.turn_rad)
    return result


def sagitta_m(displacement_m: Vector3, turn_rad: float) -> float:
    """How far the middle of a step that turns lies off its chord, to the right of one that turns left, m."""
    return math.hypot(displacement_m[0], displacement_m[1]) * turn_rad / 8.0


def beside(pose: Array, displacement_m: Vector3, turn_rad: float, aside_m: float) -> Vector3:
    """Where the other foot stands, ``aside_m`` to the left, as a step from ``pose`` (4,) passes it."""
    east, north, up = rotate(float(pose[3]), displacement_m)
    length = max(math.hypot(east, north), 1e-9)
    left_m = (aside_m - sagitta_m(displacement_m, turn_rad)) / length
    middle = (0.5 * east - left_m * north, 0.5 * north + left_m * east, 0.5 * up)
    return float(pose[0]) + middle[0], float(pose[1]) + middle[1], float(pose[2]) + middle[2]


def abreast_jacobian(state: Array, passing: Passing, side: float, width: int) -> Array:
    """``∂abreast/∂state`` (3, n); the axes turn with the foot that stepped."""
    turn = axes(state, passing)
    ahead, left, _ = turn @ difference(state, passing)
    jacobian: Array = turn @ difference_jacobian(state, passing)
    jacobian[:, passing.stepped.yaw] += (left, -ahead, 0.0)
    jacobian[1, width] = -side
    return jacobian


def separation(state: Array, passing: Passing) -> float:
    """How far apart the feet are when abreast, m."""
    return math.hypot(*difference(state, passing))


def separation_jacobian(state: Array, passing: Passing) -> Array:
    """``∂separation/∂state`` (1, n); needs feet that are apart."""
    apart = difference(state, passing)
    result: Array = (apart / math.hypot(*apart)) @ difference_jacobian(state, passing)
    return result[np.newaxis, :]
