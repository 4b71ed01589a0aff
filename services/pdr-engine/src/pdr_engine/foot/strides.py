"""What a stride is like: how high the foot passes, how far it tilts, how it lands and rests.

Every sample is taken note of, every step gets its figures. A swing's places are kept until the updates at its end
are known: what these correct has grown on the way, so the correction is spread over the swing in proportion to the
time since the foot was lifted.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import GAP_NS, MASK, RING, STANCE_END_NS
from pdr_engine.foot.quaternion import Vector, assign

VERTICAL_M = 0.05  # a shorter way across the ground gives no line that a foot could pass above


@compiled
def follow(s: Record, at: int) -> None:
    """Take note of sample ``at``, which the filter has used; ``s.predicted`` is the place before its update."""
    place = at & MASK
    if s.still[place]:
        for axis in range(3):
            s.correction[axis] += s.position[axis] - s.predicted[axis]
        _rest(s, at)
        return
    if s.landed != at - 1 or s.lifted > s.landed:
        _lift(s, at)
    s.landed = at
    _keep_place(s, place)
    _tilt_away(s)
    rate = force = 0.0
    for axis in range(3):
        rate += s.gyro[place, axis] ** 2
        force += s.accel[place, axis] ** 2
    s.peak_rate, s.peak_force = max(s.peak_rate, rate), max(s.peak_force, force)


@compiled
def _keep_place(s: Record, place: int) -> None:
    """Keep the foot's place."""
    for axis in range(3):
        s.flight[place, axis] = s.position[axis]


@compiled
def vertical(s: Record) -> Vector:
    """The vertical in sensor axes: the last row of the attitude's matrix."""
    w, x, y, z = s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]
    return (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))


@compiled
def angle_between(cosine: float) -> float:
    """The angle whose cosine this is, rounding forgiven, rad."""
    return math.acos(min(1.0, max(-1.0, cosine)))


@compiled
def dot(a: Record, b: Record) -> float:
    """Scalar product of two vectors of three."""
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@compiled
def _rest(s: Record, at: int) -> None:
    """Keep the books of the stance; one that was lifted for longer than a detector's slip is a new one.

    So is one behind a gap, but not the next sample of a slow sensor.
    """
    now_ns = s.time_ns[at & MASK]
    away_ns = now_ns - s.rest_until_ns
    lifted = s.lifted <= s.landed == at - 1
    if away_ns > (STANCE_END_NS if lifted or at == s.start else GAP_NS):
        s.rest_since_ns = now_ns
        s.worst_nis = 0.0
        assign(s.up, (0.0, 0.0, 0.0))
    s.rest_until_ns = now_ns
    s.worst_nis = max(s.worst_nis, s.nis)
    up = vertical(s)
    for axis in range(3):
        s.up[axis] += up[axis]


@compiled
def _lift(s: Record, at: int) -> None:
    """A swing begins with sample ``at``; what the stance before it corrected belongs to the swing before that."""
    if s.lifted > s.landed:
        s.swing = at
        assign(s.rest_up, vertical(s))
        s.steep_cosine = 2.0
    else:
        _spread(s)
    assign(s.correction, (0.0, 0.0, 0.0))
    s.lifted = at


@compiled
def _tilt_away(s: Record) -> None:
    """Note the attitude farthest from the one the foot was lifted with."""
    up = vertical(s)
    cosine = dot(up, s.rest_up)
    if cosine < s.steep_cosine:
        s.steep_cosine = cosine
        assign(s.steep_up, up)


@compiled
def _spread(s: Record) -> None:
    """Correct the newest swing's places by what the stance after it has found."""
    span = s.landed - s.lifted + 1
    for k in range(max(s.lifted, s.head - RING), s.landed + 1):
        for axis in range(3):
            s.flight[k & MASK, axis] += s.correction[axis] * (k - s.lifted + 1) / span
    assign(s.correction, (0.0, 0.0, 0.0))


@compiled
def clearance(s: Record) -> float:
    """Largest height of the step's swing above the line from stance to stance, m; 0 if the foot was not lifted.

    Where the line is vertical, the height above the higher stance.
    """
    if s.lifted > s.landed:
        return 0.0
    _spread(s)
    x, y = s.position[0] - s.step_position[0], s.position[1] - s.step_position[1]
    z = s.position[2] - s.step_position[2]
    square = x * x + y * y
    highest = 0.0
    for k in range(max(s.swing, s.head - RING), s.landed + 1):
        place = k & MASK
        if s.still[place]:
            continue
        along = (s.flight[place, 0] - s.step_position[0]) * x + (s.flight[place, 1] - s.step_position[1]) * y
        line = z * min(1.0, max(0.0, along / square)) if square > VERTICAL_M**2 else max(0.0, z)
        highest = max(highest, s.flight[place, 2] - s.step_position[2] - line)
    return highest


@compiled
def describe_stride(s: Record, row: Record) -> None:
    """The running step's figures into its row of STEP."""
    row.stance_ns = s.rest_until_ns - s.rest_since_ns
    row.nis = s.worst_nis
    row.clearance_m = clearance(s)
    row.pitch_rad = angle_between(s.steep_cosine)
    row.peak_rate_rad_s = math.sqrt(s.peak_rate)
    row.cut_rad = math.sqrt(s.cut_angle)
    row.cut_turn_rad = math.sqrt(s.cut_turn)
    row.peak_force_m_s2 = math.sqrt(s.peak_force)


@compiled
def begin_alignment(s: Record, at: int) -> None:
    """The filter begins (anew) with sample ``at``: whatever stance it is in begins with it."""
    s.rest_until_ns = s.time_ns[at & MASK] - STANCE_END_NS - 1
    begin_stride(s, at - 1)


@compiled
def begin_stride(s: Record, at: int) -> None:
    """A new step begins behind sample ``at``: nothing is lifted yet."""
    s.swing = s.lifted = at + 1
    s.landed = at
    s.steep_cosine = 2.0
    s.peak_rate = s.peak_force = s.worst_nis = s.cut_angle = s.cut_turn = 0.0
    assign(s.correction, (0.0, 0.0, 0.0))
