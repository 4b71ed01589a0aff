"""The magnetometer at stand-still: a small outer filter that holds the heading (METHODS D3).

Once a stance the mean field, calibrated and turned into nav axes by the filter's attitude, is judged and, if the
surroundings deserve it, used. Error state of 6: ψ the heading's error (estimate − truth, rad); c the rate at which
it grows in walking beyond the gyro bias (rad/s); m the horizontal earth field in nav axes (µT); h what the sensor's
own iron adds horizontally, in the axes of a foot of yaw 0 (µT). Measurement z = m + ψ·Jm + R(yaw)·h + disturbance,
J = [[0, −1], [1, 0]]. m is learnt at the start of trust: nobody here needs to know where north is.

**How much a field is worth** is told by what does not depend on the heading: how far its horizontal and vertical
strength wander from place to place is taken for the disturbance σ of each of its components. Where that is large,
as it is above the steel of a floor, nothing is used. Neighbouring places err alike (first-order Gauss-Markov over
the distance): the noise is inflated by (1 + ρ)/(1 − ρ), and standing at one place teaches nothing.

**What becomes of it.** The heading error found is turned out of the filter, so that it is part of the step's
heading change; the step's covariance stays the gyro's own. The magnetometer bounds the *sum* of many steps' errors,
which no step that is independent of the one before can tell: the sum is then better than it says, never worse.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import (
    AID_DRIFT,
    AID_FIELD,
    AID_IRON,
    AID_PSI,
    AID_STATES,
    ATTITUDE,
    HEADING,
    MASK,
    NS,
    STANDING_SWING_NS,
)
from pdr_engine.foot.quaternion import (
    assign,
    from_rotation_vector,
    multiply,
    normalised,
    rotate,
    twist,
    wrapped,
)

LEAST_UT, MOST_UT = 1.0, 500.0  # beyond these it is no field, but a sensor that is absent or overdriven
LEAST_SAMPLES = 3
HUNG = 1e-9  # a living sensor has noise: the same strength to this part in two stances is a hung one's
PRIOR_PLACES = 3.0  # how many places the disturbance assumed at first counts
PLACES = 15.0  # how many places are remembered
NEW_PLACE_M = 0.3
LEAST_HORIZONTAL_UT = 5.0
LOST_RAD = 0.5  # an error beyond this is no small one any more: the reference is learnt anew
MOST_AZIMUTH_RAD = 0.3  # an azimuth less sure than this is not told
UNKNOWN = math.nan


@compiled
def begin_field(s: Record) -> None:
    """A stance begins, or goes on after a hand-over: nothing gathered yet."""
    assign(s.field_sum, (0.0, 0.0, 0.0))
    s.field_square = 0.0
    s.field_samples = 0


@compiled
def gather_field(s: Record, p: Record, at: int) -> None:
    """Add a standing sample's field, calibrated, in nav axes."""
    place = at & MASK
    x, y, z = (
        s.mag[place, 0] - p.mag_offset[0],
        s.mag[place, 1] - p.mag_offset[1],
        s.mag[place, 2] - p.mag_offset[2],
    )
    M = p.mag_matrix
    x, y, z = (
        M[0, 0] * x + M[0, 1] * y + M[0, 2] * z,
        M[1, 0] * x + M[1, 1] * y + M[1, 2] * z,
        M[2, 0] * x + M[2, 1] * y + M[2, 2] * z,
    )
    square = x * x + y * y + z * z
    if not LEAST_UT**2 < square < MOST_UT**2:
        return
    field = rotate(s.attitude, x, y, z)
    for axis in range(3):
        s.field_sum[axis] += field[axis]
    s.field_square += square
    s.field_samples += 1


@compiled
def aid_heading(s: Record, p: Record, at: int) -> None:
    """The stance's turn: correct heading and drift if its field deserves it; tell the azimuth if it can be told."""
    s.magnetic_azimuth = s.magnetic_variance = UNKNOWN
    _predict(s, p, (s.time_ns[at & MASK] - s.step_time_ns) * NS)
    if p.mag_use == 0 or not _mean_field(s, p):
        return
    usual = _judge_place(s, p)
    if usual and _calm(s, p):
        _hold_heading(s, p)
    else:
        s.fields_refused += 1
    if usual and p.earth_horizontal > 0.0:
        _tell_azimuth(s, p)


