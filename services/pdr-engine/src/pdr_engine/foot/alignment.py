"""Coarse alignment: attitude from gravity, gyro bias from standing still, but only from what is verified still.

At the start of a stream (and after a fault) samples wait until a quarter of a second is verified still; if none
comes within the patience, the quietest tenth of a second serves, with more doubt. The attitude found there is
carried back to the first waiting sample by the gyro, so that no motion is lost: its velocity is unknown, and the
first zero-velocity update finds it out.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import (
    ALIGNING,
    ATTITUDE,
    HEADING,
    LEVER,
    LONG_GAP_NS,
    MASK,
    NS,
    POSITION,
    RING,
    RUNNING,
    STATES,
    VELOCITY,
)
from pdr_engine.foot.quaternion import assign, from_rotation_vector, multiply, normalised, rotate, twist
from pdr_engine.foot.rest import (
    EXPECTED_NS,
    blend_bias,
    distrust_bias,
    explained,
    listen,
    mean,
    quiet,
    remember_bias,
    steady,
    steady_ns,
    unrest,
    verified_still,
    weigh_gravity,
)
from pdr_engine.foot.stance import angular_energy, force_energy, window_start

QUIET_WINDOW_NS = 100_000_000
REST_SPEED_M_S = 0.01
WALKING_SPEED_M_S = 1.5  # sigma of where a person goes unseen
SWING_SPEED_M_S = 3.0  # sigma of a foot's velocity in mid-walk
UNKNOWN_TURN_RAD_S = 0.5  # sigma of what a person turns unseen
RING_LIMIT = RING - 256


@compiled
def _level(s: Record, first: int, last: int) -> None:
    """Attitude whose mean specific force points up and whose sensor x axis lies along nav x (y, if x is steep)."""
    x, y, z = mean(s.accel, first, last, 0), mean(s.accel, first, last, 1), mean(s.accel, first, last, 2)
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    if z >= 0.0:  # the shortest turn of (x, y, z) onto (0, 0, 1)
        q = normalised((1.0 + z, y, -x, 0.0))
    else:  # first half a turn about x, then the shortest
        q = multiply(normalised((1.0 - z, -y, -x, 0.0)), (0.0, 1.0, 0.0, 0.0))
    ahead = rotate(q, 1.0, 0.0, 0.0) if abs(x) < math.sqrt(0.5) else rotate(q, 0.0, 1.0, 0.0)
    assign(s.attitude, multiply(from_rotation_vector(0.0, 0.0, -math.atan2(ahead[1], ahead[0])), q))


@compiled
def _carry_back(s: Record, since: int) -> None:
    """Turn the attitude back from sample ``since`` to the first waiting one."""
    for k in range(since, s.start, -1):
        back_s = (s.time_ns[(k - 1) & MASK] - s.time_ns[k & MASK]) * NS
        turn = from_rotation_vector(
            (s.gyro[k & MASK, 0] - s.bias[0]) * back_s,
            (s.gyro[k & MASK, 1] - s.bias[1]) * back_s,
            (s.gyro[k & MASK, 2] - s.bias[2]) * back_s,
        )
        assign(s.attitude, normalised(multiply(s.attitude, turn)))


@compiled
def _keep_heading(s: Record) -> None:
    """Turn about the vertical so that the yaw is what it was before the fault; zero at the very start."""
    away = s.yaw - twist(s.attitude, s.reference)
    assign(s.attitude, multiply(from_rotation_vector(0.0, 0.0, away), s.attitude))


@compiled
def _lost_s(s: Record) -> float:
    """How long the fault was; as long as a long gap at least where the clock was set back and cannot tell."""
    lost_ns = s.time_ns[s.start & MASK] - s.lost_since_ns
    return (lost_ns if lost_ns > 0 else LONG_GAP_NS) * NS if s.began else 0.0


@compiled
def _start_covariance(s: Record, p: Record, tilt_sigma: float, speed_sigma: float) -> None:
    """What a new alignment knows: tilt; velocity if at rest; place and heading as lost as the fault was long."""
    lost_s = _lost_s(s)
    for i in range(STATES):
        for j in range(STATES):
            s.P[i, j] = 0.0
    assign(s.velocity, (0.0, 0.0, 0.0))
    assign(s.lever, (0.0, 0.0, 0.0))
    for axis in range(3):
        s.P[POSITION + axis, POSITION + axis] = (WALKING_SPEED_M_S * lost_s) ** 2
        s.P[VELOCITY + axis, VELOCITY + axis] = speed_sigma**2
        s.P[LEVER + axis, LEVER + axis] = p.lever_sigma**2
    s.P[ATTITUDE, ATTITUDE] = s.P[ATTITUDE + 1, ATTITUDE + 1] = tilt_sigma**2
    s.P[HEADING, HEADING] = min(UNKNOWN_TURN_RAD_S * lost_s, math.pi) ** 2


@compiled
def _quietest(s: Record, p: Record) -> int:
    """Last sample of the quietest tenth of a second that waits; −1 if there is none."""
    best, least = -1, math.inf
    for last in range(s.start, s.head):
        first = window_start(s, last, QUIET_WINDOW_NS)
        if first < 0:
            continue
        unrest = (
            force_energy(s, first, last) * p.accel_weight + angular_energy(s, first, last) * p.gyro_weight
        )
        if unrest < least:
            best, least = last, unrest
    return best


@compiled
def _align(s: Record, p: Record, first: int, last: int, verified: bool) -> None:
    """Start the filter at the first waiting sample with the attitude found in the window."""
    if verified:
        span_s = (s.time_ns[last & MASK] - s.time_ns[first & MASK]) * NS
        for axis in range(3):
            s.rate[axis] = mean(s.gyro, first, last, axis)
        remember_bias(s)
        if not explained(s, p, first, last):
            distrust_bias(s)
        blend_bias(s, p, s.rate, span_s, unrest(s, first, last))
        weigh_gravity(s, first, last)
        listen(s, p, first, last)
    _level(s, first, last)
    if s.aligned == 0:
        assign(s.reference, s.attitude)
    _carry_back(s, first)
    _keep_heading(s)
    at_rest = verified and s.time_ns[first & MASK] - s.time_ns[s.start & MASK] < QUIET_WINDOW_NS
    tilt_sigma = p.tilt_sigma if verified else p.quiet_tilt_sigma
    _start_covariance(s, p, tilt_sigma, REST_SPEED_M_S if at_rest else SWING_SPEED_M_S)
    s.last_still_ns = s.calm_since_ns = s.time_ns[s.start & MASK]
    s.aligned = 1
    s.mode = RUNNING


@compiled
def try_align(s: Record, p: Record, now: bool) -> None:
    """Align if the newest samples are verified still or waiting has taken long enough (``now``: in any case)."""
    last = s.head - 1
    first = window_start(s, last, p.still_window_ns)
    if first >= 0 and verified_still(s, p, first, last):
        _align(s, p, first, last, True)
        return
    waited_ns = s.time_ns[last & MASK] - s.time_ns[s.start & MASK]
    if 2 * waited_ns >= EXPECTED_NS and quiet(s, p, s.start, last) and steady(s, s.start, last):
        if waited_ns >= steady_ns(s, p, s.start, last):
            _align(s, p, s.start, last, True)
            return
        waited_ns = 0
    if now or waited_ns >= p.patience_ns or s.head - s.start >= RING_LIMIT:
        calmest = _quietest(s, p)
        if calmest >= 0:
            _align(s, p, window_start(s, calmest, QUIET_WINDOW_NS), calmest, False)
        elif s.head - s.start >= RING_LIMIT:
            wait_from(s, s.head)


@compiled
def wait_from(s: Record, start: int) -> None:
    """Wait for an alignment with the samples from ``start`` on; those before, if any still wait, are lost."""
    s.mode = ALIGNING
    s.start = s.done = s.clean = s.looked = start
    s.unbroken = max(s.unbroken, start)
