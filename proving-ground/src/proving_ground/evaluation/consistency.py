"""Is the covariance honest? Displacements over ten seconds against truth, in units of what the estimator claims.

The steps of a run are a chain with independent errors ε_j = (δd_j, δh_j): the displacement in the heading at the
step's start and the heading change, with covariance Q_j (3, 3). To first order, with p_k the positions at the
stances, R_j the estimated heading at the start of step j and z× the rotation by +90°, the error of p_k in the
estimate's own frame is

    e_k = Σ_{j≤k} R_j δd_j + Σ_{j<k} z×(p_k − p_j) δh_j,

for a heading error made in step j turns all that follows about the end of that step. The run's fit removes an
offset and a rotation φ. The fit being least squares with weights w_k and centred positions p̃_k,

    φ = Σ_k w_k (z×p̃_k)·e_k / Σ_k w_k |p̃_k|²,

which is linear in all ε_j. What is left of the displacement from stance a to stance b after the fit is therefore

    r = e_b − e_a − φ z×(p_b − p_a) = Σ_j B_j ε_j,        Cov(r) = Σ_j B_j Q_j B_jᵀ,

with, writing ℓ = z×(p_b − p_a) for the lever,

    B_j = [R_j, z×(p_b − p_j)]  for a < j ≤ b,    [0, ℓ]  for j ≤ a,    [0, 0]  for j > b,    minus  ℓ ∂φ/∂ε_j.

So the window's own steps count, and so does the heading error it starts with, but relative to the heading that the
fit has taken away: in the middle of a run little is left of it, at its ends most. NEES = rᵀ Cov(r)⁻¹ r has mean 2
and is below 5.991 in 95 % of all windows when the covariance is honest.

Errors that all steps share are no such ε_j. A scale error s of σ_j in step j (with d_j its displacement) and a turn
at the rate b of σ_j (with T_j its duration) answer with

    g_s = Σ_j B_j (σ_j d_j, 0),        g_b = Σ_j B_j (0, σ_j T_j);

their part σ_j² d_j d_jᵀ and (σ_j T_j)² is taken out of every Q_j, and g_s g_sᵀ + g_b g_bᵀ is added to Cov(r).

Along the window's displacement r shows errors of length, across it errors of heading. Heights need no fit: the
error of a window's climb is the sum of its steps', with what they share (scale error and slope) added by size.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from proving_ground.evaluation.alignment import FloatArray, fit_rigid, interpolated, is_dense
from sensor_gateway.recordings.run import Truth

WINDOW_S = 10.0
CHI2_95_ONE = 3.841458820694124
CHI2_95_TWO = 5.991464547107979
# A way-point belongs to the stance that ended this near to it.
_SAME_STANCE_S = 0.35
# A claim of no error at all stays solvable: a micrometre.
_FLOOR_M2 = 1e-12
_FLAT_M = 1e-6  # a truth that moves no higher knows no heights
_WINDOW_AT_MOST_S = 1.5 * WINDOW_S


@dataclass(frozen=True)
class StepChain:
    """Steps of a foot, end to end, in the order of time.

    ``time_s`` (n + 1,): the first step's start, then every step's end. ``displacement_m`` (n, 2) forward and left
    in the heading at the step's start, ``heading_change_rad`` (n,), ``covariance`` (n, 3, 3) of (forward, left,
    heading), in all. Of it the steps share a scale error, ``common_scale`` of the displacement, and a turn,
    ``common_turn_rad_s`` of the duration, 1 σ each. ``climb_m`` and ``climb_variance_m2``: upwards, where the steps
    share ``common_slope`` of the horizontal length. Each of these is (n,), or one number for all.
    """

    time_s: FloatArray
    displacement_m: FloatArray
    heading_change_rad: FloatArray
    covariance: FloatArray
    common_scale: FloatArray | float = 0.0
    common_turn_rad_s: FloatArray | float = 0.0
    climb_m: FloatArray | float = 0.0
    climb_variance_m2: FloatArray | float = 0.0
    common_slope: FloatArray | float = 0.0

    @cached_property
    def common(self) -> FloatArray:
        """What each step contributes to the two errors that all share, (n, 2, 3): scale, and turn."""
        shares = np.zeros((len(self.heading_change_rad), 2, 3))
        shares[:, 0, :2] = (self.displacement_m.T * self.common_scale).T
        shares[:, 1, 2] = self.common_turn_rad_s * np.diff(self.time_s)
        return shares

    @cached_property
    def own(self) -> FloatArray:
        """The part of the covariance that is each step's own, (n, 3, 3)."""
        return np.asarray(self.covariance - np.einsum("nki,nkj->nij", self.common, self.common))

    @cached_property
    def heading_rad(self) -> FloatArray:
        """Heading at the start of each step and at the end of the last, (n + 1,), from 0."""
        return np.concatenate([[0.0], np.cumsum(self.heading_change_rad)])

    @cached_property
    def position_m(self) -> FloatArray:
        """Stance positions (n + 1, 2) in the frame of the first heading, from 0."""
        moved = np.einsum("nij,nj->ni", rotations(self.heading_rad[:-1]), self.displacement_m)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(moved, axis=0)])