@compiled
def _hold_heading(s: Record, p: Record) -> None:
    """Measure with this stance's field, at a new place, and turn the filter by the error found."""
    if s.aid_known == 0:
        _adopt(s, p)
    elif math.sqrt(_moved(s, s.aid_place)) > NEW_PLACE_M:
        _update(s, p)
        turn_heading(s, -s.aid_x[AID_PSI])
        s.aid_x[AID_PSI] = 0.0


@compiled
def _predict(s: Record, p: Record, dt: float) -> None:
    """Carry the outer filter over the step that ends now; the drift that it knows is taken out of the heading."""
    if s.aid_known == 0:
        return
    P = s.aid_P
    if s.step_swing_ns > STANDING_SWING_NS:
        _heed_stop(s, p)
        turn_heading(s, -s.aid_x[AID_DRIFT] * dt)
        for i in range(AID_STATES):
            P[AID_PSI, i] += dt * P[AID_DRIFT, i]
        for i in range(AID_STATES):
            P[i, AID_PSI] += dt * P[i, AID_DRIFT]
        P[AID_DRIFT, AID_DRIFT] += p.bias_walk**2 * dt
    P[AID_PSI, AID_PSI] += s.P[HEADING, HEADING]
    if P[AID_PSI, AID_PSI] > LOST_RAD**2:
        s.aid_known = 0


