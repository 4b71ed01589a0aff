"""The parts of docs/foot-ins.md on motion classes and on the covariance of each."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bootprint.messages import MotionClass
from proving_ground.evaluation.consistency import Consistency
from proving_ground.evaluation.evaluate import Evaluated
from proving_ground.evaluation.foot.honesty import EVEN_FROM_PCT, ClassHonesty, by_motion, judged
from proving_ground.evaluation.foot.motion_truth import STRIDE_M, Label, confusion, labelled

TOLD: tuple[MotionClass, ...] = ("walking", "running", "stairs", "crawling", "standing", "unknown")


@dataclass(frozen=True, slots=True)
class MotionFindings:
    """``labels``: of the runs with labels of even and of odd place, how often each true class was told as which.
    ``stairs``: strides of the stair recordings, which have no truth, as told. ``directions``: as told, by set.
    ``honesty``: of the covariance, by the class that runs mostly are, and by set.
    """

    labels: tuple[Counter[Label], Counter[Label]]
    stairs: Mapping[str, Counter[MotionClass]]
    directions: Mapping[str, Counter[str]]
    honesty: Mapping[MotionClass, ClassHonesty]
    sets: Mapping[str, Sequence[Consistency]]


def motion_findings(sets: Mapping[str, Sequence[Evaluated]], stairs: Sequence[Evaluated]) -> MotionFindings:
    """What the default's runs of every set, and those on stairs, say of motion."""
    known = {name: judged(runs) for name, runs in sets.items()}
    return MotionFindings(
        labels=_labels([run for runs in sets.values() for run in runs]),
        stairs={
            run.task.name: Counter(step.motion for step in run.estimate.told if _strode(step.length_m))
            for run in stairs
        },
        directions={
            name: Counter(
                step.direction or "unknown"
                for run in runs
                for step in run.estimate.told
                if _strode(step.horizontal_length_m)
            )
            for name, runs in sets.items()
        },
        honesty=by_motion([run for runs in known.values() for run in runs]),
        sets={
            name: [found for run in runs if (found := run.consistency()) is not None]
            for name, runs in known.items()
        },
    )


def _strode(length_m: float) -> bool:
    return length_m > STRIDE_M


def _labels(runs: Sequence[Evaluated]) -> tuple[Counter[Label], Counter[Label]]:
    halves: tuple[Counter[Label], Counter[Label]] = (Counter(), Counter())
    told = [run for run in runs if run.task.place in run.task.run.truth and not _elsewhere(run)]
    for number, run in enumerate(told):
        truth = run.task.run.truth[run.task.place]
        halves[number % 2].update(confusion(labelled(run.task.run.name, truth, run.estimate.told)))
    return halves


def _elsewhere(run: Evaluated) -> bool:
    """Whether the truth is of another point of the foot, which swings differently, or of one place only."""
    truth = run.task.run.truth[run.task.place]
    return truth.at_stances or bool((np.ptp(np.nan_to_num(truth.position_m), axis=0) < STRIDE_M).all())


_CLASSES = """## What kind of motion

Each step carries its motion class and, where it is known how the toes point, its direction against them
(`pdr_engine.foot.motion` tells by what). The recordings have no labels; these come from the truth alone
(`proving_ground.evaluation.foot.motion_truth`). Strides, true class by told class, runs of even place / of odd:
"""
_UNLABELLED = """The ladder is told as `stairs`, as flights of stairs are: both climb by risers, up or down by the
sign. The thresholds are rounded figures of gait, set with strides of all sets in view: neither half was kept back.
"""
_HONEST = """## Is the covariance honest?

Displacements over ten seconds against truth: the mean over runs of the share inside the 95 % ellipse, and the
share of runs with at least {least:.0f} %; NEES (2 when honest), mean / median over runs; along the displacement
(length), across it (heading) and in height (1 when honest). What all steps share (scale, slope, turn) counts as
shared. Runs belong to the class of most of their strides.
"""
_FACTORS = (
    "The factor that a class's covariance would still need, of one half of its runs, tried on the other:\n"
)
_HONEST_TITLES = [
    "runs",
    "n",
    "inside %",
    "such runs %",
    "NEES",
    "along",
    "across",
    "height",
    "height inside %",
]


def classes(findings: MotionFindings) -> str:
    """The section on motion classes."""
    lines = [_CLASSES, _header(["true", *TOLD])]
    for true in dict.fromkeys(label for half in findings.labels for label, _ in sorted(half)):
        cells = [f"{findings.labels[0][true, told]} / {findings.labels[1][true, told]}" for told in TOLD]
        lines.append(f"| {true} | {' | '.join(cells)} |")
    unlabelled = [
        *(f"- Stairs without truth, {name}: {_counts(told)}." for name, told in findings.stairs.items()),
        *(f"- Directions on {name}: {_counts(told)}." for name, told in findings.directions.items()),
    ]
    return "\n".join([*lines, "", _UNLABELLED, *unlabelled])


def _counts(counter: Counter[MotionClass] | Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counter.most_common())


def covariance(findings: MotionFindings) -> str:
    """The section on the covariance by class and set."""
    lines = [
        _HONEST.format(least=EVEN_FROM_PCT),
        _header(_HONEST_TITLES),
        *(_row(name, runs) for name, runs in findings.sets.items() if runs),
        *(_row(f"mostly {motion}", found.runs) for motion, found in findings.honesty.items()),
        _row("all", [found for runs in findings.sets.values() for found in runs]),
        "",
        _FACTORS,
        _header(["class", "of even runs", "of odd runs", "inside % with the other half's"]),
    ]
    for motion, found in findings.honesty.items():
        if found.factors is not None:
            even, odd = found.factors
            lines.append(f"| {motion} | {even:.2f} | {odd:.2f} | {found.held_out_inside_pct:.1f} |")
    return "\n".join(lines)


def _row(name: str, runs: Sequence[Consistency]) -> str:
    inside = np.array([run.inside_95_pct for run in runs])
    heights = [run.height_inside_95_pct for run in runs if run.height_inside_95_pct is not None]
    cells = [
        name,
        str(len(runs)),
        f"{inside.mean():.1f}",
        f"{100.0 * np.mean(inside >= EVEN_FROM_PCT):.0f}",
        _mean_median([run.nees for run in runs]),
        _mean_median([run.along_nees for run in runs]),
        _mean_median([run.across_nees for run in runs]),
        _mean_median([run.height_nees for run in runs if run.height_nees is not None]),
        f"{np.mean(heights):.1f}" if heights else "–",
    ]
    return f"| {' | '.join(cells)} |"


def _mean_median(values: Sequence[float]) -> str:
    return f"{np.mean(values):.2f} / {np.median(values):.2f}" if values else "–"


def _header(titles: Sequence[str]) -> str:
    return f"| {' | '.join(titles)} |\n" + "|---" * len(titles) + "|"
