"""From raw samples to clean ones: refuse what cannot be, and rebuild the gyro's clipped peaks.

The rings of the state hold the samples. A gyro that saturates cuts the peak of the swing off; the angle lost
there tilts the whole step. The cut peak is rebuilt as a cubic Hermite curve between its two flanks if both are
known within the look-ahead, and the axis is marked as doubtful while it lasts.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import GAP_NS, LONG_GAP_NS, MASK

CLOCK_PATIENCE = 100  # samples
DROPPED, ACCEPTED, AFTER_LONG_GAP = 0, 1, 2
FLAT = 0.005  # neighbours on a plateau differ by less than this part of their value
SHOULDER = 0.03  # a plateau's rounded ends lie within this part of it


@compiled
def judge(s: Record, sample: Record) -> int:
    """Whether a sample can be used: finite, and later than the one before.

    Where nothing but earlier stamps comes, the last good one was wrong, or the sensor's clock has been set back:
    after a while that counts as a gap, or one wild stamp would deafen the foot for good.
    """
    total = 0.0
    for axis in range(3):
        total += sample.accel[axis] + sample.gyro[axis]
    if not math.isfinite(total):
        return DROPPED
    if s.head == 0:
        return ACCEPTED
    step_ns = sample.time_ns - s.time_ns[(s.head - 1) & MASK]
    if step_ns <= 0 and s.dropped_in_a_row < CLOCK_PATIENCE:
        return DROPPED
    if step_ns <= 0:
        return AFTER_LONG_GAP
    return AFTER_LONG_GAP if step_ns > LONG_GAP_NS else ACCEPTED


@compiled
def push(s: Record, sample: Record) -> None:
    """Append an accepted sample to the rings."""
    place = s.head & MASK
    if s.head > s.start and sample.time_ns - s.time_ns[(s.head - 1) & MASK] > GAP_NS:
        s.gaps += 1
        s.unbroken = s.head
    s.time_ns[place] = sample.time_ns
    for axis in range(3):
        s.accel[place, axis] = sample.accel[axis]
        s.gyro[place, axis] = sample.gyro[axis]
        s.mag[place, axis] = sample.mag[axis]
        s.clipped[place, axis] = 0
    s.still[place] = 0
    s.dropped_in_a_row = 0
    s.head += 1
    s.accepted += 1


@compiled
def _plateau_level(s: Record, at: int, axis: int, clip_rate: float) -> float:
    """The height (signed) of the clipped plateau that sample ``at`` belongs to; 0 if it belongs to none."""
    value = s.gyro[at & MASK, axis]
    if abs(value) < clip_rate:
        return 0.0
    for k in range(at, s.head - 2):
        a, b, c = s.gyro[k & MASK, axis], s.gyro[(k + 1) & MASK, axis], s.gyro[(k + 2) & MASK, axis]
        if abs(b - a) < FLAT * abs(b) and abs(c - b) < FLAT * abs(b):
            return b if abs(b - value) < SHOULDER * abs(b) else 0.0
        if abs(a - value) > SHOULDER * abs(a):
            return 0.0
    return 0.0


@compiled
def _rebuild(s: Record, first: int, end: int, axis: int) -> None:
    """Replace samples ``first`` .. ``end``−1 of one axis by a cubic Hermite curve between their flanks."""
    left, right = first - 1, end
    t0, t1 = s.time_ns[left & MASK], s.time_ns[right & MASK]
    w0, w1 = s.gyro[left & MASK, axis], s.gyro[right & MASK, axis]
    span = float(t1 - t0)
    slope0 = (w0 - s.gyro[(left - 1) & MASK, axis]) / (t0 - s.time_ns[(left - 1) & MASK]) * span
    slope1 = (s.gyro[(right + 1) & MASK, axis] - w1) / (s.time_ns[(right + 1) & MASK] - t1) * span
    for k in range(first, end):
        u = (s.time_ns[k & MASK] - t0) / span
        v = 1.0 - u
        curve = (
            w0 * v * v * (1.0 + 2.0 * u) + w1 * u * u * (3.0 - 2.0 * u) + u * v * (slope0 * v - slope1 * u)
        )
        if abs(curve) > abs(s.gyro[k & MASK, axis]):
            s.gyro[k & MASK, axis] = curve


@compiled
def _mend_axis(s: Record, at: int, axis: int, clip_rate: float) -> None:
    """If a clipped plateau begins at sample ``at``, mark it as far as it is known; rebuild it if its end is."""
    level = _plateau_level(s, at, axis, clip_rate)
    if level == 0.0:
        return
    end = at
    while end < s.head and abs(s.gyro[end & MASK, axis] - level) < SHOULDER * abs(level):
        s.clipped[end & MASK, axis] = 1
        end += 1
    fresh = at == s.unbroken or s.clipped[(at - 1) & MASK, axis] == 0
    if fresh:
        s.clippings += 1
    if fresh and at >= s.unbroken + 2 and end + 1 < s.head:
        _rebuild(s, at, end, axis)


@compiled
def mend(s: Record, p: Record, at: int) -> None:
    """Make sample ``at`` final: rebuild clipped peaks that begin with it."""
    for axis in range(3):
        if s.clipped[at & MASK, axis] == 0:
            _mend_axis(s, at, axis, p.clip_rate)