@dataclass(frozen=True, slots=True)
class Consistency:
    """``nees`` is the mean over windows (2 when honest), ``inside_95_pct`` the share inside the 95 % ellipse.

    ``along_nees``, ``across_nees`` and ``height_nees`` are of one component: 1 when honest. Heights are None if the
    truth has none.
    """

    nees: float
    inside_95_pct: float
    windows: int
    along_nees: float
    across_nees: float
    height_nees: float | None
    height_inside_95_pct: float | None


@dataclass(frozen=True, slots=True)
class _Error:
    """One window's squared error over its variance: of the plane, and of its components."""

    nees: float
    along_nees: float
    across_nees: float


def rotations(angle_rad: FloatArray) -> FloatArray:
    """Rotation matrices (n, 2, 2) of angles (n,)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)


def turned(vector_m: FloatArray) -> FloatArray:
    """z × v: vectors (..., 2) turned by +90°."""
    return np.stack([-vector_m[..., 1], vector_m[..., 0]], axis=-1)


def consistency(chain: StepChain, truth: Truth, fitted_until_s: float) -> Consistency | None:
    """NEES of ten-second displacements after the run's fit; None if the run is too short for one.

    The fit is the run's, taken at the stances: of all of them, or of those until ``fitted_until_s``.
    """
    stances, truth_m = _known_stances(chain, truth)
    if len(stances) < 2:
        return None
    weights = _weights(chain, stances, truth, fitted_until_s)
    to_estimate = fit_rigid(chain.position_m[stances], truth_m, weights).rotation.T
    fit_response = _fit_response(chain, stances, weights)
    windows = _windows(chain.time_s[stances])
    if not windows:
        return None
    errors = [
        _error(chain, (stances[a], stances[b]), to_estimate @ (truth_m[b] - truth_m[a]), fit_response)
        for a, b in windows
    ]
    nees = np.array([error.nees for error in errors])
    heights = _height_nees(chain, truth, [(stances[a], stances[b]) for a, b in windows])
    return Consistency(
        nees=float(nees.mean()),
        inside_95_pct=_share_pct(nees <= CHI2_95_TWO),
        windows=len(nees),
        along_nees=float(np.mean([error.along_nees for error in errors])),
        across_nees=float(np.mean([error.across_nees for error in errors])),
        height_nees=None if heights is None else float(heights.mean()),
        height_inside_95_pct=None if heights is None else _share_pct(heights <= CHI2_95_ONE),
    )


def _share_pct(inside: npt.NDArray[np.bool_]) -> float:
    return 100.0 * float(np.mean(inside))


def _known_stances(chain: StepChain, truth: Truth) -> tuple[list[int], FloatArray]:
    """Stances (indices into the chain's times) at which the truth is known, and the truth there, (k, 2)."""
    if is_dense(truth):
        inside = (chain.time_s >= truth.time_s[0]) & (chain.time_s <= truth.time_s[-1])
        known = np.flatnonzero(inside)
        return known.tolist(), interpolated(chain.time_s[known], truth.time_s, truth.position_m[:, :2])
    nearest = np.abs(chain.time_s[:, None] - truth.time_s[None, :]).argmin(axis=0)
    near = np.abs(chain.time_s[nearest] - truth.time_s) <= _SAME_STANCE_S
    kept, first = np.unique(nearest[near], return_index=True)
    return kept.tolist(), truth.position_m[near][first, :2]


def _weights(chain: StepChain, stances: list[int], truth: Truth, fitted_until_s: float) -> FloatArray:
    """The weight of each known stance in the run's fit: its share of time under a dense truth, else one each."""
    time_s = chain.time_s[stances]
    weights = np.gradient(time_s) if is_dense(truth) else np.ones(len(stances))
    return np.where(time_s <= fitted_until_s + _SAME_STANCE_S, weights, 0.0)


def _fit_response(chain: StepChain, stances: list[int], weights: FloatArray) -> FloatArray:
    """∂φ/∂ε_j for every step, (n, 3): how the fitted rotation answers to each step's error."""
    position = chain.position_m
    weight = np.zeros(len(position))
    weight[stances] = weights
    centred = position - weight @ position / weight.sum()
    pull = weight[:, None] * turned(centred) / max(float(weight @ (centred**2).sum(axis=1)), 1e-12)
    later_pull = np.cumsum(pull[::-1], axis=0)[::-1][1:]
    later_moment = np.cumsum((pull * turned(position)).sum(axis=1)[::-1])[::-1][1:]
    by_displacement = np.einsum("nj,njk->nk", later_pull, rotations(chain.heading_rad[:-1]))
    by_heading = later_moment - (later_pull * turned(position[1:])).sum(axis=1)
    return np.column_stack([by_displacement, by_heading])


def _windows(time_s: FloatArray) -> list[tuple[int, int]]:
    """Pairs of stances about ten seconds apart, one from every stance (they overlap: more of them, same mean)."""
    ends = np.searchsorted(time_s, time_s + WINDOW_S)
    pairs = [(a, int(b)) for a, b in enumerate(ends) if b < len(time_s)]
    return [(a, b) for a, b in pairs if time_s[b] - time_s[a] <= _WINDOW_AT_MOST_S]


def _error(chain: StepChain, window: tuple[int, int], true_m: FloatArray, fit_response: FloatArray) -> _Error:
    """A window's error in units of its covariance; ``true_m`` is the true displacement in the estimate's frame."""
    a, b = window
    way = chain.position_m[b] - chain.position_m[a]
    residual = true_m - way
    covariance = displacement_covariance(chain, a, b, fit_response) + _FLOOR_M2 * np.eye(2)
    along, across = way, turned(way)
    return _Error(
        nees=float(residual @ np.linalg.solve(covariance, residual)),
        along_nees=_component_nees(residual, covariance, along),
        across_nees=_component_nees(residual, covariance, across),
    )


def _component_nees(residual: FloatArray, covariance: FloatArray, direction: FloatArray) -> float:
    """The squared component over its variance; of no direction, nothing."""
    variance = float(direction @ covariance @ direction)
    return float(residual @ direction) ** 2 / variance if variance > 0.0 else 0.0


def _height_nees(chain: StepChain, truth: Truth, windows: list[tuple[int, int]]) -> FloatArray | None:
    """Squared error of each window's climb over its variance, (k,); None if the truth has no heights."""
    if not is_dense(truth) or np.ptp(truth.position_m[:, 2]) < _FLAT_M:
        return None
    climb = np.broadcast_to(chain.climb_m, chain.heading_change_rad.shape)
    length = np.linalg.norm(chain.displacement_m, axis=1)
    shared = np.column_stack([chain.common_scale * climb, chain.common_slope * length])
    own = chain.climb_variance_m2 - (shared**2).sum(axis=1)
    true = np.interp(chain.time_s, truth.time_s, truth.position_m[:, 2])
    nees = [
        (climb[a:b].sum() - true[b] + true[a]) ** 2
        / (own[a:b].sum() + (shared[a:b].sum(axis=0) ** 2).sum() + _FLOOR_M2)
        for a, b in windows
    ]
    return np.array(nees)


def displacement_covariance(chain: StepChain, a: int, b: int, fit_response: FloatArray) -> FloatArray:
    """Cov(r), (2, 2): see the module's docstring."""
    position = chain.position_m
    lever = turned(position[b] - position[a])
    response = np.zeros((len(chain.heading_change_rad), 2, 3))
    response[a:b, :, :2] = rotations(chain.heading_rad[a:b])
    response[a:b, :, 2] = turned(position[b] - position[a + 1 : b + 1])
    response[:a, :, 2] = lever
    response -= lever[None, :, None] * fit_response[:, None, :]
    shared = np.einsum("nij,nkj->ik", response, chain.common)
    return np.asarray(np.einsum("nij,njk,nlk->il", response, chain.own, response) + shared @ shared.T)
