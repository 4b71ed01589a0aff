"""The compiled stream: samples in, estimates and steps out, one sample after the other.

Every decision depends on the samples accepted so far and never on how they were cut into batches. A sample
passes three stages: accepted (``head``), made clean and looked at by the detector (``clean``), used by the
filter (``done``); each stage waits for its look-ahead, together less than 100 ms.
"""

import math
from typing import Any

from pdr_engine.foot.alignment import try_align, wait_from
from pdr_engine.foot.clipping import mend, watch_force
from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.features import accumulate
from pdr_engine.foot.gap import coast
from pdr_engine.foot.intake import AFTER_LONG_GAP, DROPPED, fill, judge, missing, push
from pdr_engine.foot.kernel import creep, forget_place, mechanise, propagate, zero_velocity
from pdr_engine.foot.learned import look
from pdr_engine.foot.magnetic import aid_heading, begin_field, gather_field, turn_heading
from pdr_engine.foot.memory import ALIGNING, CLIP_LAG_NS, GAP_NS, LATENCY_NS, MASK, NS, RUNNING, STANCE_END_NS
from pdr_engine.foot.motion import classify
from pdr_engine.foot.parameters import LEARNED
from pdr_engine.foot.quaternion import assign, rotate, twist, wrapped
from pdr_engine.foot.rest import (
    blend_bias,
    distrust_bias,
    listen,
    quiet,
    remember_bias,
    steady,
    steady_ns,
    unrest,
    verified_still,
    weigh_gravity,
)
from pdr_engine.foot.stance import detect
from pdr_engine.foot.strides import begin_alignment, begin_stride, describe_stride, follow, vertical
from pdr_engine.foot.uncertainty import widen, write_covariance

UNREST, REST, STRANGE_REST = range(3)
CONTRADICTION = 50.0  # NIS, three degrees of freedom: seven sigmas
STOP_BLOCK_NS = 500_000_000  # a stop is verified block by block
STRIDE_AT_LEAST_NS = 350_000_000  # the strides of a sprint take 0.4 s: what ends sooner is not a step yet


@compiled
def feed(state: Any, parameters: Any, batch: Any, count: int, ends: bool, estimates: Any, steps: Any) -> None:
    """Take the first ``count`` rows of ``batch`` (SAMPLE) in; rows of ESTIMATE and STEP come out.

    ``ends``: the stream ends with them, so nothing waits any longer. ``state`` (STATE) and ``parameters``
    (PARAMETERS) have one row each: numba takes tables from Python in a tenth of the time it needs for single
    records. The state tells how many ``estimates`` and ``steps`` were written.
    """
    s, p = state[0], parameters[0]
    s.estimates = 0
    s.steps = 0
    for i in range(count):
        sample = batch[i]
        verdict = judge(s, sample)
        if verdict == DROPPED:
            s.dropped += 1
            s.dropped_in_a_row += 1
            continue
        if verdict == AFTER_LONG_GAP:
            _flush(s, p, estimates, steps)
            _break_off(s)
        for left in range(missing(s, sample), 0, -1):
            fill(s, sample, left)
            _advance(s, p, estimates, steps)
        push(s, sample)
        watch_force(s, p, s.head - 1)
        _advance(s, p, estimates, steps)
    if ends:
        _flush(s, p, estimates, steps)


@compiled
def _flush(s: Record, p: Record, estimates: Any, steps: Any) -> None:
    """Use what waits, without its look-ahead."""
    s.flushing = 1
    if s.mode == ALIGNING and s.head > s.start:
        try_align(s, p, True)
    _advance(s, p, estimates, steps)
    s.flushing = 0


@compiled
def _break_off(s: Record) -> None:
    """A long gap: align anew with what comes."""
    if s.mode == RUNNING:
        s.lost_since_ns = s.time_ns[(s.head - 1) & MASK]
    s.gaps += 1
    _realign(s, s.head)


@compiled
def _realign(s: Record, start: int) -> None:
    """Wait for an alignment with the samples from ``start`` on."""
    wait_from(s, start)
    s.in_stance = 0
    s.stop_samples = 0
    if s.aligned:
        s.realigned = 1
        s.realignments += 1


@compiled
def _age_ns(s: Record, at: int) -> int:
    """How old sample ``at`` will be when the next sample comes (the latest moment to act within a look-ahead)."""
    newest = s.time_ns[(s.head - 1) & MASK]
    interval = newest - s.time_ns[(s.head - 2) & MASK] if s.head - s.start > 1 else 0
    return int(newest - s.time_ns[at & MASK] + min(interval, GAP_NS))


