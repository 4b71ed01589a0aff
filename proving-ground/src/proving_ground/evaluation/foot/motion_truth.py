"""What kind of motion every stride really was, by its truth alone: labels to hold the motion classes against.

The recordings carry no labels. Motion capture shows a foot's height and speed, a survey the speed between prints:

- **stairs** (the ladder trials): the stance is 10 cm or more higher or lower than the one before.
- **running**: the foot moves (faster than 0.5 m/s) in more than 0.58 of a stride that takes less than 0.95 s. On
  pyshoe-vicon the strides fall into two groups with little between them: at least 0.99 s and mostly below 0.6 of it
  in motion, or at most 0.9 s and above; shuffling strides are short, too, but the foot rests for most of them.
  Between surveyed prints: faster than 2.3 m/s; from 1.7 m/s on it may be either, and has no label.
- **crawling**: two trials by name. Their sensor's z axis points up while the foot rests (toes down, heel up; in all
  the other trials it points down), and in the truth no stride lifts the foot by more than 11 cm.
- **walking**: every other stride of 15 cm or more; shuffling, side steps and backward included.
"""

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import savgol_filter

from bootprint.messages import MotionClass
from proving_ground.evaluation.alignment import FloatArray, interpolated, is_dense
from sensor_gateway.recordings.run import Truth

if TYPE_CHECKING:
    from pdr_engine.foot import FootStepEstimate

Label = tuple[MotionClass, MotionClass]  # true, told
CRAWLED = ("2018-02-22-10-08-52", "2018-02-22-10-10-29")
STRIDE_M, RISER_M = 0.15, 0.10
MOVING_M_S, SWING_AT_LEAST_S = 0.5, 0.15
RUN_PERIOD_S, RUN_SHARE = 0.95, 0.58
WALKED_M_S, RAN_M_S = 1.7, 2.3
_SAME_STANCE_S = 0.35
_SMOOTHED = 11  # samples of the truth's derivative


def labelled(run: str, truth: Truth, steps: Sequence["FootStepEstimate"]) -> list[Label]:
    """True and told class of every stride that the truth tells of; step times are seconds of the truth in ns."""
    true = _by_capture(run, truth, steps) if is_dense(truth) else _by_survey(truth, steps)
    return [(label, step.motion) for label, step in zip(true, steps, strict=True) if label is not None]


def confusion(labels: Iterable[Label]) -> Counter[Label]:
    """How often each true class was told as each class."""
    return Counter(labels)


def _times_s(steps: Sequence["FootStepEstimate"]) -> FloatArray:
    """Start and end of each step, (n, 2)."""
    return np.array([(step.start_time_ns, step.time_ns) for step in steps]).reshape(-1, 2) * 1e-9


def _by_capture(run: str, truth: Truth, steps: Sequence["FootStepEstimate"]) -> list[MotionClass | None]:
    times = _times_s(steps)
    ends = [interpolated(times[:, k], truth.time_s, truth.position_m) for k in (0, 1)]
    running = _running_spans(truth)
    return [
        _captured(run, moved, any(a < step.time_ns * 1e-9 - 0.5 * step.stance_s <= b for a, b in running))
        for moved, step in zip(ends[1] - ends[0], steps, strict=True)
    ]


def _captured(run: str, moved_m: FloatArray, runs: bool) -> MotionClass | None:
    if math.hypot(*moved_m) < STRIDE_M and abs(moved_m[2]) < RISER_M:
        return None
    if run in CRAWLED:
        return "crawling"
    if abs(moved_m[2]) >= RISER_M:
        return "stairs"
    return "running" if runs else "walking"


def _running_spans(truth: Truth) -> list[tuple[float, float]]:
    """From the start of a swing to that of the next, s, where the two are a running stride."""
    interval_s = float(np.median(np.diff(truth.time_s)))
    velocity = savgol_filter(truth.position_m, _SMOOTHED, 2, deriv=1, delta=interval_s, axis=0)
    moving = np.linalg.norm(velocity, axis=1) > MOVING_M_S
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(np.int8)))
    swings = [
        (float(truth.time_s[a]), float(truth.time_s[b - 1]))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        if truth.time_s[b - 1] - truth.time_s[a] > SWING_AT_LEAST_S
    ]
    return [
        (start, following)
        for (start, end), (following, _) in itertools.pairwise(swings)
        if following - start < RUN_PERIOD_S and end - start > RUN_SHARE * (following - start)
    ]


def _by_survey(truth: Truth, steps: Sequence["FootStepEstimate"]) -> list[MotionClass | None]:
    """By the speed between surveyed footprints that belong to a step's two stances."""
    labels: list[MotionClass | None] = []
    for start_s, end_s in _times_s(steps):
        near = [int(np.abs(truth.time_s - time_s).argmin()) for time_s in (start_s, end_s)]
        off_s = np.abs(truth.time_s[near] - (start_s, end_s)).max()
        if off_s > _SAME_STANCE_S or near[0] == near[1]:
            labels.append(None)
            continue
        way_m = float(np.linalg.norm(np.diff(truth.position_m[near, :2], axis=0)))
        labels.append(_surveyed(way_m / (end_s - start_s)))
    return labels


def _surveyed(speed_m_s: float) -> MotionClass | None:
    if speed_m_s < WALKED_M_S:
        return "walking"
    return "running" if speed_m_s > RAN_M_S else None
