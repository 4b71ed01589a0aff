"""Figures of an exercise at the soldiers: foot steps alone and fused positions against the truth, radio links.

Recorded walks know no north, so their truth is compared after a rigid fit of yaw and offset; simulated ones are
compared as they stand. Errors are horizontal unless named otherwise. Unknown figures are None.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.messages import LinkReport, Position
from proving_ground.evaluation.alignment import RigidFit, fit_rigid, interpolated
from proving_ground.exercises.exercise import Exercise, Soldier
from sensor_gateway.recordings.run import Truth

FloatArray = npt.NDArray[np.float64]
Row = dict[str, float | int | str | None]
_CHI2_95_2D = 5.991
_ON_A_FLOOR_M = 0.3  # further from every floor's height a soldier is on the stairs


@dataclass(frozen=True)
class FusedTrack:
    """A soldier's placed positions: time s since the walk's zero (n,), ENU m (n, 3), covariance m² (n, 2, 2)."""

    time_s: FloatArray
    enu_m: FloatArray
    covariance_m2: FloatArray
    floor: list[int | None]

    def at(self, time_s: FloatArray) -> FloatArray:
        """Interpolated ENU (k, 3)."""
        return interpolated(time_s, self.time_s, self.enu_m)


def fused_track(positions: Sequence[Position], start_ns: int) -> FusedTrack | None:
    """The placed positions of one soldier, in time order, each as it was told first; None if there is none."""
    told: dict[int, Position] = {}
    for position in positions:
        if position.mode != "unplaced":
            told.setdefault(position.time_ns, position)
    if not told:
        return None
    placed = [told[time_ns] for time_ns in sorted(told)]
    covariances = [p.covariance_m2 for p in placed]
    return FusedTrack(
        np.array([(p.time_ns - start_ns) / NS_PER_S for p in placed]),
        np.array([(p.east_m, p.north_m, p.up_m) for p in placed]),
        np.array([((c[0], c[1]), (c[1], c[3])) for c in covariances]),
        [p.floor for p in placed],
    )


def truth_at(truth: Truth, time_s: FloatArray) -> FloatArray:
    """The true places (k, 3), NaN heights where unknown."""
    return interpolated(time_s, truth.time_s, truth.position_m)


@dataclass(frozen=True)
class Compared:
    """A soldier's fused track beside the truth, at the truth's times within the track."""

    soldier: Soldier
    track: FusedTrack
    time_s: FloatArray
    fit: RigidFit | None

    @property
    def truth_m(self) -> FloatArray:
        """Truth (k, 3) at the compared times, NaN heights where unknown."""
        return truth_at(self.soldier.truth, self.time_s)

    def to_truth(self, horizontal_m: FloatArray) -> FloatArray:
        """Estimated (n, 2) in the truth's frame."""
        return horizontal_m if self.fit is None else self.fit.apply(horizontal_m)

    @property
    def errors_m(self) -> FloatArray:
        """Horizontal error vectors (k, 2) in the truth's frame."""
        return self.to_truth(self.track.at(self.time_s)[:, :2]) - self.truth_m[:, :2]

    @property
    def walked_m(self) -> FloatArray:
        """How far the soldier has truly gone (k,) since the first compared time."""
        steps = np.linalg.norm(np.diff(self.truth_m[:, :2], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


def compare(soldier: Soldier, positions: Sequence[Position], start_ns: int) -> Compared | None:
    """Lay the fused track beside the truth; None while they share fewer than two times."""
    track = fused_track(positions, start_ns)
    if track is None:
        return None
    times = soldier.truth.time_s
    time_s = times[(times >= track.time_s[0]) & (times <= track.time_s[-1])]
    if time_s.size < 2:
        return None
    compared = Compared(soldier, track, time_s, None)
    if soldier.simulated:
        return compared
    return replace(compared, fit=fit_rigid(track.at(time_s)[:, :2], compared.truth_m[:, :2]))


def soldier_row(soldier: Soldier, compared: Compared | None, exercise: Exercise) -> Row:
    """One row of ``soldiers``; figures are None when nothing could be compared.

    ``distance_m`` is the truth's path over the time that was compared.
    """
    row: Row = {"soldier": soldier.id, "distance_m": None}
    if compared is None:
        names = ("position_error_p50_m", "position_error_p95_m", "final_error_m", "height_error_p95_m")
        return row | dict.fromkeys((*names, "inside_95_pct", "floor_correct_pct"))
    error_m = np.linalg.norm(compared.errors_m, axis=1)
    return row | {
        "distance_m": float(compared.walked_m[-1]),
        "position_error_p50_m": float(np.percentile(error_m, 50)),
        "position_error_p95_m": float(np.percentile(error_m, 95)),
        "final_error_m": float(error_m[-1]),
        "height_error_p95_m": _height_error_p95_m(compared),
        "inside_95_pct": _inside_95_pct(compared),
        "floor_correct_pct": _floor_correct_pct(compared, exercise),
    }


def _height_error_p95_m(compared: Compared) -> float | None:
    if not compared.soldier.truth.has_height:
        return None
    error_m = compared.track.at(compared.time_s)[:, 2] - compared.truth_m[:, 2]
    return float(np.percentile(np.abs(error_m), 95))


def _inside_95_pct(compared: Compared) -> float:
    """Share of errors inside the 95 % ellipse of the covariance of the nearest position before."""
    index = np.clip(np.searchsorted(compared.track.time_s, compared.time_s, side="right") - 1, 0, None)
    covariance = compared.track.covariance_m2[index]
    if compared.fit is not None:
        turn = compared.fit.rotation
        covariance = turn @ covariance @ turn.T
    errors = compared.errors_m
    distance2 = np.einsum("ki,kij,kj->k", errors, np.linalg.inv(covariance), errors)
    return float(100.0 * np.mean(distance2 <= _CHI2_95_2D))


def _floor_correct_pct(compared: Compared, exercise: Exercise) -> float | None:
    if all(floor is None for floor in compared.track.floor):
        return None
    told = np.array([np.nan if floor is None else floor for floor in compared.track.floor])
    return floor_correct_pct(told, compared.track.time_s, compared.soldier.truth, exercise)


def true_floors(truth: Truth, time_s: FloatArray, exercise: Exercise) -> FloatArray:
    """The level (n,) a soldier is on at these times; NaN between floors or where heights are unknown."""
    if not truth.has_height:
        return np.full(time_s.size, np.nan)
    height_m = np.interp(time_s, truth.time_s, truth.position_m[:, 2])
    floors = exercise.floors(height_m)
    level_m = np.array([exercise.storeys_m[int(floor)] for floor in floors])
    return np.where(np.abs(height_m - level_m) < _ON_A_FLOOR_M, floors, np.nan)


def floor_correct_pct(told: FloatArray, time_s: FloatArray, truth: Truth, exercise: Exercise) -> float | None:
    """Share of told floors (n,) that are true, of the times when the soldier is on a floor; None if never."""
    true = true_floors(truth, time_s, exercise)
    known = np.isfinite(true)
    return float(100.0 * np.mean(told[known] == true[known])) if known.any() else None


def link_row(computer: str, report: LinkReport, duration_s: float) -> Row:
    """One row of ``links``: what one computer put on one link, averaged over the exercise."""
    return {
        "link": f"{computer}/{report.link}",
        "bits_per_s": 8.0 * report.bytes_sent / duration_s,
        "budget_bits_per_s": report.budget_bits_per_s,
        "frames": report.frames_sent,
        "received": report.frames_received,
        "lost": report.frames_lost,
    }
