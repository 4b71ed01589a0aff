"""What the learned stance detector looks at: energies of force and rate in windows around a sample.

Windows reach from a second before the sample to 40 ms after it. Running sums over the cleaned samples make each
window a difference of two rows, whatever its length. Energies count as logarithms; forces without gravity as in
SHOE. Two features compare mean forces at two times, turned with the rate between them: of a foot at rest, or one
that slides at constant speed, nothing is left.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import FEATURES, MASK, NS, RING

WINDOW_HALF_S = 0.01
AHEAD_S = 0.03  # centre of the latest window
NEAR_S, PAST_S, STRIDE_S = 0.04, 0.10, 0.5  # half lengths
FORCE_FLOOR, RATE_FLOOR, TURN_FLOOR = 3e-3, 1e-4, 1e-3  # of the logarithms: (m/s²)², (rad/s)², (m/s²)²
LOAD_M_S2 = 3.0
SWING_FORCE, SWING_RATE = 100.0, 4.0  # energies: (10 m/s²)², (2 rad/s)²
SHORTEST_S = 1e-4
MEMORY = 1e-2  # of the running mean of the sampling interval
REACH = RING - 64

Mean = tuple[float, float, float, float, float, float, float, float, float]


@compiled
def accumulate(s: Record, at: int) -> None:
    """Extend the running sums (force 3, |force|², rate 3, |rate|²) and the mean interval by sample ``at``."""
    here, before = at & MASK, (at - 1) & MASK
    if at == s.start:
        for k in range(8):
            s.sums[before, k] = 0.0
    elif at > s.unbroken:
        interval = (s.time_ns[here] - s.time_ns[before]) * NS
        s.interval_s = interval if s.interval_s == 0.0 else s.interval_s + MEMORY * (interval - s.interval_s)
        s.rate_hz = 1.0 / max(s.interval_s, SHORTEST_S)
    force = rate = 0.0
    for axis in range(3):
        f, w = s.accel[here, axis], s.gyro[here, axis]
        s.sums[here, axis] = s.sums[before, axis] + f
        s.sums[here, 4 + axis] = s.sums[before, 4 + axis] + w
        force, rate = force + f * f, rate + w * w
    s.sums[here, 3] = s.sums[before, 3] + force
    s.sums[here, 7] = s.sums[before, 7] + rate


@compiled
def _window(s: Record, at: int, centre_s: float, half_s: float) -> Mean:
    """Mean over a window about ``at``: force energy, rate energy, |mean force|, mean force, mean rate."""
    rate_hz = s.rate_hz
    centre = at + math.floor(centre_s * rate_hz + 0.5)
    half = max(1, math.floor(half_s * rate_hz + 0.5))
    oldest, newest = max(s.start, s.clean - REACH), s.clean - 1
    if at < s.unbroken:  # a gap lies ahead: what comes behind it tells nothing of this sample
        newest = min(newest, s.unbroken - 1)
    else:
        oldest = max(oldest, s.unbroken)
    lo = min(max(centre - half, oldest), newest)
    hi = min(max(centre + half, oldest), newest)
    a, b, scale = (lo - 1) & MASK, hi & MASK, 1.0 / (hi - lo + 1)
    fx, fy, fz = (
        (s.sums[b, 0] - s.sums[a, 0]) * scale,
        (s.sums[b, 1] - s.sums[a, 1]) * scale,
        (s.sums[b, 2] - s.sums[a, 2]) * scale,
    )
    wx, wy, wz = (
        (s.sums[b, 4] - s.sums[a, 4]) * scale,
        (s.sums[b, 5] - s.sums[a, 5]) * scale,
        (s.sums[b, 6] - s.sums[a, 6]) * scale,
    )
    bx, by, bz = s.bias[0], s.bias[1], s.bias[2]
    length = math.sqrt(fx * fx + fy * fy + fz * fz)
    gravity = s.gravity
    force = max(0.0, (s.sums[b, 3] - s.sums[a, 3]) * scale - 2.0 * gravity * length + gravity * gravity)
    rate = (s.sums[b, 7] - s.sums[a, 7]) * scale + bx * bx + by * by + bz * bz
    rate = max(0.0, rate - 2.0 * (wx * bx + wy * by + wz * bz))
    return force, rate, length, fx, fy, fz, wx - bx, wy - by, wz - bz


@compiled
def _put(s: Record, first: int, mean: Mean) -> None:
    s.features[first] = math.log(mean[0] + FORCE_FLOOR)
    s.features[first + 1] = math.log(mean[1] + RATE_FLOOR)


@compiled
def _load(s: Record, mean: Mean) -> float:
    """How much more than gravity presses on the sole, bounded."""
    x: float = (mean[2] - s.gravity) / LOAD_M_S2
    return x / math.sqrt(1.0 + x * x)


@compiled
def _unturned(a: Mean, b: Mean, turn: Mean, span_s: float) -> float:
    """Log of |f_b − f_a + ω̄ × f̄·T|²: the change of force that turning does not explain."""
    x, y, z = 0.5 * (a[3] + b[3]), 0.5 * (a[4] + b[4]), 0.5 * (a[5] + b[5])
    u, v, w = turn[6] * span_s, turn[7] * span_s, turn[8] * span_s
    dx = b[3] - a[3] + v * z - w * y
    dy = b[4] - a[4] + w * x - u * z
    dz = b[5] - a[5] + u * y - v * x
    return math.log(dx * dx + dy * dy + dz * dz + TURN_FLOOR)


@compiled
def swings(s: Record, at: int) -> bool:
    """Whether the foot is beyond doubt in the air: no stance on record, running or not, comes near these."""
    now = _window(s, at, 0.0, WINDOW_HALF_S)
    return now[0] > SWING_FORCE or now[1] > SWING_RATE


@compiled
def describe(s: Record, at: int) -> None:
    """Write the features of sample ``at``; what comes within 40 ms after it must be clean."""
    now = _window(s, at, 0.0, WINDOW_HALF_S)
    before, after = _window(s, at, -AHEAD_S, WINDOW_HALF_S), _window(s, at, AHEAD_S, WINDOW_HALF_S)
    near, past = _window(s, at, 0.0, NEAR_S), _window(s, at, -0.15, PAST_S)
    _put(s, 0, now)
    _put(s, 2, before)
    _put(s, 4, after)
    _put(s, 6, near)
    _put(s, 8, past)
    _put(s, 10, _window(s, at, -0.5, STRIDE_S))
    _put(s, 12, _window(s, at, -0.08, 0.02))
    _put(s, 14, _window(s, at, -0.35, 0.05))
    s.features[16] = _load(s, now)
    s.features[17] = _load(s, near)
    s.features[18] = _unturned(before, after, near, 2.0 * AHEAD_S)
    s.features[19] = _unturned(past, near, past, 0.15)


assert FEATURES == 20
