"""The error-state filter: strapdown mechanisation, covariance, zero-velocity update, step-wise reset.

Nominal state: position and velocity (nav axes, z up), attitude (quaternion, sensor to nav), lever arm (sensor
axes, from the sensor to the point of the sole that stands still). Error state, 12 numbers: δp, δv, δθ (turn of
nav axes: C = exp([δθ]×)·Ĉ), δl. With the lever arm's sigma at 0 it is the plain 9-state filter of D1.
After Skog et al. (2010) and the OpenShoe step-wise cascade (Nilsson et al. 2012); REFERENCES.md for the gate
that inflates. The same equations stand as matrices in tests/support/foot_oracle.py.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.gap import doubt_gap
from pdr_engine.foot.memory import ATTITUDE, HEADING, LEVER, MASK, POSITION, STATES, VELOCITY
from pdr_engine.foot.quaternion import assign, from_rotation_vector, multiply, normalised, rotate
from pdr_engine.foot.strides import vertical

UPDATE_INTERVAL_S = 0.005  # the zero-velocity sigma is that of one update at this interval
# Errors of interpolated samples, as parts of the force (less gravity) and of the rate.
FILLED_FORCE, FILLED_RATE = 0.3, 0.05
REBUILT = 0.1  # sigma of what a rebuilt peak adds, as a part of it
PEAK_S = 0.1  # for so long it errs alike
WAY_M = 0.3  # a step much shorter than this has no direction, and a foot that rests has no way at all
BIAS_MEMORY_S = 1.0  # the bias's uncertainty adds up coherently over about a step


@compiled
def mechanise(s: Record, at: int, dt: float) -> None:
    """Carry the nominal state to sample ``at``, whose rate and force are means over the interval before it.

    Inertial units of this class integrate between their outputs; on the recorded sets this beats the trapezoid.
    """
    place = at & MASK
    x = (s.gyro[place, 0] - s.bias[0]) * dt
    y = (s.gyro[place, 1] - s.bias[1]) * dt
    z = (s.gyro[place, 2] - s.bias[2]) * dt
    middle = multiply(s.attitude, from_rotation_vector(0.5 * x, 0.5 * y, 0.5 * z))
    end = normalised(multiply(s.attitude, from_rotation_vector(x, y, z)))
    force = rotate(middle, s.accel[place, 0], s.accel[place, 1], s.accel[place, 2])
    for axis in range(3):
        s.force[axis] = force[axis]
        change = (force[axis] - (s.gravity if axis == 2 else 0.0)) * dt
        s.position[axis] += (s.velocity[axis] + 0.5 * change) * dt
        s.velocity[axis] += change
    assign(s.attitude, end)


@compiled
def _transport(P: Record, s: Record, dt: float, i: int, rows: bool) -> None:
    """Column i of F·P (``rows``), or row i of P·Fᵀ.

    F: δp += dt·δv − ½dt²·[f]×δθ and δv −= dt·[f]×δθ, with the specific force f in nav axes.
    """
    if rows:
        t0, t1, t2 = P[ATTITUDE, i], P[ATTITUDE + 1, i], P[ATTITUDE + 2, i]
    else:
        t0, t1, t2 = P[i, ATTITUDE], P[i, ATTITUDE + 1], P[i, ATTITUDE + 2]
    f0, f1, f2 = s.force[0] * dt, s.force[1] * dt, s.force[2] * dt
    dv = (f2 * t1 - f1 * t2, f0 * t2 - f2 * t0, f1 * t0 - f0 * t1)
    for axis in range(3):
        if rows:
            P[POSITION + axis, i] += dt * (P[VELOCITY + axis, i] + 0.5 * dv[axis])
            P[VELOCITY + axis, i] += dv[axis]
        else:
            P[i, POSITION + axis] += dt * (P[i, VELOCITY + axis] + 0.5 * dv[axis])
            P[i, VELOCITY + axis] += dv[axis]


@compiled
def propagate(s: Record, p: Record, at: int, dt: float, gap: bool) -> None:
    """P ← F·P·Fᵀ + Q over the interval that ends with sample ``at``."""
    P = s.P
    s.bias_variance += p.bias_walk**2 * dt
    for i in range(STATES):
        _transport(P, s, dt, i, True)
    for i in range(STATES):
        _transport(P, s, dt, i, False)
    velocity = (s.accel_noise**2 + (p.accel_scale * _shaking(s)) ** 2) * dt + _shock_variance(s, p, at)
    angle = (s.gyro_noise**2 + (p.gyro_scale * _turning(s, at)) ** 2 + s.bias_variance * BIAS_MEMORY_S) * dt
    if gap:
        doubt_gap(s, p, dt)
    if s.filled[at & MASK]:
        velocity += (FILLED_FORCE * _shaking(s) * dt) ** 2
        angle += (FILLED_RATE * _turning(s, at) * dt) ** 2
    for axis in range(3):
        P[VELOCITY + axis, VELOCITY + axis] += velocity
        P[ATTITUDE + axis, ATTITUDE + axis] += angle
        P[LEVER + axis, LEVER + axis] += p.lever_walk**2 * dt
        if s.clipped[at & MASK, axis]:
            rebuilt = REBUILT * s.rebuilt[at & MASK, axis]
            _doubt_cut(s, axis, (p.clip_noise**2 + rebuilt**2 * PEAK_S) * dt)
        if s.cut_force[at & MASK, axis]:
            _doubt_axis(s, VELOCITY, axis, (p.cut_force * dt) ** 2)


@compiled
def _shaking(s: Record) -> float:
    """Size of the specific force without gravity, m/s²."""
    return math.sqrt(s.force[0] ** 2 + s.force[1] ** 2 + (s.force[2] - s.gravity) ** 2)


@compiled
def _shock_variance(s: Record, p: Record, at: int) -> float:
    """Variance of the velocity, (m/s)², if the force's change since the last sample is off by ``accel_timing``."""
    square = 0.0
    for axis in range(3):
        square += (s.accel[at & MASK, axis] - s.accel[(at - 1) & MASK, axis]) ** 2
    variance: float = p.accel_timing**2 * square
    return variance


