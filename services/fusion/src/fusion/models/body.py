"""Measurement of the body: it is over the mean of its feet.

``h(x) = 1/n · Σ (p_f + Rz(ψ_f)·o_f)`` with ``o_f`` the foot's displacement since its last step, in that step's
end heading (zero in stance).
"""

from collections.abc import Sequence

import numpy as np

from bootprint.messages import Vector3
from fusion.models.foot_step import rotate, yaw_derivative
from fusion.models.turned import on_the_arc
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
    jacobian, heading = position_jacobian(state, stands), heading_jacobian(state, stands)
    with_yaw = covariance @ heading
    linear = jacobian @ covariance @ jacobian.T
    return on_the_arc(linear, jacobian @ with_yaw, float(heading @ with_yaw))
