"""Figures of an exercise: fused positions and pictures against truth, radio links, latency.

Recorded walks know no north, so their truth is compared after a rigid fit of yaw and offset; simulated ones are
compared as they stand. Errors are horizontal unless named otherwise. Unknown figures are None.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.geodesy import LocalFrame
from bootprint.messages import LinkReport, Position, Track
from proving_ground.evaluation.alignment import RigidFit, fit_rigid
from proving_ground.exercises.exercise import STOREY_M, Soldier
from proving_ground.exercises.observer import Heard

FloatArray = npt.NDArray[np.float64]
Row = dict[str, float | int | str | None]
_CHI2_95_2D = 5.991
_PICTURE_PERIOD_S = 1.0


@dataclass(frozen=True)
class FusedTrack:
    """A soldier's placed positions: time s since the walk's zero (n,), ENU m (n, 3), covariance m² (n, 2, 2)."""

    time_s: FloatArray
    enu_m: FloatArray
    covariance_m2: FloatArray
    floor: list[int | None]

    def at(self, time_s: FloatArray) -> FloatArray:
        """Interpolated ENU (k, 3)."""
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in self.enu_m.T])


def fused_track(positions: Sequence[Position], start_ns: int) -> FusedTrack | None:
    """The placed positions of one soldier, in time order; None if there is none."""
    placed = sorted((p for p in positions if p.mode != "unplaced"), key=lambda p: p.time_ns)
    if not placed:
        return None
    covariances = [p.covariance_m2 for p in placed]
    return FusedTrack(
        np.array([(p.time_ns - start_ns) / NS_PER_S for p in placed]),
        np.array([(p.east_m, p.north_m, p.up_m) for p in placed]),
        np.array([((c[0], c[1]), (c[1], c[3])) for c in covariances]),
        [p.floor for p in placed],
    )


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
        truth = self.soldier.truth
        return np.column_stack(
            [np.interp(self.time_s, truth.time_s, column) for column in truth.position_m.T]
        )

    def to_truth(self, horizontal_m: FloatArray) -> FloatArray:
        """Estimated (n, 2) in the truth's frame."""
        return horizontal_m if self.fit is None else self.fit.apply(horizontal_m)

    @property
    def errors_m(self) -> FloatArray:
        """Horizontal error vectors (k, 2) in the truth's frame."""
        return self.to_truth(self.track.at(self.time_s)[:, :2]) - self.truth_m[:, :2]


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
    fit = fit_rigid(track.at(time_s)[:, :2], compared.truth_m[:, :2])
    return Compared(soldier, track, time_s, fit)