@compiled
def _heed_stop(s: Record, p: Record) -> None:
    """What stops since the last step taught about the gyro bias, as a measurement of the drift.

    The kernel has moved its bias from b to b + w·y, its variance from v to v·(1 − w): it saw y with variance
    R = v·(1 − w)/w. The same y measures c, but for the part of c that comes from walking. Then c counts from the
    new bias.
    """
    before, after = s.aid_bias_variance, s.bias_variance
    weight = 1.0 - after / before
    if weight > 0.0:
        learnt = rotate(
            s.attitude, s.bias[0] - s.aid_bias[0], s.bias[1] - s.aid_bias[1], s.bias[2] - s.aid_bias[2]
        )[2]
        assign(s.aid_h, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
        variance = after / weight + p.mag_drift_sigma**2
        _scalar_update(s, learnt / weight - s.aid_x[AID_DRIFT], variance)
        s.aid_x[AID_DRIFT] -= learnt
    assign(s.aid_bias, s.bias)
    s.aid_bias_variance = after


@compiled
def _mean_field(s: Record, p: Record) -> bool:
    """The stance's mean field into ``s.field``; whether it was alive, steady, and there is a horizontal part."""
    if s.field_samples < LEAST_SAMPLES:
        return False
    before, s.field_strength = s.field_strength, s.field_square / s.field_samples
    if abs(s.field_strength - before) < HUNG * before:
        return False
    square = 0.0
    for axis in range(3):
        s.field[axis] = s.field_sum[axis] / s.field_samples
        square += s.field[axis] ** 2
    s.field_scatter = max(0.0, s.field_square / s.field_samples - square)
    steady: bool = s.field_scatter < p.mag_steadiness**2
    return steady and math.hypot(s.field[0], s.field[1]) > LEAST_HORIZONTAL_UT


@compiled
def _moved(s: Record, since: Record) -> float:
    """Square of the distance from a place to here, m²."""
    square: float = 0.0
    for axis in range(3):
        square += (s.position[axis] - since[axis]) ** 2
    return square


@compiled
def _without_iron(s: Record) -> tuple[float, float]:
    """The stance's horizontal field less what the sensor's own iron is known to add, nav axes."""
    cosine, sine = math.cos(s.yaw), math.sin(s.yaw)
    hx, hy = s.aid_x[AID_IRON], s.aid_x[AID_IRON + 1]
    return s.field[0] - cosine * hx + sine * hy, s.field[1] - sine * hx - cosine * hy


@compiled
def _judge_place(s: Record, p: Record) -> bool:
    """Learn how disturbed the surroundings are, and say whether this place's field is as usual there."""
    x, y = _without_iron(s)
    horizontal, vertical = math.hypot(x, y), s.field[2]
    s.fresh = 1.0
    if s.places == 0.0:
        s.usual_horizontal, s.usual_vertical = horizontal, vertical
    else:
        s.fresh = 1.0 - math.exp(-math.sqrt(_moved(s, s.judged_place)) / p.mag_correlation)
    off_h, off_v = horizontal - s.usual_horizontal, vertical - s.usual_vertical
    keep = 1.0 - s.fresh / PLACES
    s.places = keep * s.places + s.fresh
    s.deviation = 0.5 * (off_h**2 + off_v**2)
    s.disturbance_sum = keep * s.disturbance_sum + s.fresh * s.deviation
    s.usual_horizontal += s.fresh / s.places * off_h
    s.usual_vertical += s.fresh / s.places * off_v
    assign(s.judged_place, s.position)
    seen = max(0.0, s.places - 1.0)  # one place is spent on what is usual
    variance = (s.disturbance_sum + PRIOR_PLACES * p.mag_prior**2) / (seen + PRIOR_PLACES)
    s.disturbance = max(variance, p.mag_floor**2)
    usual: bool = max(off_h**2, off_v**2) < p.mag_gate**2 * s.disturbance
    return usual


@compiled
def _calm(s: Record, p: Record) -> bool:
    """Whether enough places have been seen, and differ little enough, for the heading to lean on their fields."""
    calm: bool = s.disturbance < (p.mag_disturbed * s.usual_horizontal) ** 2
    return calm and s.places > PRIOR_PLACES


@compiled
def _white(s: Record) -> float:
    """Variance of one component of this stance alone, µT²: the field's scatter, and gravity's tilt into it."""
    tilt = max(s.P[ATTITUDE, ATTITUDE], s.P[ATTITUDE + 1, ATTITUDE + 1])
    variance: float = s.field_scatter + tilt * s.field[2] ** 2
    return variance


@compiled
def _adopt(s: Record, p: Record) -> None:
    """Take this place's field for the reference: the heading here and now is the one that is held."""
    P, x, variance = s.aid_P, s.aid_x, max(s.disturbance, s.deviation) + _white(s)
    for i in range(AID_STATES):
        x[i] = 0.0
        for j in range(AID_STATES):
            P[i, j] = 0.0
    iron = p.mag_iron**2
    cosine, sine = math.cos(s.yaw), math.sin(s.yaw)
    for axis in range(2):
        x[AID_FIELD + axis] = s.field[axis]
        P[AID_FIELD + axis, AID_FIELD + axis] = variance + iron
        P[AID_IRON + axis, AID_IRON + axis] = iron
        P[AID_FIELD + axis, AID_IRON + axis] = P[AID_IRON + axis, AID_FIELD + axis] = -iron * cosine
    P[AID_FIELD, AID_IRON + 1] = P[AID_IRON + 1, AID_FIELD] = iron * sine
    P[AID_FIELD + 1, AID_IRON] = P[AID_IRON, AID_FIELD + 1] = -iron * sine
    P[AID_DRIFT, AID_DRIFT] = s.bias_variance + p.mag_drift_sigma**2
    assign(s.aid_bias, s.bias)
    s.aid_bias_variance = s.bias_variance
    _settle_place(s)
    s.aid_known = 1


@compiled
def _settle_place(s: Record) -> None:
    assign(s.aid_place, s.position)
    s.fields_used += 1


@compiled
def _innovation(s: Record, ex: float, ey: float) -> float:
    """Innovation of the component along the unit vector (ex, ey), and its Jacobian into ``s.aid_h``."""
    x = s.aid_x
    cosine, sine = math.cos(s.yaw), math.sin(s.yaw)
    mx, my = x[AID_FIELD], x[AID_FIELD + 1]
    s.aid_h[AID_PSI] = -ex * my + ey * mx
    s.aid_h[AID_DRIFT] = 0.0
    s.aid_h[AID_FIELD], s.aid_h[AID_FIELD + 1] = ex, ey
    s.aid_h[AID_IRON], s.aid_h[AID_IRON + 1] = cosine * ex + sine * ey, cosine * ey - sine * ex
    rest_x, rest_y = _without_iron(s)
    turned_x, turned_y = mx - x[AID_PSI] * my, my + x[AID_PSI] * mx
    innovation: float = ex * (rest_x - turned_x) + ey * (rest_y - turned_y)
    return innovation


@compiled
def _innovation_variance(s: Record) -> float:
    """h·P·hᵀ."""
    total = 0.0
    for i in range(AID_STATES):
        for j in range(AID_STATES):
            total += s.aid_h[i] * s.aid_P[i, j] * s.aid_h[j]
    return total


@compiled
def _update(s: Record, p: Record) -> None:
    """Both components of the field, along the reference and across it; none if one is beyond the gate.

    As far as this place's strength is off, so far may its direction be. What is beyond the gate counts as
    disturbance: a field that turns with the foot must not be believed on the next leg.
    """
    size = math.hypot(s.aid_x[AID_FIELD], s.aid_x[AID_FIELD + 1])
    ex, ey = s.aid_x[AID_FIELD] / size, s.aid_x[AID_FIELD + 1] / size
    white = _white(s)
    for across in range(2):
        ax, ay = (-ey, ex) if across else (ex, ey)
        y = _innovation(s, ax, ay)
        if y * y > p.mag_gate**2 * (_innovation_variance(s) + s.disturbance + white):
            s.disturbance_sum += s.fresh * y * y
            s.fields_refused += 1
            return
    alike = math.exp(-math.sqrt(_moved(s, s.aid_place)) / p.mag_correlation)
    variance = max(s.disturbance, s.deviation) * (1.0 + alike) / (1.0 - alike) + white
    for across in range(2):
        ax, ay = (-ey, ex) if across else (ex, ey)
        _scalar_update(s, _innovation(s, ax, ay), variance)
    _settle_place(s)


@compiled
def _scalar_update(s: Record, y: float, variance: float) -> None:
    """One measurement with Jacobian ``s.aid_h``: x += K·y, P −= (P·hᵀ)(P·hᵀ)ᵀ/S."""
    P, x, cross = s.aid_P, s.aid_x, s.aid_cross
    total = variance
    for i in range(AID_STATES):
        cross[i] = 0.0
        for j in range(AID_STATES):
            cross[i] += P[i, j] * s.aid_h[j]
        total += s.aid_h[i] * cross[i]
    for i in range(AID_STATES):
        x[i] += cross[i] * y / total
        for j in range(AID_STATES):
            P[i, j] -= cross[i] * cross[j] / total


@compiled
def turn_heading(s: Record, angle: float) -> None:
    """Turn what the filter holds in nav axes about the vertical."""
    turn = from_rotation_vector(0.0, 0.0, angle)
    assign(s.attitude, normalised(multiply(turn, s.attitude)))
    assign(s.velocity, rotate(turn, s.velocity[0], s.velocity[1], s.velocity[2]))
    s.yaw = twist(s.attitude, s.reference)


@compiled
def _tell_azimuth(s: Record, p: Record) -> None:
    """Azimuth of the step's forward axis from magnetic north, if the field is enough like the earth's to tell."""
    x, y = _without_iron(s)
    off_h, off_v = math.hypot(x, y) - p.earth_horizontal, s.field[2] - p.earth_vertical
    iron = p.mag_iron**2
    if s.aid_known:
        iron = max(s.aid_P[AID_IRON, AID_IRON], s.aid_P[AID_IRON + 1, AID_IRON + 1])
    alike = off_h**2 < p.mag_gate**2 * (s.disturbance + iron)
    alike = alike and off_v**2 < p.mag_gate**2 * (s.disturbance + p.mag_iron**2)
    variance = max(s.disturbance, 0.5 * (off_h**2 + off_v**2)) + iron + _white(s)
    if alike and variance < (MOST_AZIMUTH_RAD * p.earth_horizontal) ** 2:
        s.magnetic_azimuth = wrapped(math.atan2(y, x) - s.yaw)
        s.magnetic_variance = variance / (x * x + y * y)
