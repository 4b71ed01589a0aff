"""Saturated sensors: the gyro's cut peaks are rebuilt, the accelerometer's are doubted.

A gyro that saturates cuts the peak of the swing off; the angle lost there tilts the whole step. A cut peak is a
plateau whose flanks point higher than it reaches; it is rebuilt as a cubic Hermite curve between them. A runner's
gyro of 500 °/s stands at its limit for more than 100 ms, longer than anything may wait: until the far flank comes,
the least is taken (that the plateau ends now and falls as it has risen), and what was missing then comes late.
"""

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import MASK

FLAT = 0.005  # values on a plateau differ by less than this part of them
SHOULDER = 0.03  # a plateau's rounded ends lie within this part of it
APART_NS = 4_000_000  # values that are compared lie at least this far apart, whatever the rate
RISE = 0.02  # a peak is cut off if its flanks point this part above it
# No flank lifts a peak by more than this part, and the nearer to it the less: in the mean of some 16 000 recorded
# peaks that were cut off afterwards.
HIGHEST, BEND = 0.8, 1.5
SAME = 0.003  # forces within this part of the largest are as high
HITS = 4  # so many of them are a limit

Flanks = tuple[int, float, float, int, float, float]  # ns, rad/s and rad/s/ns: left, then right


@compiled
def _before(s: Record, at: int) -> int:
    """The newest sample at least `APART_NS` before ``at`` (at low rates the one before); −1 if there is none."""
    k = at - 1
    while k >= s.unbroken and s.time_ns[at & MASK] - s.time_ns[k & MASK] < APART_NS:
        k -= 1
    return k if k >= s.unbroken else -1


@compiled
def _after(s: Record, at: int) -> int:
    """The first sample at least `APART_NS` after ``at``; −1 if it is not known yet."""
    k = at + 1
    while k < s.head and s.time_ns[k & MASK] - s.time_ns[at & MASK] < APART_NS:
        k += 1
    return k if k < s.head else -1


@compiled
def _plateau_level(s: Record, at: int, axis: int, clip_rate: float) -> float:
    """The height (signed) of the plateau that begins with sample ``at``; 0 if none does."""
    value = s.gyro[at & MASK, axis]
    if abs(value) < clip_rate:
        return 0.0
    for k in range(at, s.head):
        middle = _after(s, k)
        last = _after(s, middle) if middle >= 0 else -1
        if last < 0:
            return 0.0
        a, b, c = s.gyro[k & MASK, axis], s.gyro[middle & MASK, axis], s.gyro[last & MASK, axis]
        if abs(b - a) < FLAT * abs(b) and abs(c - b) < FLAT * abs(b):
            return b if abs(b - value) < SHOULDER * abs(b) else 0.0
        if abs(a - value) > SHOULDER * abs(a):
            return 0.0
    return 0.0


@compiled
def _plateau_end(s: Record, at: int, axis: int) -> int:
    """The first sample from ``at`` on that does not lie on the axis's plateau, as far as is known."""
    level, end = s.cut_level[axis], at
    while end < s.head and abs(s.gyro[end & MASK, axis] - level) < SHOULDER * abs(level):
        end += 1
    return end


@compiled
def _slope(s: Record, first: int, second: int, axis: int) -> float:
    """Change of the rate from one sample to another, a nanosecond."""
    change = s.gyro[second & MASK, axis] - s.gyro[first & MASK, axis]
    return float(change / (s.time_ns[second & MASK] - s.time_ns[first & MASK]))


@compiled
def _flanks(s: Record, first: int, end: int, axis: int) -> Flanks:
    """The flanks of the plateau ``first`` .. ``end``−1; the right one mirrored where it has not come yet."""
    left = first - 1
    t0, w0 = s.time_ns[left & MASK], s.gyro[left & MASK, axis]
    rise = _slope(s, _before(s, left), left, axis)
    after = _after(s, end) if end < s.head else -1
    if after < 0:
        return t0, w0, rise, s.time_ns[(s.head - 1) & MASK], w0, -rise
    return t0, w0, rise, s.time_ns[end & MASK], s.gyro[end & MASK, axis], _slope(s, end, after, axis)


@compiled
def _curve(flanks: Flanks, time_ns: int) -> float:
    """The cubic Hermite curve between the flanks."""
    t0, w0, slope0, t1, w1, slope1 = flanks
    span = float(t1 - t0)
    u = (time_ns - t0) / span
    v = 1.0 - u
    bow = u * v * span * (slope0 * v - slope1 * u)
    return w0 * v * v * (1.0 + 2.0 * u) + w1 * u * u * (3.0 - 2.0 * u) + bow