@compiled
def _advance(s: Record, p: Record, estimates: Any, steps: Any) -> None:
    """Let every stage go on as far as its look-ahead allows."""
    if s.mode == ALIGNING and s.flushing == 0:
        try_align(s, p, False)
    while s.mode == RUNNING and s.clean < s.head and (s.flushing or _age_ns(s, s.clean) > CLIP_LAG_NS):
        mend(s, p, s.clean)
        accumulate(s, s.clean)
        if p.method != LEARNED:
            detect(s, p, s.clean)
        s.clean += 1
    while s.mode == RUNNING and s.done < s.clean and (s.flushing or _age_ns(s, s.done) > LATENCY_NS):
        if p.method == LEARNED:
            look(s, p, s.time_ns[s.done & MASK] + STANCE_END_NS)
        _use(s, p, s.done, estimates, steps)


@compiled
def _use(s: Record, p: Record, at: int, estimates: Any, steps: Any) -> None:
    """The filter's turn of one sample."""
    place = at & MASK
    dt = (s.time_ns[place] - s.time_ns[(at - 1) & MASK]) * NS
    if at == s.start:
        _begin(s, at)
    else:
        gap = dt > GAP_NS * NS
        if gap:
            coast(s, at, dt)
        else:
            mechanise(s, at, dt)
        propagate(s, p, at, dt, gap)
        if s.still[place]:
            creep(s, p, at, dt)
            assign(s.predicted, s.position)
            zero_velocity(s, p, at, dt)
    if _diverged(s, p):
        _recover(s, at)
        return
    follow(s, at)
    s.done += 1
    s.yaw = twist(s.attitude, s.reference)
    _write_estimate(s, at, estimates)
    _watch_stop(s, p, at)
    _watch_stance(s, p, at, steps)


@compiled
def _begin(s: Record, at: int) -> None:
    """The first sample after an alignment; a fault belongs to the step it hits, unless the clock was set back."""
    now_ns = s.time_ns[at & MASK]
    if s.began == 0 or s.step_time_ns > now_ns:
        s.step_time_ns = now_ns
    if s.began == 0:
        s.began = 1
        s.step_yaw = twist(s.attitude, s.reference)
        assign(s.upright, vertical(s))
    begin_alignment(s, at)


@compiled
def _diverged(s: Record, p: Record) -> bool:
    speed = math.sqrt(s.velocity[0] ** 2 + s.velocity[1] ** 2 + s.velocity[2] ** 2)
    place = s.position[0] + s.position[1] + s.position[2] + s.attitude[0]
    return not (math.isfinite(speed) and math.isfinite(place) and speed <= p.max_speed)


@compiled
def _recover(s: Record, at: int) -> None:
    """Back to where the last step ended, and align anew with the samples from here on.

    Not with what the alignment that fails at once was found in: wrong units would try again at every sample.
    """
    assign(s.position, s.step_position)
    s.yaw = s.step_yaw
    s.lost_since_ns = s.step_time_ns
    at_once = s.time_ns[at & MASK] - s.time_ns[s.start & MASK] < LATENCY_NS
    _realign(s, s.head if at_once else at + 1)


@compiled
def _write_estimate(s: Record, at: int, estimates: Any) -> None:
    """A row for every sample that came."""
    if s.filled[at & MASK]:
        return
    row = estimates[s.estimates]
    row.time_ns = s.time_ns[at & MASK]
    row.yaw_rad = s.yaw
    assign(row.attitude, s.attitude)
    row.stance = s.still[at & MASK] != 0
    square = 0.0
    for axis in range(3):
        row.position_m[axis] = s.position[axis]
        square += s.velocity[axis] ** 2
    row.speed_m_s = math.sqrt(square)
    s.estimates += 1


@compiled
def _watch_stop(s: Record, p: Record, at: int) -> None:
    """In a stop that is verified still block by block, learn the gyro bias from the mean rate of the whole stop."""
    place = at & MASK
    if s.still[place] == 0 or at == s.start or s.time_ns[place] - s.time_ns[(at - 1) & MASK] > GAP_NS:
        s.stop_samples = 0
        return
    if s.stop_samples == 0:
        s.stop_since_ns = s.time_ns[place]
        s.stop_unrest = 0.0
        s.stop_kind = UNREST
        remember_bias(s)
        assign(s.stop_sum, (0.0, 0.0, 0.0))
        s.stop_block = at
    for axis in range(3):
        s.stop_sum[axis] += s.gyro[place, axis]
    s.stop_samples += 1
    if s.time_ns[place] - s.time_ns[s.stop_block & MASK] >= STOP_BLOCK_NS:
        _end_block(s, p, at)


@compiled
def _kind_of_rest(s: Record, p: Record, first: int, last: int) -> int:
    """What a block of a stop shows: no rest, rest with a rate that the bias explains, or with a stranger one."""
    if verified_still(s, p, first, last):
        return REST
    return STRANGE_REST if quiet(s, p, first, last) and steady(s, first, last) else UNREST