@compiled
def _turning(s: Record, at: int) -> float:
    """Size of the angular rate, rad/s."""
    square = 0.0
    for axis in range(3):
        square += (s.gyro[at & MASK, axis] - s.bias[axis]) ** 2
    return math.sqrt(square)


@compiled
def _doubt_axis(s: Record, block: int, axis: int, variance: float) -> None:
    """Add noise to a block of the state (attitude, velocity) along one sensor axis."""
    u = rotate(s.attitude, 1.0 * (axis == 0), 1.0 * (axis == 1), 1.0 * (axis == 2))
    for i in range(3):
        for j in range(3):
            s.P[block + i, block + j] += u[i] * u[j] * variance


@compiled
def _doubt_cut(s: Record, axis: int, variance: float) -> None:
    """A sample of a cut peak: its axis is doubted, and the step remembers how far, and how much of it is a turn."""
    _doubt_axis(s, ATTITUDE, axis, variance)
    s.cut_angle += variance
    s.cut_turn += vertical(s)[axis] ** 2 * variance


@compiled
def _measurement(s: Record, at: int) -> tuple[float, float, float]:
    """Innovation 0 − (v + C(ω×l)) and its Jacobian H = [0, I, −[C(ω×l)]×, C[ω]×] (into ``s.H``)."""
    H = s.H
    wx = s.gyro[at & MASK, 0] - s.bias[0]
    wy = s.gyro[at & MASK, 1] - s.bias[1]
    wz = s.gyro[at & MASK, 2] - s.bias[2]
    l0, l1, l2 = s.lever[0], s.lever[1], s.lever[2]
    u = rotate(s.attitude, wy * l2 - wz * l1, wz * l0 - wx * l2, wx * l1 - wy * l0)
    columns = (
        rotate(s.attitude, 0.0, wz, -wy),
        rotate(s.attitude, -wz, 0.0, wx),
        rotate(s.attitude, wy, -wx, 0.0),
    )
    for i in range(3):
        H[i, VELOCITY + i] = 1.0
        for j in range(3):
            H[i, LEVER + j] = columns[j][i]
    H[0, ATTITUDE + 1], H[0, ATTITUDE + 2], H[1, ATTITUDE + 2] = u[2], -u[1], u[0]
    H[1, ATTITUDE], H[2, ATTITUDE], H[2, ATTITUDE + 1] = -u[2], u[1], -u[0]
    return (-s.velocity[0] - u[0], -s.velocity[1] - u[1], -s.velocity[2] - u[2])


@compiled
def _expected_motion(s: Record, p: Record, at: int) -> tuple[float, float, float]:
    """Mean velocity of the sole, nav axes: along the way from the last step's end, and up; none without a way."""
    x, y = s.position[0] - s.step_position[0], s.position[1] - s.step_position[1]
    scale = p.learned_motion / math.sqrt(x * x + y * y + WAY_M**2)
    along, up = scale * s.motion[at & MASK, 0], scale * s.motion[at & MASK, 1]
    return along * x, along * y, up * math.sqrt(x * x + y * y)