@compiled
def _height(flanks: Flanks, level: float) -> float:
    """How far the middle of the curve lies above the plateau, as a part of its level."""
    return _curve(flanks, (flanks[0] + flanks[3]) // 2) / level - 1.0


@compiled
def _tamed(flanks: Flanks, level: float) -> Flanks:
    """The flanks, less steep the higher they point: peaks are rounder than flanks promise.

    A promised rise by ``h`` of the level becomes ``h/(1 + (h/HIGHEST)^BEND)^(1/BEND)`` of it: small ones stay, and
    none is higher than ``HIGHEST``.
    """
    rise = max(_height(flanks, level), 0.0)
    scale = (1.0 + (rise / HIGHEST) ** BEND) ** (-1.0 / BEND)
    return flanks[0], flanks[1], scale * flanks[2], flanks[3], flanks[4], scale * flanks[5]


@compiled
def _risen(s: Record, flanks: Flanks, at: int, axis: int) -> float:
    """The curve, where it is higher than what is there."""
    value, curve = s.gyro[at & MASK, axis], _curve(flanks, s.time_ns[at & MASK])
    return float(curve if abs(curve) > abs(value) else value)


@compiled
def _rebuild(s: Record, flanks: Flanks, first: int, end: int, axis: int) -> None:
    """Lift the samples ``first`` .. ``end``−1 that the filter has not used to the curve between the flanks.

    The angle that was missing from those it has used is spread over the others.
    """
    late, fresh = 0.0, max(first, s.done)
    for k in range(first, fresh):
        dt = s.time_ns[k & MASK] - s.time_ns[(k - 1) & MASK]
        late += (_risen(s, flanks, k, axis) - s.gyro[k & MASK, axis]) * dt
    span = s.time_ns[(end - 1) & MASK] - s.time_ns[(fresh - 1) & MASK]
    for k in range(fresh, end):
        _lift(s, k, axis, _risen(s, flanks, k, axis) + (late / span if fresh > first else 0.0))


@compiled
def _lift(s: Record, at: int, axis: int, rate: float) -> None:
    """Put a sample of a cut peak where it seems to belong, and remember by how much."""
    s.rebuilt[at & MASK, axis] += abs(rate - s.gyro[at & MASK, axis])
    s.gyro[at & MASK, axis] = rate


@compiled
def _open_plateau(s: Record, at: int, axis: int, clip_rate: float) -> None:
    """If a cut plateau begins with sample ``at``, remember it."""
    level = _plateau_level(s, at, axis, clip_rate)
    if level == 0.0:
        return
    s.cut_level[axis], s.cut_first[axis] = level, at
    if _flanked(s, axis) and _height(_flanks(s, at, _plateau_end(s, at, axis), axis), level) < RISE:
        s.cut_level[axis] = 0.0
        return
    s.clippings += 1


@compiled
def _flanked(s: Record, axis: int) -> bool:
    """Whether the plateau's left flank is known: not where it begins with the stream or with a gap's end."""
    left: int = s.cut_first[axis] - 1
    return left >= s.unbroken and _before(s, left) >= 0


@compiled
def _mend_axis(s: Record, at: int, axis: int) -> None:
    """Sample ``at`` lies on an open plateau, or right behind it: mark and rebuild what is known of it."""
    end = _plateau_end(s, at, axis)
    for k in range(at, end):
        s.clipped[k & MASK, axis] = 1
    ended = end < s.head and _after(s, end) >= 0
    if _flanked(s, axis):
        first: int = s.cut_first[axis]
        flanks = _tamed(_flanks(s, first, end, axis), s.cut_level[axis])
        if ended:
            _rebuild(s, flanks, first, end, axis)
        elif end > at:
            _lift(s, at, axis, _risen(s, flanks, at, axis))
    if ended or end == at:
        s.cut_level[axis] = 0.0


@compiled
def mend(s: Record, p: Record, at: int) -> None:
    """Make sample ``at`` final: rebuild the gyro's cut peaks that begin or go on with it."""
    for axis in range(3):
        if at == s.unbroken:
            s.cut_level[axis] = 0.0
        if s.cut_level[axis] == 0.0 and s.clipped[at & MASK, axis] == 0:
            _open_plateau(s, at, axis, p.clip_rate)
        if s.cut_level[axis] != 0.0:
            _mend_axis(s, at, axis)


@compiled
def watch_force(s: Record, p: Record, at: int) -> None:
    """Mark the axes of sample ``at`` on which the accelerometer is at its limit.

    Shocks are too short for plateaus, and the range is not known: a limit shows where the largest values of an axis
    are the same again and again, as natural ones never are.
    """
    for axis in range(3):
        force = s.accel[at & MASK, axis]
        if abs(force) < p.clip_force:
            continue
        side = 0 if force > 0.0 else 1
        top = s.force_top[axis, side]
        if abs(force) < (1.0 - SAME) * top:
            continue
        s.force_hits[axis, side] = 1 + (s.force_hits[axis, side] if abs(force) < (1.0 + SAME) * top else 0)
        s.force_top[axis, side] = max(top, abs(force))
        if s.force_hits[axis, side] >= HITS:
            s.cut_force[at & MASK, axis] = 1
            s.force_clippings += 1
