"""What became of each fault: who was gone for how long, and when the command post's picture was right again.

A picture is right when everybody in it is shown as fresh and within ten metres of where they are. It is honest when
who is not within ten metres is at least inside the doubt that a display shows: what nobody measured, nobody can
show. It is right (honest) *again* at the first moment after a fault's end from which on it stays so for three
seconds; a second earlier it may have been so by luck.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.display import RADIUS_95
from bootprint.prediction import reaches_s
from proving_ground.exercises.exercise import Exercise, Fault
from proving_ground.exercises.faults.process_faults import Outage
from proving_ground.exercises.faults.storm import NEXT_AFTER_S, over_at_s
from proving_ground.exercises.scoring.heard import FloatArray, Heard
from proving_ground.exercises.scoring.picture import FALSE_M
from proving_ground.exercises.scoring.score import Row, truth_at

Right = npt.NDArray[np.bool_]
_PERIOD_S: Final = 0.5
_STEADY_S: Final = 3.0


def fault_rows(
    exercise: Exercise,
    heard: Mapping[str, Heard],
    outages: Sequence[Outage],
    start_ns: int,
    lasted_s: float,
    stale_s: float,
) -> list[Row]:
    """A row for each fault that was over in time to be judged."""
    post = exercise.command_post
    seconds = np.arange(0.0, lasted_s, _PERIOD_S)
    right, honest = _right_and_honest(exercise, heard[post], start_ns, seconds, stale_s)
    faults = [fault for fault in exercise.faults if over_at_s(fault) + NEXT_AFTER_S / 2 < lasted_s]
    missing = {name: _missing_s(heard[name], start_ns) for name in (one.id for one in exercise.soldiers)}
    return [
        {
            "at_s": fault.at_s,
            "fault": fault.kind,
            "target": fault.target,
            "details": ", ".join(f"{key} {value}" for key, value in fault.details.items()),
            "down_s": _down_s(fault, outages),
            "wrong_s": _wrong_s(seconds, right, fault),
            "right_after_s": _again_after_s(seconds, right, over_at_s(fault)),
            "honest_after_s": _again_after_s(seconds, honest, over_at_s(fault)),
            "positions_missing": _count(missing.get(fault.target), fault),
        }
        for fault in faults
    ]


def _right_and_honest(
    exercise: Exercise, post: Heard, start_ns: int, seconds: FloatArray, stale_s: float
) -> tuple[Right, Right]:
    """Whether the picture was right, and whether it was honest, (n,) each; of all soldiers but the post's own."""
    right, honest = (np.ones(seconds.size, dtype=bool) for _ in range(2))
    for soldier in exercise.soldiers:
        if soldier.id == exercise.command_post:
            continue
        log = post.reports.get(soldier.id)
        if log is None or not len(log):
            return np.zeros_like(right), np.zeros_like(right)
        told = log.told(start_ns)
        newest = np.searchsorted(told.arrived_s, seconds, side="right") - 1
        known = newest >= 0
        age_s = np.where(known, seconds - told.stamp_s[newest], 0.0)
        believed = told.place_m[newest] + reaches_s(age_s)[:, None] * told.velocity_m_s[newest]
        off_m = np.linalg.norm(believed - truth_at(soldier.truth, seconds)[:, :2], axis=1)
        sigma_m = [told.sigma_m(int(at), float(age)) for at, age in zip(newest, age_s, strict=True)]
        fresh = known & (age_s < stale_s)
        right &= fresh & (off_m <= FALSE_M)
        honest &= fresh & (off_m <= np.maximum(FALSE_M, RADIUS_95 * np.array(sigma_m)))
    return right, honest


def _again_after_s(seconds: FloatArray, right: Right, over_s: float) -> float | None:
    """Seconds from a fault's end until the picture is so and stays so; None if not before the next."""
    steady = int(_STEADY_S / _PERIOD_S)
    for index in np.flatnonzero((seconds >= over_s) & (seconds < over_s + NEXT_AFTER_S)):
        if right[index : index + steady].all():
            return float(max(0.0, seconds[index] - over_s))
    return None


def _wrong_s(seconds: FloatArray, right: Right, fault: Fault) -> float:
    """For how long it was wrong from the fault's beginning to the next one's."""
    during = (seconds >= fault.at_s) & (seconds < over_at_s(fault) + NEXT_AFTER_S)
    return float(_PERIOD_S * np.count_nonzero(during & ~right))


def _down_s(fault: Fault, outages: Sequence[Outage]) -> float | None:
    """The longest that a process was gone by it, host s; infinite if one did not come back, None if none was."""
    gone = [
        np.inf if one.back_s is None else one.back_s - one.gone_s for one in outages if one.fault is fault
    ]
    return float(max(gone)) if gone else None


def _missing_s(heard: Heard, start_ns: int) -> FloatArray:
    """Times (s) of the positions that were never told, of the grid that the others lie on."""
    told = np.unique(np.array([position.time_ns for position in heard.positions], dtype=np.int64))
    if told.size < 3:
        return np.empty(0)
    period_ns = int(np.median(np.diff(told)))
    grid = np.arange(told[0], told[-1], period_ns)
    return (np.setdiff1d(grid, told) - start_ns) / NS_PER_S


def _count(missing_s: FloatArray | None, fault: Fault) -> int:
    if missing_s is None:
        return 0
    return int(np.count_nonzero((missing_s >= fault.at_s) & (missing_s < over_at_s(fault) + NEXT_AFTER_S)))


def storm_summary(rows: Sequence[Mapping[str, Any]], outages: Sequence[Outage]) -> Row:
    """All faults in a row: what the worst of each figure was."""
    downs = [np.inf if one.back_s is None else one.back_s - one.gone_s for one in outages]
    after, honest = (
        [np.inf if row[name] is None else row[name] for row in rows]
        for name in ("right_after_s", "honest_after_s")
    )
    return {
        "faults": len(rows),
        "outages": len(downs),
        "down_s_worst": float(max(downs, default=0.0)),
        "right_after_s_median": float(np.median(after)) if after else None,
        "right_after_s_worst": float(max(after, default=0.0)),
        "not_right_within_10_s": sum(each > 10.0 for each in after),
        "not_honest_within_10_s": sum(each > 10.0 for each in honest),
        "positions_missing": sum(int(row["positions_missing"]) for row in rows),
    }