def soldier_row(soldier: Soldier, compared: Compared | None) -> Row:
    """One row of ``soldiers``; figures are None when nothing could be compared.

    ``distance_m`` is the truth's path over the time that was compared.
    """
    row: Row = {"soldier": soldier.id, "distance_m": None}
    if compared is None:
        names = ("position_error_p50_m", "position_error_p95_m", "final_error_m", "height_error_p95_m")
        return row | dict.fromkeys((*names, "inside_95_pct", "floor_correct_pct"))
    error_m = np.linalg.norm(compared.errors_m, axis=1)
    return row | {
        "distance_m": float(np.linalg.norm(np.diff(compared.truth_m[:, :2], axis=0), axis=1).sum()),
        "position_error_p50_m": float(np.percentile(error_m, 50)),
        "position_error_p95_m": float(np.percentile(error_m, 95)),
        "final_error_m": float(error_m[-1]),
        "height_error_p95_m": _height_error_p95_m(compared),
        "inside_95_pct": _inside_95_pct(compared),
        "floor_correct_pct": _floor_correct_pct(compared),
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


def _floor_correct_pct(compared: Compared) -> float | None:
    if not compared.soldier.truth.has_height or all(floor is None for floor in compared.track.floor):
        return None
    height = np.interp(
        compared.track.time_s, compared.soldier.truth.time_s, compared.soldier.truth.position_m[:, 2]
    )
    on_a_floor = np.abs(height / STOREY_M - np.round(height / STOREY_M)) < 0.1  # not on the stairs
    true = np.round(height / STOREY_M).astype(int)
    right = [
        floor == truth
        for floor, truth, level in zip(compared.track.floor, true, on_a_floor, strict=True)
        if level
    ]
    return float(100.0 * np.mean(right)) if right else None


@dataclass(frozen=True)
class Picture:
    """A receiver's picture sampled every second of event time: errors m and ages s, pooled over soldiers."""

    against_truth_m: FloatArray
    added_m: FloatArray
    age_s: FloatArray


def sample_picture(
    tracks: Sequence[tuple[int, Track]], squad: Sequence[Compared], start_ns: int, frame: LocalFrame
) -> Picture:
    """What a receiver believed each second (constant velocity since the newest report) beside fusion and truth.

    ``tracks`` are (event time of arrival, track) as they came; seconds before a soldier's first report do not
    count.
    """
    parts = [
        _sample_soldier(
            [(at, track) for at, track in tracks if track.soldier == compared.soldier.id],
            compared,
            start_ns,
            frame,
        )
        for compared in squad
    ]
    return Picture(*(np.concatenate([part[k] for part in parts] or [np.empty(0)]) for k in range(3)))


def _sample_soldier(
    tracks: Sequence[tuple[int, Track]], compared: Compared, start_ns: int, frame: LocalFrame
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Error against truth (n,), error against the sender's fusion (n,) and age (n,) of one soldier's picture."""
    if not tracks:
        return np.empty(0), np.empty(0), np.empty(0)
    arrival_s = np.array([(at - start_ns) / NS_PER_S for at, _ in tracks])
    stamp_s = np.array([(track.time_ns - start_ns) / NS_PER_S for _, track in tracks])
    place_m = np.array([_horizontal(track, frame) for _, track in tracks])
    velocity_m_s = np.array([(track.east_velocity_m_s, track.north_velocity_m_s) for _, track in tracks])
    first, last = compared.time_s[0], compared.time_s[-1]
    seconds = np.arange(max(first, arrival_s[0]), last, _PICTURE_PERIOD_S)
    newest = np.searchsorted(arrival_s, seconds, side="right") - 1
    age_s = seconds - stamp_s[newest]
    believed_m = place_m[newest] + age_s[:, None] * velocity_m_s[newest]
    truth = compared.soldier.truth
    true_m = np.column_stack([np.interp(seconds, truth.time_s, truth.position_m[:, axis]) for axis in (0, 1)])
    fused_m = compared.track.at(seconds)[:, :2]
    return (
        np.linalg.norm(compared.to_truth(believed_m) - true_m, axis=1),
        np.linalg.norm(believed_m - fused_m, axis=1),
        age_s,
    )


def reported_places(tracks: Sequence[tuple[int, Track]], soldier: str, frame: LocalFrame) -> FloatArray:
    """Where a receiver was told a soldier to be, ENU (n, 2)."""
    places = [_horizontal(track, frame) for _, track in tracks if track.soldier == soldier]
    return np.array(places, dtype=np.float64).reshape(-1, 2)


def _horizontal(track: Track, frame: LocalFrame) -> tuple[float, float]:
    height_m = frame.origin.height_m if track.height_m is None else track.height_m
    east_m, north_m, _ = frame.to_enu(track.latitude_deg, track.longitude_deg, height_m)
    return east_m, north_m


def picture_row(receiver: str, picture: Picture) -> Row:
    """One row of ``pictures``: a receiver's errors and ages, 95th percentiles."""

    def p95(values: FloatArray) -> float | None:
        return float(np.percentile(values, 95)) if values.size else None

    return {
        "receiver": receiver,
        "picture_error_p95_m": p95(picture.against_truth_m),
        "added_error_p95_m": p95(picture.added_m),
        "age_p95_s": p95(picture.age_s),
        "samples": int(picture.age_s.size),
    }


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


def latency_p99_ms(heard: Sequence[Heard]) -> float | None:
    """99th percentile of host time from a position's event time to the soldier's own track, over all soldiers."""
    latencies = [latency for computer in heard for latency in computer.latency_s]
    return float(1000.0 * np.percentile(latencies, 99)) if latencies else None
