"""The last hop's score: what every receiver believes of everybody else, each second, beside fusion and truth.

A receiver moves a soldier on from the newest report by the rule that the hubs share (`bootprint.prediction`). It
misses a soldier of whom it has no report, or none younger than ``lost_s``; it is told something false when it shows
a soldier as fresh who is more than 10 m from there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bootprint.display import RADIUS_95
from bootprint.prediction import reaches_s
from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.scoring.heard import FloatArray, ReportLog, Told
from proving_ground.exercises.scoring.score import Compared, Row, true_floors, truth_at

_PERIOD_S = 1.0
FALSE_M = 10.0


@dataclass(frozen=True)
class Ages:
    """From which age a report is stale, and lost, s."""

    stale_s: float
    lost_s: float


@dataclass(frozen=True)
class Picture:
    """A receiver's picture sampled every second, pooled over the others; all (n,) over the samples with a report.

    ``against_truth_m`` and ``added_m`` (against what the sender's fusion said) are errors, ``age_s`` the report's
    age, ``sigma_m`` the doubt that a display shows by then, ``floor_right`` 1 or 0 (NaN on stairs or if no floor
    was told). ``expected`` counts all samples, those without any report included.
    """

    time_s: FloatArray
    against_truth_m: FloatArray
    added_m: FloatArray
    age_s: FloatArray
    sigma_m: FloatArray
    floor_right: FloatArray
    expected: int


def sample_picture(
    reports: Mapping[str, ReportLog], others: Sequence[Compared], start_ns: int, exercise: Exercise
) -> Picture:
    """What a receiver believed of each of the ``others`` at every second at which they have a fused position."""
    parts = [_sample(reports, compared, start_ns, exercise) for compared in others]
    time_s, against_truth_m, added_m, age_s, sigma_m, floor_right = (
        np.concatenate([part[0][index] for part in parts] or [np.empty(0)]) for index in range(6)
    )
    expected = sum(part[1] for part in parts)
    return Picture(time_s, against_truth_m, added_m, age_s, sigma_m, floor_right, expected)


def _sample(
    reports: Mapping[str, ReportLog], compared: Compared, start_ns: int, exercise: Exercise
) -> tuple[tuple[FloatArray, ...], int]:
    """One soldier's six columns, and how many samples there could have been."""
    seconds = np.arange(compared.time_s[0], compared.time_s[-1], _PERIOD_S)
    log = reports.get(compared.soldier.id)
    if log is None or not len(log):
        return (np.empty(0),) * 6, seconds.size
    told = log.told(start_ns)
    known = seconds[seconds >= told.arrived_s[0]]
    return _columns(told, compared, known, exercise), seconds.size


def _columns(
    told: Told, compared: Compared, seconds: FloatArray, exercise: Exercise
) -> tuple[FloatArray, ...]:
    newest = np.searchsorted(told.arrived_s, seconds, side="right") - 1
    age_s = seconds - told.stamp_s[newest]
    believed_m = told.place_m[newest] + reaches_s(age_s)[:, None] * told.velocity_m_s[newest]
    true_m = truth_at(compared.soldier.truth, seconds)[:, :2]
    fused_m = compared.track.at(seconds)[:, :2]
    floor, true_floor = told.floor[newest], true_floors(compared.soldier.truth, seconds, exercise)
    unknown = np.isnan(floor) | np.isnan(true_floor)
    return (
        seconds,
        np.linalg.norm(compared.to_truth(believed_m) - true_m, axis=1),
        np.linalg.norm(believed_m - fused_m, axis=1),
        age_s,
        np.array([told.sigma_m(index, age) for index, age in zip(newest, age_s, strict=True)]),
        np.where(unknown, np.nan, floor == true_floor),
    )


def picture_row(receiver: str, picture: Picture, ages: Ages) -> Row:
    """One row of ``pictures``: a receiver's errors and ages, and what it misses or shows wrongly."""
    known = picture.age_s < ages.lost_s
    fresh = picture.age_s < ages.stale_s
    false = fresh & (picture.against_truth_m > FALSE_M)
    inside = picture.against_truth_m <= RADIUS_95 * picture.sigma_m
    floors = picture.floor_right[np.isfinite(picture.floor_right)]
    return {
        "receiver": receiver,
        "picture_error_p50_m": _percentile(picture.against_truth_m, 50),
        "picture_error_p95_m": _percentile(picture.against_truth_m, 95),
        "added_error_p95_m": _percentile(picture.added_m, 95),
        "age_p95_s": _percentile(picture.age_s, 95),
        "inside_95_pct": _share_pct(int(inside.sum()), inside.size),
        "floor_correct_pct": _share_pct(int(floors.sum()), floors.size),
        "missing_pct": _share_pct(picture.expected - int(known.sum()), picture.expected),
        "false_pct": _share_pct(int(false.sum()), int(fresh.sum())),
        "samples": int(picture.age_s.size),
    }


def _percentile(values: FloatArray, share: int) -> float | None:
    return float(np.percentile(values, share)) if values.size else None


def _share_pct(count: int, of: int) -> float | None:
    return 100.0 * count / of if of else None
