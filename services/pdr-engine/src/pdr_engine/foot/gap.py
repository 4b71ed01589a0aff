"""Across a gap of the stream: what a foot may have done unseen, from 50 ms to a second.

Nothing is known of the force, so the velocity stays as it is, doubted by a white acceleration; the zero-velocity
update behind the gap then finds velocity and place together. Feet pitch by more than they turn, so attitude is
doubted more about the horizontal axes, where gravity will tell, than about the vertical, where nothing will.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import ATTITUDE, HEADING, MASK, POSITION, VELOCITY
from pdr_engine.foot.quaternion import assign, from_rotation_vector, multiply, normalised

SEEN_S = 0.4  # the turn at the mean of the rates on both sides counts by exp(−(gap / this)²)
TURN_RAD_S = 1.0  # sigma of what a foot turns about the vertical unseen


@compiled
def coast(s: Record, at: int, dt: float) -> None:
    """Carry the nominal state over the gap before sample ``at``: constant velocity, part of the ends' mean rate."""
    here, before = at & MASK, (at - 1) & MASK
    seen_s = dt * math.exp(-((dt / SEEN_S) ** 2))
    for axis in range(3):
        s.rate[axis] = (0.5 * (s.gyro[here, axis] + s.gyro[before, axis]) - s.bias[axis]) * seen_s
        s.position[axis] += s.velocity[axis] * dt
        s.force[axis] = s.gravity if axis == 2 else 0.0
    turn = from_rotation_vector(s.rate[0], s.rate[1], s.rate[2])
    assign(s.attitude, normalised(multiply(s.attitude, turn)))


@compiled
def doubt_gap(s: Record, p: Record, dt: float) -> None:
    """Covariance of a gap: white acceleration of ``gap_accel`` · √dt, and turns of a constant unknown rate."""
    P, power = s.P, (p.gap_accel * dt) ** 2
    for axis in range(3):
        i, j = POSITION + axis, VELOCITY + axis
        P[i, i] += power * dt**2 / 3.0
        P[i, j] += power * dt / 2.0
        P[j, i] = P[i, j]
        P[j, j] += power
        P[ATTITUDE + axis, ATTITUDE + axis] += (p.gap_rate * dt) ** 2
    P[HEADING, HEADING] += (TURN_RAD_S**2 - p.gap_rate**2) * dt**2
