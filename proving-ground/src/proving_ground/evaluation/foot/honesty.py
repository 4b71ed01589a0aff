"""Is the steps' covariance honest for every kind of motion? NEES by motion class, and what a factor would mend.

The factor by which a class's covariance would have to grow, for 95 % of its runs' ten-second displacements to lie
inside their ellipse on average, is found on one half of the runs and tried on the other. Near 1: the published
covariance is right as it is.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bootprint.messages import MotionClass
from proving_ground.evaluation.consistency import Consistency, StepChain, consistency
from proving_ground.evaluation.evaluate import Evaluated
from sensor_gateway.recordings.run import Truth

WANTED_PCT = 95.0
EVEN_FROM_PCT = 85.0  # a run is in order from here on
_BISECTIONS = 12
_LARGEST_LOG = 3.0


@dataclass(frozen=True, slots=True)
class Judged:
    """One foot's run: how it mostly moved, its steps, and the truth they are held against."""

    name: str
    motion: MotionClass
    steps: StepChain
    truth: Truth

    def consistency(self, factor: float = 1.0) -> Consistency | None:
        """Of the covariance times ``factor``; None if the run is too short."""
        return consistency(widened(self.steps, factor), self.truth, float("inf"))


@dataclass(frozen=True, slots=True)
class ClassHonesty:
    """What the runs of one class show.

    ``factors``: of the two halves; ``held_out_inside_pct``: the share inside when each is tried on the other half.
    Both None for a class with one run.
    """

    runs: Sequence[Consistency]
    factors: tuple[float, float] | None
    held_out_inside_pct: float | None


def judged(runs: Sequence[Evaluated]) -> list[Judged]:
    """Those of the evaluated feet whose truth is long enough to tell."""
    found = []
    for run in runs:
        truth = run.task.run.truth_of(run.task.place)
        if truth is None or run.estimate.steps is None or run.row["nees"] is None:
            continue
        found.append(Judged(run.task.name, _mostly(run), run.estimate.steps, truth))
    return found


def _mostly(run: Evaluated) -> MotionClass:
    """The class of most strides."""
    moved: Counter[MotionClass] = Counter(
        step.motion for step in run.estimate.told if step.motion != "standing"
    )
    return max(moved, key=lambda motion: moved[motion], default="standing")


def widened(steps: StepChain, factor: float) -> StepChain:
    """The same steps with all variances times ``factor``."""
    sigma = float(np.sqrt(factor))
    return replace(
        steps,
        covariance=steps.covariance * factor,
        climb_variance_m2=steps.climb_variance_m2 * factor,
        common_scale=steps.common_scale * sigma,
        common_slope=steps.common_slope * sigma,
        common_turn_rad_s=steps.common_turn_rad_s * sigma,
    )


def mean_inside_pct(runs: Sequence[Judged], factor: float = 1.0) -> float:
    """The share inside the 95 % ellipse, averaged over runs."""
    shares = [found.inside_95_pct for run in runs if (found := run.consistency(factor)) is not None]
    return float(np.mean(shares))


def factor_for(runs: Sequence[Judged]) -> float:
    """The factor with which 95 % lie inside (by bisection of its logarithm, within a factor of twenty)."""
    low, high = -_LARGEST_LOG, _LARGEST_LOG
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if mean_inside_pct(runs, float(np.exp(middle))) < WANTED_PCT:
            low = middle
        else:
            high = middle
    return float(np.exp(0.5 * (low + high)))


def by_motion(runs: Sequence[Judged]) -> Mapping[MotionClass, ClassHonesty]:
    """The honesty of every class that some run mostly is."""
    classes = dict.fromkeys(run.motion for run in runs)
    return {motion: _of_class([run for run in runs if run.motion == motion]) for motion in classes}


def _of_class(runs: Sequence[Judged]) -> ClassHonesty:
    known = [found for run in runs if (found := run.consistency()) is not None]
    halves = (runs[::2], runs[1::2])
    if not halves[1]:
        return ClassHonesty(known, None, None)
    factors = (factor_for(halves[0]), factor_for(halves[1]))
    tried = [
        mean_inside_pct(half, factor) * len(half)
        for half, factor in zip(halves, reversed(factors), strict=True)
    ]
    return ClassHonesty(known, factors, sum(tried) / len(runs))
