"""Laying an estimated track over the truth: which points are compared, and the rigid fit of yaw and offset.

A foot's dead reckoning knows neither where it starts nor which way it faces, so both are fitted; scale and shape
are not.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from sensor_gateway.recordings.run import Truth

FloatArray = npt.NDArray[np.float64]
Align = Literal["best-fit", "start"]
START_M = 5.0
# Motion capture trembles by a millimetre at every sample: path length is summed no finer than this.
PATH_INTERVAL_S = 0.05
# A truth denser than this follows the foot through its swing; a sparser one is a list of way-points.
DENSE_INTERVAL_S = 0.101  # cameras' poses come at 10 Hz
_STILL_M_S, _STILL_SPAN_S, _STILL_AT_LEAST_S = 0.15, 0.05, 0.05
_STRIDE_AT_LEAST_M = 0.15
_OUTSIDE_S = 0.2
_SAME_PLACE_M = 1e-3


@dataclass(frozen=True, slots=True)
class Track:
    """An estimate: ``time_s`` (n,) rising, ``position_m`` (n, 3), z up."""

    time_s: FloatArray
    position_m: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """Positions at these times, (k, 3), linear between samples and constant beyond the ends."""
        return interpolated(time_s, self.time_s, self.position_m)


@dataclass(frozen=True, slots=True)
class RigidFit:
    """``truth ≈ R(yaw_rad) · estimate + offset_m`` in the plane; yaw counter-clockwise."""

    yaw_rad: float
    offset_m: FloatArray

    @property
    def rotation(self) -> FloatArray:
        """R, (2, 2)."""
        cosine, sine = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return np.array([[cosine, -sine], [sine, cosine]])

    def apply(self, position_m: FloatArray) -> FloatArray:
        """Estimated positions (n, 2 or more) in the truth's frame, (n, 2)."""
        return np.asarray(position_m[:, :2] @ self.rotation.T + self.offset_m)


@dataclass(frozen=True, slots=True)
class Compared:
    """Truth and estimate at the same times: ``time_s`` (k,), ``truth_m`` and ``estimate_m`` (k, 3)."""

    time_s: FloatArray
    truth_m: FloatArray
    estimate_m: FloatArray


def interpolated(time_s: FloatArray, at_s: FloatArray, values: FloatArray) -> FloatArray:
    """Columns of ``values`` (n, m), known at ``at_s`` (n,), linearly at ``time_s`` (k,): (k, m)."""
    return np.column_stack([np.interp(time_s, at_s, column) for column in values.T])


def compare(track: Track, truth: Truth) -> Compared:
    """The points at which track and truth are compared: all of the truth's, or only its stances."""
    points = stances(truth) if truth.at_stances else truth
    inside = (points.time_s >= track.time_s[0] - _OUTSIDE_S) & (
        points.time_s <= track.time_s[-1] + _OUTSIDE_S
    )
    known = inside & np.isfinite(points.position_m[:, :2]).all(axis=1)
    time_s = points.time_s[known]
    return Compared(time_s, points.position_m[known], track.at(time_s))


