"""Measurement of the body: it is over the mean of its feet.

``h(x) = 1/n · Σ (p_f + Rz(ψ_f)·o_f)`` with ``o_f`` the foot's displacement since its last step, in that step's
end heading (zero in stance).
"""

import math
from collections.abc import Sequence

import numpy as np

from bootprint.messages import Vector3
from fusion.models.foot_step import rotate, yaw_derivative
from fusion.models.turned import beside_the_tangent, on_the_arc
from fusion.state import Array, FootBlock

Stand = tuple[FootBlock, Vector3]  # a foot, and how far it is from its last stance


def foot_position(state: Array, stand: Stand) -> Array:
    """One foot's position now, (3,) m."""
    block, offset = stand
    return state[block.position] + rotate(float(state[block.yaw]), offset)


def position(state: Array, stands: Sequence[Stand]) -> Array:
    """The body's position, (3,) m."""
    total = np.zeros(3)
    for stand in stands:
        total += foot_position(state, stand)
    return total / len(stands)


def position_jacobian(state: Array, stands: Sequence[Stand]) -> Array:
    """``∂position/∂state`` (3, n)."""
    jacobian = np.zeros((3, state.size))
    share = 1.0 / len(stands)
    for block, offset in stands:
        jacobian[:, block.position] = share * np.eye(3)
        jacobian[:, block.yaw] = share * np.array(yaw_derivative(float(state[block.yaw]), offset))
    return jacobian


def heading_jacobian(state: Array, stands: Sequence[Stand]) -> Array:
    """``∂(mean of the feet's yaws)/∂state`` (n,): how the body is turned."""
    jacobian = np.zeros(state.size)
    for block, _ in stands:
        jacobian[block.yaw] = 1.0 / len(stands)
    return jacobian


def position_covariance(state: Array, covariance: Array, stands: Sequence[Stand]) -> Array:
    """Of the position (3, 3), m², with a doubtful heading's share bent to the arc it is."""
    jacobian = position_jacobian(state, stands)
    return on_the_arc(jacobian @ covariance @ jacobian.T, *_by_heading(state, covariance, stands))


def unseen_by_tangent(state: Array, covariance: Array, stands: Sequence[Stand]) -> Array:
    """The part of the position's covariance (3, 3), m², that is the arc's alone."""
    return beside_the_tangent(*_by_heading(state, covariance, stands))


def heading_sigma_rad(state: Array, covariance: Array, stands: Sequence[Stand]) -> float:
    """How doubtful it is how the body is turned."""
    return math.sqrt(max(0.0, _by_heading(state, covariance, stands)[1]))


def _by_heading(state: Array, covariance: Array, stands: Sequence[Stand]) -> tuple[Array, float]:
    """How the position errs with the body's yaw (3,), m·rad, and the yaw's variance, rad²."""
    heading = heading_jacobian(state, stands)
    with_yaw = covariance @ heading
    return position_jacobian(state, stands) @ with_yaw, float(heading @ with_yaw)
