"""How good a track is against truth: the columns of `bootprint evaluate`. Pure; unknown is None.

Distances are the truth's, in the plane; errors are after the run's rigid fit (`evaluation.alignment`).
"""

import math
from dataclasses import dataclass

import numpy as np

from proving_ground.evaluation.alignment import (
    Align,
    Compared,
    FloatArray,
    RigidFit,
    Track,
    compare,
    fit,
    fit_rigid,
    fit_weights,
    is_one_place,
    path_lengths,
    thinned,
)
from proving_ground.evaluation.consistency import StepChain, consistency
from sensor_gateway.recordings.run import Truth

__all__ = ["Align", "RigidFit", "Score", "Scored", "Track", "fit_rigid", "heading_drift", "score_track"]

# Directions are compared over chords at least this long, so that the sway of a single stride does not count.
CHORD_M = 1.0
_CHORDS_AT_LEAST, _CHORDS_AT_MOST = 4, 1500


@dataclass(frozen=True, slots=True)
class Score:
    """The figures of one track; None where the truth does not tell."""

    distance_m: float | None = None
    rmse_m: float | None = None
    p95_m: float | None = None
    final_m: float | None = None
    final_pct: float | None = None
    distance_error_pct: float | None = None
    height_final_m: float | None = None
    height_rmse_m: float | None = None
    heading_drift_deg_per_min: float | None = None
    inside_95_pct: float | None = None
    nees: float | None = None


@dataclass(frozen=True, slots=True)
class Scored:
    """A score with what it was computed from: the points compared and the fit (None without truth)."""

    score: Score
    compared: Compared | None = None
    fit: RigidFit | None = None

    @property
    def errors_m(self) -> FloatArray:
        """The error in the plane at each compared point, (k,)."""
        if self.compared is None or self.fit is None:
            return np.zeros(0)
        return plane_errors(self.compared, self.fit)


def score_track(
    track: Track, truth: Truth | None, align: Align = "best-fit", steps: StepChain | None = None
) -> Scored:
    """Score a track against truth; ``steps`` with their covariances add ``inside_95_pct`` and ``nees``."""
    if truth is None:
        return Scored(Score())
    compared = compare(track, truth)
    if len(compared.time_s) < 2:
        return Scored(Score())
    rigid = fit(compared, align)
    if is_one_place(compared.truth_m):
        return Scored(_loop_score(compared, rigid), compared, rigid)
    return Scored(_full_score(compared, rigid, truth, align, steps), compared, rigid)


def plane_errors(compared: Compared, rigid: RigidFit) -> FloatArray:
    """Distance between fitted estimate and truth at each compared point, (k,), in the plane."""
    return np.asarray(np.linalg.norm(rigid.apply(compared.estimate_m) - compared.truth_m[:, :2], axis=1))


def _loop_score(compared: Compared, rigid: RigidFit) -> Score:
    """Of a loop only the closing is known: how far its end is from its start."""
    return Score(
        final_m=float(plane_errors(compared, rigid)[-1]),
        height_final_m=_height_final(compared),
        height_rmse_m=_height_rmse(compared),
    )


def _full_score(
    compared: Compared, rigid: RigidFit, truth: Truth, align: Align, steps: StepChain | None
) -> Score:
    errors = plane_errors(compared, rigid)
    few = thinned(compared.time_s)
    distance = float(path_lengths(compared.truth_m[few, :2])[-1])
    estimated = float(path_lengths(compared.estimate_m[few, :2])[-1])
    fitted_until = float(compared.time_s[np.flatnonzero(fit_weights(compared, align))[-1]])
    honest = consistency(steps, truth, fitted_until) if steps is not None else None
    return Score(
        distance_m=distance,
        rmse_m=float(np.sqrt(np.mean(errors**2))),
        p95_m=float(np.percentile(errors, 95)),
        final_m=float(errors[-1]),
        final_pct=100.0 * float(errors[-1]) / distance,
        distance_error_pct=100.0 * (estimated - distance) / distance,
        height_final_m=_height_final(compared),
        height_rmse_m=_height_rmse(compared),
        heading_drift_deg_per_min=heading_drift(compared),
        inside_95_pct=honest.inside_95_pct if honest else None,
        nees=honest.nees if honest else None,
    )


def _height_final(compared: Compared) -> float | None:
    """How wrong the climb from the first point to the last is; None if the truth has no heights."""
    climb = (compared.estimate_m[-1, 2] - compared.estimate_m[0, 2]) - (
        compared.truth_m[-1, 2] - compared.truth_m[0, 2]
    )
    return abs(float(climb)) if math.isfinite(climb) else None


def _height_rmse(compared: Compared) -> float | None:
    """Of the heights where both are known, the same at the first of these points; None if there are none."""
    error = compared.estimate_m[:, 2] - compared.truth_m[:, 2]
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean((error - error[0]) ** 2))) if len(error) else None


def heading_drift(compared: Compared) -> float | None:
    """Slope over time of the angle from the true to the estimated direction of travel, °/min, ccw positive.

    Directions are of chords of at least a metre. The slope is the weighted median of the slopes of all pairs of
    chords (Theil–Sen), a pair weighing by the product of its lengths and its distance in time: a few wrong
    directions at turns do not move it. None with too few chords.
    """
    ends = _chord_ends(compared.truth_m[:, :2])
    if len(ends) <= _CHORDS_AT_LEAST:
        return None
    true = np.diff(compared.truth_m[ends, :2], axis=0)
    estimated = np.diff(compared.estimate_m[ends, :2], axis=0)
    cross = true[:, 0] * estimated[:, 1] - true[:, 1] * estimated[:, 0]
    angle = np.unwrap(np.arctan2(cross, (true * estimated).sum(axis=1)))
    time_s = (compared.time_s[ends[1:]] + compared.time_s[ends[:-1]]) / 2.0
    slope = _theil_sen(time_s, angle, weights=np.linalg.norm(true, axis=1))
    return math.degrees(slope) * 60.0


def _chord_ends(position_m: FloatArray) -> list[int]:
    """Indices of points each at least a chord from the one before."""
    ends = [0]
    for index, point in enumerate(position_m):
        if np.hypot(*(point - position_m[ends[-1]])) >= CHORD_M:
            ends.append(index)
    return ends[:: max(1, math.ceil(len(ends) / _CHORDS_AT_MOST))]


def _theil_sen(time_s: FloatArray, values: FloatArray, weights: FloatArray) -> float:
    """The weighted median of the slopes between all pairs of points."""
    first, second = np.triu_indices(len(time_s), k=1)
    apart = time_s[second] - time_s[first]
    slopes = (values[second] - values[first]) / apart
    order = np.argsort(slopes)
    cumulated = np.cumsum((weights[first] * weights[second] * apart)[order])
    return float(slopes[order][np.searchsorted(cumulated, cumulated[-1] / 2.0)])
