"""From raw samples to a regular stream: refuse what cannot be, and fill in what is missing.

The rings of the state hold the samples. An output of an inertial unit is the mean over its own interval; one that
never came is taken to lie on the line between its neighbours, if no more than 50 ms are missing. Cut peaks are the
matter of `pdr_engine.foot.clipping`.
"""

import math

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.memory import GAP_NS, LONG_GAP_NS, MASK

CLOCK_PATIENCE = 100  # samples
# What no sensor for feet gives: the square of such a number would stay in the running sums for good.
MOST_FORCE_M_S2, MOST_RATE_RAD_S = 1e5, 1e4
SHORTEST_NS = 100_000  # 10 kHz: closer stamps are a clock's fault, and more samples than the rings can hold
DROPPED, ACCEPTED, AFTER_LONG_GAP = 0, 1, 2
MISSING = 1.7  # intervals: a longer one is taken to have lost samples (stamps may tremble)
TRACKING = 0.02  # part by which the usual interval follows each interval, up or down: it tends to the median
STRETCHING = 0.0025  # part by which each that lacks samples stretches it: a sensor may become slower for good


@compiled
def judge(s: Record, sample: Record) -> int:
    """Whether a sample can be used: of a size that can be, and later than the one before.

    Where nothing but earlier stamps comes, the last good one was wrong, or the sensor's clock has been set back:
    after a while that counts as a gap, or one wild stamp would deafen the foot for good.
    """
    for axis in range(3):
        if not (abs(sample.accel[axis]) < MOST_FORCE_M_S2 and abs(sample.gyro[axis]) < MOST_RATE_RAD_S):
            return DROPPED
    if s.head == 0:
        return ACCEPTED
    step_ns = sample.time_ns - s.time_ns[(s.head - 1) & MASK]
    if 0 < step_ns < SHORTEST_NS or (step_ns <= 0 and s.dropped_in_a_row < CLOCK_PATIENCE):
        return DROPPED
    if step_ns <= 0:
        return AFTER_LONG_GAP
    return AFTER_LONG_GAP if step_ns > LONG_GAP_NS else ACCEPTED


@compiled
def missing(s: Record, sample: Record) -> int:
    """How many samples are missing before this one; 0 where too many are, for a gap is nothing to be filled in."""
    if s.head == s.start or s.head == s.unbroken:
        return 0
    step_ns = sample.time_ns - s.time_ns[(s.head - 1) & MASK]
    if step_ns <= 0 or step_ns > GAP_NS or s.usual_ns == 0.0 or step_ns < MISSING * s.usual_ns:
        return 0
    return int(step_ns / s.usual_ns + 0.5) - 1


@compiled
def _learn_interval(s: Record, step_ns: int) -> None:
    """The usual interval: its median, in steps of a part of itself, so that missing samples do not stretch it."""
    if s.usual_ns == 0.0:
        s.usual_ns = float(step_ns)
    elif step_ns > s.usual_ns:
        s.usual_ns *= 1.0 + TRACKING
    elif step_ns < s.usual_ns:
        s.usual_ns *= 1.0 - TRACKING


@compiled
def fill(s: Record, sample: Record, left: int) -> None:
    """Append the next of the ``left`` samples that are missing before this one."""
    before, place = (s.head - 1) & MASK, s.head & MASK
    share = 1.0 / (left + 1)
    s.time_ns[place] = s.time_ns[before] + (sample.time_ns - s.time_ns[before]) // (left + 1)
    for axis in range(3):
        s.accel[place, axis] = s.accel[before, axis] + share * (sample.accel[axis] - s.accel[before, axis])
        s.gyro[place, axis] = s.gyro[before, axis] + share * (sample.gyro[axis] - s.gyro[before, axis])
        s.mag[place, axis] = math.nan
    _append(s, 1)
    s.missing += 1


@compiled
def push(s: Record, sample: Record) -> None:
    """Append an accepted sample to the rings."""
    place = s.head & MASK
    if s.head > s.start:
        step_ns = sample.time_ns - s.time_ns[(s.head - 1) & MASK]
        if step_ns > GAP_NS:
            s.gaps += 1
            s.unbroken = s.head
        elif s.filled[(s.head - 1) & MASK]:
            s.usual_ns *= 1.0 + STRETCHING
        else:
            _learn_interval(s, step_ns)
    s.time_ns[place] = sample.time_ns
    for axis in range(3):
        s.accel[place, axis] = sample.accel[axis]
        s.gyro[place, axis] = sample.gyro[axis]
        s.mag[place, axis] = sample.mag[axis]
    _append(s, 0)
    s.dropped_in_a_row = 0
    s.accepted += 1


@compiled
def _append(s: Record, filled: int) -> None:
    """The head's place in the rings holds a new sample of which nothing is known yet."""
    place = s.head & MASK
    for axis in range(3):
        s.clipped[place, axis] = 0
        s.cut_force[place, axis] = 0
        s.rebuilt[place, axis] = 0.0
    s.still[place] = 0
    s.filled[place] = filled
    s.head += 1
