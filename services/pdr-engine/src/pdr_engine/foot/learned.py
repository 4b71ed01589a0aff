"""The learned detector: how fast the foot may be moving, from how the last second felt.

A small network (one hidden layer) gives the scale σ, m/s, of the foot's velocity: the zero-velocity update is
applied wherever σ is small, with a noise that says how small. It was trained on motion capture by
maximum likelihood under a Student-t law; weights and training data: `pdr_engine.foot.weights`.
"""

import math
from typing import Any

from pdr_engine.foot.compiled import Record, compiled
from pdr_engine.foot.features import accumulate, describe, swings
from pdr_engine.foot.intake import mend, push
from pdr_engine.foot.memory import FEATURES, HIDDEN, MASK
from pdr_engine.foot.weights import BIAS, HIDDEN_BIAS, INPUT, OUTPUT

SWING_M_S = 3.0
JUDGED_FOR_NS = 7_500_000  # neighbours share a verdict: at 200 Hz every other sample is judged


@compiled
def velocity_scale(s: Record) -> float:
    """σ, m/s, of the features at hand: ln σ = c + Σ v_k·u/(1 + |u|), u = b_k + W_k·x."""
    total = BIAS
    for k in range(HIDDEN):
        u = HIDDEN_BIAS[k]
        for j in range(FEATURES):
            u += INPUT[k, j] * s.features[j]
        total += OUTPUT[k] * u / (1.0 + abs(u))
    return math.exp(min(2.0, max(-6.0, total)))


@compiled
def _judged(s: Record, at: int) -> float:
    """σ of sample ``at``, m/s."""
    if swings(s, at):
        return SWING_M_S
    describe(s, at)
    return float(velocity_scale(s))


@compiled
def look(s: Record, p: Record, until_ns: int) -> None:
    """Judge the samples up to time ``until_ns``: stance or not, and how surely."""
    while s.looked < s.clean and s.time_ns[s.looked & MASK] <= until_ns:
        place = s.looked & MASK
        if s.looked > s.start and s.time_ns[place] - s.judged_ns < JUDGED_FOR_NS:
            s.sigma[place] = s.sigma[(s.looked - 1) & MASK]
        else:
            s.judged_ns = s.time_ns[place]
            s.sigma[place] = _judged(s, s.looked)
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
