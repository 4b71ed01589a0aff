"""The learned detector: how the sole moves and how surely, from how the last second felt.

A small network (one hidden layer) gives the scale σ, m/s, of the sole's velocity, and its mean: a foot that touches
down still sinks and slides on. The velocity update is applied wherever σ is small, with a noise
that says how small. It was trained on motion capture by maximum likelihood under a Student-t law; weights and
training data: `pdr_engine.foot.weights`.
"""

import math
from typing import Any

from pdr_engine.foot.clipping import mend
from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.features import accumulate, describe, swings
from pdr_engine.foot.intake import push
from pdr_engine.foot.memory import FEATURES, HIDDEN, MASK
from pdr_engine.foot.weights import BIAS, HIDDEN_BIAS, INPUT, MOTION, MOTION_BIAS, OUTPUT

SWING_M_S = 3.0
JUDGED_FOR_NS = 7_500_000  # neighbours share a verdict: at 200 Hz every other sample is judged


@compiled
def sole_motion(s: Record) -> tuple[float, float, float]:
    """σ and the mean velocity along the step's way and up, m/s, of the features at hand, after a long step.

    With h_k = u/(1 + |u|), u = b_k + W_k·x: ln σ = c + Σ v_k·h_k, and each mean is σ·(d + Σ m_k·h_k).
    """
    log_sigma, along, up = BIAS, MOTION_BIAS[0], MOTION_BIAS[1]
    for k in range(HIDDEN):
        u = HIDDEN_BIAS[k]
        for j in range(FEATURES):
            u += INPUT[k, j] * s.features[j]
        h = u / (1.0 + abs(u))
        log_sigma += OUTPUT[k] * h
        along += MOTION[0, k] * h
        up += MOTION[1, k] * h
    sigma = math.exp(min(2.0, max(-6.0, log_sigma)))
    return sigma, sigma * along, sigma * up


@compiled
def _judge(s: Record, at: int) -> None:
    """Write σ and the mean motion of sample ``at``."""
    place = at & MASK
    if swings(s, at):
        s.sigma[place], s.motion[place, 0], s.motion[place, 1] = SWING_M_S, 0.0, 0.0
        return
    describe(s, at)
    s.sigma[place], s.motion[place, 0], s.motion[place, 1] = sole_motion(s)


@compiled
def _share(s: Record, at: int) -> None:
    """Sample ``at`` gets the verdict of the one before."""
    place, before = at & MASK, (at - 1) & MASK
    s.sigma[place] = s.sigma[before]
    s.motion[place, 0], s.motion[place, 1] = s.motion[before, 0], s.motion[before, 1]


@compiled
def look(s: Record, p: Record, until_ns: int) -> None:
    """Judge the samples up to time ``until_ns``: stance or not, and how surely."""
    while s.looked < s.clean and s.time_ns[s.looked & MASK] <= until_ns:
        place = s.looked & MASK
        if s.looked > s.start and s.time_ns[place] - s.judged_ns < JUDGED_FOR_NS:
            _share(s, s.looked)
        else:
            s.judged_ns = s.time_ns[place]
            _judge(s, s.looked)
        s.doubt[place] = s.sigma[place] / p.threshold
        s.still[place] = s.doubt[place] < 1.0
        s.looked += 1


@compiled
def tabulate(state: Any, parameters: Any, batch: Any, bias: Any, ahead: int, rows: Any) -> None:
    """The features of every sample of ``batch`` (SAMPLE) into ``rows`` (n, FEATURES), for training."""
    s, p = state[0], parameters[0]
    for axis in range(3):
        s.bias[axis] = bias[axis]
    for i in range(len(batch) + 2 * ahead):
        if i < len(batch):
            push(s, batch[i])
        if ahead <= i < len(batch) + ahead:
            mend(s, p, s.clean)
            accumulate(s, s.clean)
            s.clean += 1
        if i >= 2 * ahead:
            describe(s, i - 2 * ahead)
            for j in range(FEATURES):
                rows[i - 2 * ahead, j] = s.features[j]
