"""Stance detectors: a statistic of a short window against a threshold; below it, the whole window is stance.

The default is another, `learned`; these are for comparison and for who wants them.

``adaptive``            SHOE whose threshold grows with the time since the last stance, so that a stride never
                        passes without one (REFERENCES.md)
``shoe``                generalised likelihood ratio of "still" (Skog et al. 2010), fixed threshold
``gyro``                D2: RMS of the angular rate (Rantakokko et al., FOI)
``ared``                angular rate energy
``differential``        C1: sliding-window sum of |Δa|, small for more than a number of samples in a row
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import MASK, NS
from pdr_engine.foot.parameters import ADAPTIVE, ARED, DIFFERENTIAL, GYRO

WINDOW_SAMPLES = 3  # at low rates a window is at least this many samples
NEVER = 1e9


@compiled
def window_start(s: Record, last: int, window_ns: int) -> int:
    """First sample of the window that ends with sample ``last``; −1 if a gap or the start cuts it short."""
    first = last
    end_ns = s.time_ns[last & MASK]
    while first > s.unbroken and first > s.start:
        before_ns = end_ns - s.time_ns[(first - 1) & MASK]
        if before_ns >= window_ns and last - first + 1 >= WINDOW_SAMPLES:
            return first
        first -= 1
    long_enough = last - first + 1 >= WINDOW_SAMPLES and 2 * (end_ns - s.time_ns[first & MASK]) >= window_ns
    return first if long_enough else -1


@compiled
def angular_energy(s: Record, first: int, last: int) -> float:
    """Mean of |ω − bias|² over the window, rad²/s²."""
    total = 0.0
    for k in range(first, last + 1):
        for axis in range(3):
            total += (s.gyro[k & MASK, axis] - s.bias[axis]) ** 2
    return total / (last - first + 1)


@compiled
def force_energy(s: Record, first: int, last: int) -> float:
    """Mean of |a − g·ā/|ā||² over the window, m²/s⁴: what gravity alone does not explain."""
    count = last - first + 1
    x = y = z = squares = 0.0
    for k in range(first, last + 1):
        ax, ay, az = s.accel[k & MASK, 0], s.accel[k & MASK, 1], s.accel[k & MASK, 2]
        x, y, z = x + ax, y + ay, z + az
        squares += ax * ax + ay * ay + az * az
    mean = math.sqrt(x * x + y * y + z * z) / count
    gravity: float = s.gravity
    return max(0.0, squares / count - 2.0 * gravity * mean + gravity * gravity)


@compiled
def _variation(s: Record, first: int, last: int) -> float:
    """Sliding-window sum Σ|Δa|, m/s² (seeds/002: SWS)."""
    total = 0.0
    for k in range(first + 1, last + 1):
        square = 0.0
        for axis in range(3):
            square += (s.accel[k & MASK, axis] - s.accel[(k - 1) & MASK, axis]) ** 2
        total += math.sqrt(square)
    return total


@compiled
def _statistic(s: Record, p: Record, first: int, last: int) -> float:
    """The method's statistic over the window."""
    if p.method == GYRO:
        return angular_energy(s, first, last)
    if p.method == DIFFERENTIAL:
        return _variation(s, first, last)
    accel_weight: float = p.accel_weight if p.method != ARED else 0.0
    gyro_weight: float = p.gyro_weight
    return force_energy(s, first, last) * accel_weight + angular_energy(s, first, last) * gyro_weight


@compiled
def _threshold(s: Record, p: Record, first: int) -> float:
    """The method's threshold for the window that begins with sample ``first``."""
    threshold: float = p.threshold
    if p.method != ADAPTIVE:
        return threshold
    since_s = (s.time_ns[first & MASK] - s.last_still_ns) * NS
    return threshold * math.exp(min(20.0, p.growth_rate * max(0.0, since_s - p.growth_hold)))


@compiled
def _calm_long_enough(s: Record, p: Record, now_ns: int, doubt: float) -> bool:
    """C1's second condition: the sum has been small for more than num_SP samples (as a time)."""
    if doubt >= 1.0:
        s.calm_since_ns = now_ns
    calm_ns: int = now_ns - s.calm_since_ns
    return calm_ns >= int(p.calm_hold_ns)


@compiled
def detect(s: Record, p: Record, last: int) -> None:
    """Look at the window that ends with sample ``last`` and mark it as stance if it is."""
    place = last & MASK
    first = window_start(s, last, p.window_ns)
    doubt = NEVER if first < 0 else _statistic(s, p, first, last) / _threshold(s, p, first)
    s.doubt[place] = doubt
    stance = doubt < 1.0
    if p.method == DIFFERENTIAL:
        stance = _calm_long_enough(s, p, s.time_ns[place], doubt) and stance
    if stance:
        for k in range(max(first, s.done), last + 1):
            s.still[k & MASK] = 1
            s.doubt[k & MASK] = min(s.doubt[k & MASK], doubt)
        s.last_still_ns = s.time_ns[place]