@compiled
def _end_block(s: Record, p: Record, at: int) -> None:
    """Half a second of the stop is over: go on if it was still as those before, begin a new stop if not."""
    first = max(s.stop_block, at - MASK // 2)
    span_ns = s.time_ns[at & MASK] - s.stop_since_ns
    s.stop_block = at
    kind = _kind_of_rest(s, p, first, at)
    if kind == UNREST or kind != s.stop_kind != UNREST:
        s.stop_samples = 0
        return
    s.stop_kind = kind
    s.stop_unrest = max(s.stop_unrest, unrest(s, first, at))
    if kind == STRANGE_REST:
        if span_ns < steady_ns(s, p, first, at):
            return
        distrust_bias(s)
    weigh_gravity(s, first, at)
    listen(s, p, first, at)
    if span_ns >= p.stop_ns:
        for axis in range(3):
            s.rate[axis] = s.stop_sum[axis] / s.stop_samples
        _hold_still(s, p, span_ns * NS)


@compiled
def _hold_still(s: Record, p: Record, span_s: float) -> None:
    """The stop's mean rate as a zero-angular-rate update: of the bias, and of the heading that it has turned."""
    x, y, z = s.bias[0], s.bias[1], s.bias[2]
    blend_bias(s, p, s.rate, span_s, s.stop_unrest)
    learnt = rotate(s.attitude, s.bias[0] - x, s.bias[1] - y, s.bias[2] - z)[2]
    turn_heading(s, -learnt * span_s)


@compiled
def _watch_stance(s: Record, p: Record, at: int, steps: Any) -> None:
    """Keep the books of stances, and hand a step over when a stance ends or goes on for long."""
    place = at & MASK
    now_ns = s.time_ns[place]
    if s.still[place] == 0:
        if at > s.start:
            s.step_swing_ns += now_ns - s.time_ns[(at - 1) & MASK]
        s.in_stance = 0
        return
    if s.in_stance == 0:
        s.in_stance = 1
        begin_field(s)
        s.stance_since_ns = now_ns
        s.stances += 1
        s.contradictions += s.nis > CONTRADICTION
    s.stance_doubt += s.doubt[place]
    s.stance_samples += 1
    gather_field(s, p, at)
    goes_on_long = now_ns - max(s.stance_since_ns, s.step_time_ns) >= p.report_ns
    long_enough = now_ns - s.step_time_ns >= STRIDE_AT_LEAST_NS
    if goes_on_long or (long_enough and _stance_ends(s, at)):
        _hand_over(s, p, at, steps)


@compiled
def _stance_ends(s: Record, at: int) -> bool:
    """Whether nothing soon after sample ``at`` belongs to the stance."""
    limit_ns = s.time_ns[at & MASK] + STANCE_END_NS
    k = at + 1
    while k < s.clean and s.time_ns[k & MASK] <= limit_ns:
        if s.still[k & MASK]:
            return False
        k += 1
    return True


@compiled
def _hand_over(s: Record, p: Record, at: int, steps: Any) -> None:
    """Write the step from the last hand-over to sample ``at``, and reset what the step has taken along."""
    aid_heading(s, p, at)
    begin_field(s)
    row = steps[s.steps]
    row.start_time_ns = s.step_time_ns
    row.time_ns = s.time_ns[at & MASK]
    cosine, sine = math.cos(s.step_yaw), math.sin(s.step_yaw)
    x, y = s.position[0] - s.step_position[0], s.position[1] - s.step_position[1]
    row.displacement_m[0] = cosine * x + sine * y
    row.displacement_m[1] = cosine * y - sine * x
    row.displacement_m[2] = s.position[2] - s.step_position[2]
    row.heading_change_rad = wrapped(s.yaw - s.step_yaw)
    write_covariance(s, p, row, cosine, sine)
    row.swing_ns = s.step_swing_ns
    row.doubt = s.stance_doubt / max(1, s.stance_samples)
    row.realigned = s.realigned != 0
    describe_stride(s, row)
    classify(s, row)
    widen(row)
    row.magnetic_azimuth = s.magnetic_azimuth
    row.magnetic_variance = s.magnetic_variance
    s.steps += 1
    _next_step(s, at)


@compiled
def _next_step(s: Record, at: int) -> None:
    s.step_time_ns = s.time_ns[at & MASK]
    assign(s.step_position, s.position)
    s.step_yaw = s.yaw
    s.step_swing_ns = 0
    s.stance_doubt = 0.0
    s.stance_samples = 0
    s.realigned = 0
    begin_stride(s, at)
    forget_place(s)