def stances(truth: Truth) -> Truth:
    """The middle of every stance of a dense truth of a foot."""
    middles = [(first + last) // 2 for first, last in _still_episodes(truth)]
    return Truth(truth.time_s[middles], truth.position_m[middles], at_stances=True)


def is_dense(truth: Truth) -> bool:
    """Whether the truth follows the motion, rather than being a list of way-points."""
    return len(truth.time_s) > 2 and float(np.median(np.diff(truth.time_s))) < DENSE_INTERVAL_S


def true_strides(truth: Truth) -> int | None:
    """How many strides the truth of a foot shows: as its source counted, or as stances that moved on."""
    if truth.strides is not None:
        return truth.strides
    if not is_dense(truth):
        return None
    return count_strides(np.diff(stances(truth).position_m, axis=0))


def count_strides(displacement_m: FloatArray) -> int:
    """How many stance-to-stance displacements (n, 2 or 3) are strides and not shifts of a standing foot."""
    return int((np.linalg.norm(np.nan_to_num(displacement_m), axis=1) > _STRIDE_AT_LEAST_M).sum())


def _still_episodes(truth: Truth) -> list[tuple[int, int]]:
    """First and last index of every episode in which a dense truth hardly moves."""
    interval = float(np.median(np.diff(truth.time_s)))
    reach = max(1, round(_STILL_SPAN_S / interval / 2.0))
    position = np.nan_to_num(truth.position_m)
    before = np.maximum(np.arange(len(position)) - reach, 0)
    after = np.minimum(np.arange(len(position)) + reach, len(position) - 1)
    moved = np.linalg.norm(position[after] - position[before], axis=1)
    still = moved / (truth.time_s[after] - truth.time_s[before]) < _STILL_M_S
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    episodes = zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True)
    return [(a, b) for a, b in episodes if truth.time_s[b] - truth.time_s[a] >= _STILL_AT_LEAST_S]


def fit(compared: Compared, align: Align) -> RigidFit:
    """The rigid fit of a run: over all compared points, or those of the truth's first 5 m."""
    weights = fit_weights(compared, align)
    return fit_rigid(compared.estimate_m[:, :2], compared.truth_m[:, :2], weights)


def fit_weights(compared: Compared, align: Align) -> FloatArray:
    """The weight of each compared point in the fit, (k,); ``start`` keeps at least the first two places."""
    if align == "best-fit":
        return np.ones(len(compared.time_s))
    travelled = path_lengths(compared.truth_m[:, :2])
    second = np.argmax(travelled > _SAME_PLACE_M)
    return np.asarray(travelled <= max(START_M, travelled[second]), dtype=np.float64)


def fit_rigid(estimate_m: FloatArray, truth_m: FloatArray, weights: FloatArray | None = None) -> RigidFit:
    """Weighted least squares of yaw and offset in closed form; points (k, 2), weights (k,) or all the same.

    With both sets centred, the yaw is atan2(Σ w e × t, Σ w e · t): the planar case of Umeyama (1991) without
    scale. A truth that stays in one place has no direction: yaw 0, and the first point fixes the offset.
    """
    if is_one_place(truth_m):
        return RigidFit(0.0, truth_m[0] - estimate_m[0])
    share = np.full(len(truth_m), 1.0 / len(truth_m)) if weights is None else weights / weights.sum()
    estimate_mean, truth_mean = share @ estimate_m, share @ truth_m
    e, t = estimate_m - estimate_mean, truth_m - truth_mean
    cross = share @ (e[:, 0] * t[:, 1] - e[:, 1] * t[:, 0])
    yaw = math.atan2(float(cross), float(share @ (e * t).sum(axis=1)))
    rotated = RigidFit(yaw, np.zeros(2)).rotation @ estimate_mean
    return RigidFit(yaw, truth_mean - rotated)


def is_one_place(truth_m: FloatArray) -> bool:
    """Whether all points are the same place: a loop of which only the closing is known."""
    return bool((np.ptp(truth_m[:, :2], axis=0) < _SAME_PLACE_M).all())


def path_lengths(position_m: FloatArray) -> FloatArray:
    """Path length up to each point (k,), starting at 0."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position_m, axis=0), axis=1))])


def thinned(time_s: FloatArray, interval_s: float = PATH_INTERVAL_S) -> npt.NDArray[np.int64]:
    """Indices of points at least ``interval_s`` apart, first and last among them."""
    if len(time_s) < 2 or float(np.median(np.diff(time_s))) >= interval_s:
        return np.arange(len(time_s))
    step = max(1, round(interval_s / float(np.median(np.diff(time_s)))))
    return np.unique(np.append(np.arange(0, len(time_s), step), len(time_s) - 1))
