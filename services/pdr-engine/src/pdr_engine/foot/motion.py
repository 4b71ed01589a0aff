"""Which kind of motion a step was, and which way it went, told from how the foot moved and rests.

The sensor may be mounted any way up, so everything is told against the foot's own habits, learned on the way: how
it rests when it stands flat (`upright`), how alike its stances are (`unsteady`), and where its toes point
(`ahead`). The last needs no majority of forward strides: knee and ankle lift the heel, not the toes, so the largest
tilt of a swing is nose down whichever way the foot goes.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import (
    CRAWLING,
    NS,
    RUNNING_GAIT,
    STAIRS,
    STANDING,
    STANDING_SWING_NS,
    UNKNOWN,
    WALKING,
)
from pdr_engine.foot.quaternion import assign, rotate, twist, wrapped
from pdr_engine.foot.strides import angle_between, dot

STANDING_DISTANCE_M = 0.05
# Stairs and ladders: a riser has 10 cm at least, and the way rises by a quarter (stairs: half, ramps: an eighth).
RISER_M, SIGMAS, SLOPE = 0.10, 3.0, 0.25
HIGHEST_M = 0.8  # three risers of 22 cm, two rungs of 35
# A foot that walks rolls over its toes: it tilts and turns beyond these. A crawling one is dragged.
ROLLED_RAD, ROLLED_RATE_RAD_S = 0.52, 5.0
DRAGGED_CLEARANCE_M = 0.12
PRONE_RAD = 0.9  # toes on the ground, heel up
UNSTEADY_RAD = 0.15  # rms: a sole finds the floor again within 0.05
RUNNING_SPEED_M_S = 2.2  # people go over from walking to running at about 2 m/s
FLYING_SHARE = 0.75  # of a running stride the foot is not at rest; walking, 0.5 to 0.68
IMPACT_M_S2 = 35.0
SLIP_NS = 25_000_000  # a shorter stance is a slip of the detector's: it says nothing of the gait
HABIT = 0.3  # weight of a new stance in what is usual
STEADIED_M = 0.15  # shorter steps say little of how a foot rests
AHEAD_MEMORY = 0.9
TILTED_RAD = 0.7  # a swing that tilts less does not tell where the toes are: the nose goes up by as much
KNOWN = 0.5  # length of `ahead` from which it is believed: of sin² of tilts
DIRECTED_M = 0.15  # a shorter step has no direction, nor has one that turns by more
TURNED_RAD = 2.0


@compiled
def classify(s: Record, row: Record) -> None:
    """Motion class and direction of the step in ``row``, which `describe_stride` has filled; learns the habits."""
    length = math.sqrt(dot(s.up, s.up))
    for axis in range(3):
        s.up[axis] /= max(length, 1e-12)
    row.tilt_rad = angle_between(dot(s.up, s.upright))
    _steadiness(s, row)
    row.motion = _motion(row)
    if (row.motion == WALKING or row.motion == RUNNING_GAIT) and _rolled(row):
        _stand_upright(s)
    row.direction = _direction(s, row)


@compiled
def _across(row: Record) -> float:
    """Length across the ground, m."""
    return math.hypot(row.displacement_m[0], row.displacement_m[1])


@compiled
def _rolled(row: Record) -> bool:
    """Whether the foot rolled over its toes."""
    rolled: bool = row.pitch_rad > ROLLED_RAD and row.peak_rate_rad_s > ROLLED_RATE_RAD_S
    return rolled


@compiled
def _motion(row: Record) -> int:
    """The motion class."""
    across, climb = _across(row), abs(row.displacement_m[2])
    if row.realigned:
        return UNKNOWN
    length = math.hypot(across, climb)
    if length < STANDING_DISTANCE_M or (row.swing_ns < STANDING_SWING_NS and length < DIRECTED_M):
        return STANDING
    if _climbed(row, across, climb):
        return STAIRS
    if _crawled(row):
        return CRAWLING
    return RUNNING_GAIT if _ran(row, across) else WALKING


@compiled
def _climbed(row: Record, across: float, climb: float) -> bool:
    """One riser or more, beyond doubt, and too steep for a ramp."""
    sigma = math.sqrt(max(0.0, row.covariance[2, 2]))
    return RISER_M <= climb <= HIGHEST_M and climb > SIGMAS * sigma and climb > SLOPE * across


@compiled
def _crawled(row: Record) -> bool:
    """Dragged along low, by a foot that lies on its toes or never rests twice the same way."""
    lifted = row.pitch_rad > ROLLED_RAD or row.clearance_m > DRAGGED_CLEARANCE_M
    if lifted or row.peak_rate_rad_s > ROLLED_RATE_RAD_S:
        return False
    crawled: bool = row.tilt_rad > PRONE_RAD or row.unsteady_rad > UNSTEADY_RAD
    return crawled


@compiled
def _ran(row: Record, across: float) -> bool:
    """Fast, or hardly on the ground and landing hard."""
    if across > RUNNING_SPEED_M_S * (row.time_ns - row.start_time_ns) * NS:
        return True
    flown: bool = row.swing_ns > FLYING_SHARE * (row.swing_ns + row.stance_ns)
    touched: bool = row.stance_ns > SLIP_NS
    return flown and touched and _rolled(row) and row.peak_force_m_s2 > IMPACT_M_S2


@compiled
def _steadiness(s: Record, row: Record) -> None:
    """How alike the stances of strides are: running mean of the squared angle between one and the next."""
    if _across(row) > STEADIED_M and dot(s.last_up, s.last_up) > 0.0:
        angle = angle_between(dot(s.up, s.last_up))
        s.unsteady += HABIT * (angle * angle - s.unsteady)
    row.unsteady_rad = math.sqrt(s.unsteady)
    assign(s.last_up, s.up)


@compiled
def _stand_upright(s: Record) -> None:
    """A walking foot stands flat: so does this one."""
    for axis in range(3):
        s.upright[axis] += HABIT * (s.up[axis] - s.upright[axis])
    length = math.sqrt(dot(s.upright, s.upright))
    for axis in range(3):
        s.upright[axis] /= max(length, 1e-12)


@compiled
def _direction(s: Record, row: Record) -> int:
    """1 forward, 2 left, 3 backward, 4 right of where the toes point; 0 if that is not known or there is no way."""
    _learn_ahead(s, row)
    vague = _across(row) < DIRECTED_M or abs(row.heading_change_rad) > TURNED_RAD
    if vague or math.hypot(s.ahead[0], s.ahead[1]) < KNOWN:
        return 0
    course = math.atan2(row.displacement_m[1], row.displacement_m[0]) - 0.5 * row.heading_change_rad
    quarter = wrapped(course - math.atan2(s.ahead[1], s.ahead[0])) / (0.5 * math.pi)
    return 1 + math.floor(quarter + 0.5) % 4


@compiled
def _learn_ahead(s: Record, row: Record) -> None:
    """Where the toes point: away from where the vertical leans, in the foot's axes, when the heel is highest."""
    if row.pitch_rad < TILTED_RAD or row.motion == CRAWLING:
        return
    lean = (
        s.steep_up[0] - s.steep_cosine * s.rest_up[0],
        s.steep_up[1] - s.steep_cosine * s.rest_up[1],
        s.steep_up[2] - s.steep_cosine * s.rest_up[2],
    )
    heel = rotate(s.attitude, lean[0], lean[1], lean[2])
    angle = math.atan2(-heel[1], -heel[0]) - twist(s.attitude, s.reference)
    weight = math.sin(row.pitch_rad) ** 2
    s.ahead[0] = AHEAD_MEMORY * s.ahead[0] + weight * math.cos(angle)
    s.ahead[1] = AHEAD_MEMORY * s.ahead[1] + weight * math.sin(angle)