@compiled
def _innovation_inverse(s: Record, variance: float) -> None:
    """P·Hᵀ into ``s.cross`` and the inverse of H·P·Hᵀ + variance·I into ``s.S``."""
    P, H, C, S = s.P, s.H, s.cross, s.S
    for i in range(STATES):
        for k in range(3):
            total = P[i, VELOCITY + k]
            for j in range(ATTITUDE, STATES):
                total += P[i, j] * H[k, j]
            C[i, k] = total
    for k in range(3):
        for m in range(3):
            total = C[VELOCITY + k, m]
            for j in range(ATTITUDE, STATES):
                total += H[k, j] * C[j, m]
            S[k, m] = total
        S[k, k] += variance
    _invert(S)


@compiled
def _invert(S: Record) -> None:
    """Invert a symmetric 3x3 matrix in place by its adjugate."""
    a, b, c = S[0, 0], 0.5 * (S[0, 1] + S[1, 0]), 0.5 * (S[0, 2] + S[2, 0])
    d, e, f = S[1, 1], 0.5 * (S[1, 2] + S[2, 1]), S[2, 2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1.0 / (a * A + b * B + c * C)
    S[0, 0], S[1, 1], S[2, 2] = A * scale, (a * f - c * c) * scale, (a * d - b * b) * scale
    S[0, 1] = S[1, 0] = B * scale
    S[0, 2] = S[2, 0] = C * scale
    S[1, 2] = S[2, 1] = (b * c - a * e) * scale


@compiled
def _stance_variance(s: Record, p: Record, at: int) -> float:
    """Variance of the sole's velocity in one update at `UPDATE_INTERVAL_S`, (m/s)²."""
    variance: float = p.velocity_sigma**2 + (p.learned_noise * s.sigma[at & MASK]) ** 2
    return variance


@compiled
def creep(s: Record, p: Record, at: int, dt: float) -> None:
    """What zero-velocity updates hide: the foot's place wanders by a velocity σ that lasts a while."""
    variance = s.sigma[at & MASK] ** 2 * p.hidden_motion * dt
    for axis in range(POSITION, POSITION + 3):
        s.P[axis, axis] += variance


@compiled
def zero_velocity(s: Record, p: Record, at: int, dt: float) -> None:
    """The sole stands: update with its velocity, 0 or what the learned detector expects.

    An innovation beyond ``gate`` sigmas inflates the measurement's noise (Huber's weight): S → (√NIS/gate)·S.
    The covariance stays symmetric by construction: P −= (P·Hᵀ)·S⁻¹·(P·Hᵀ)ᵀ, computed for one triangle.
    """
    still, mean = _measurement(s, at), _expected_motion(s, p, at)
    y = (still[0] + mean[0], still[1] + mean[1], still[2] + mean[2])
    _innovation_inverse(s, _stance_variance(s, p, at) * UPDATE_INTERVAL_S / dt)
    P, C, K, S = s.P, s.cross, s.gain, s.S
    nis = 0.0
    for k in range(3):
        nis += y[k] * (S[k, 0] * y[0] + S[k, 1] * y[1] + S[k, 2] * y[2])
    s.nis = nis
    trust = min(1.0, p.gate / math.sqrt(max(nis, 1e-12)))
    for i in range(STATES):
        for k in range(3):
            K[i, k] = trust * (C[i, 0] * S[0, k] + C[i, 1] * S[1, k] + C[i, 2] * S[2, k])
    for i in range(STATES):
        for j in range(i, STATES):
            P[i, j] -= K[i, 0] * C[j, 0] + K[i, 1] * C[j, 1] + K[i, 2] * C[j, 2]
            P[j, i] = P[i, j]
    _inject(s, y)


@compiled
def _inject(s: Record, y: tuple[float, float, float]) -> None:
    """Move the error K·y into the nominal state."""
    K = s.gain
    turn = from_rotation_vector(
        K[ATTITUDE, 0] * y[0] + K[ATTITUDE, 1] * y[1] + K[ATTITUDE, 2] * y[2],
        K[ATTITUDE + 1, 0] * y[0] + K[ATTITUDE + 1, 1] * y[1] + K[ATTITUDE + 1, 2] * y[2],
        K[ATTITUDE + 2, 0] * y[0] + K[ATTITUDE + 2, 1] * y[1] + K[ATTITUDE + 2, 2] * y[2],
    )
    for axis in range(3):
        for k in range(3):
            s.position[axis] += K[POSITION + axis, k] * y[k]
            s.velocity[axis] += K[VELOCITY + axis, k] * y[k]
            s.lever[axis] += K[LEVER + axis, k] * y[k]
    assign(s.attitude, normalised(multiply(turn, s.attitude)))


@compiled
def forget_place(s: Record) -> None:
    """Step-wise reset: the step handed over carries the doubt about place and heading, what follows starts anew."""
    for j in range(STATES):
        for i in range(POSITION, POSITION + 3):
            s.P[i, j] = s.P[j, i] = 0.0
        s.P[HEADING, j] = s.P[j, HEADING] = 0.0
