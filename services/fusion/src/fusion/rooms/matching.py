"""Lays a stretch of one's own walk over a map: by how much, and how surely, must it be moved to lie on it?

The stretch keeps its shape but for a turn about its end. Each shift D (2,) and turn on a grid weighs what its
prior says, N(0, C) and N(0, σ_ψ²), times the likelihood of the stretch there; neighbouring points of a walk tell
the same, so that of each ``correlation_m`` one counts. The sum of the weights is the evidence for the map against
"anywhere"; the moments of D tell what is learned.

What the look adds to the prior is a measurement of D. In the axes in which C is one, the posterior has covariance S
and mean m; along each eigenvector of S, of eigenvalue a, the measurement that would have made it so has

    noise = a/(1 − a),        value = m/(1 − a).

So along a corridor, where the prior is all that is known, nothing is told.
"""

from dataclasses import dataclass

import numpy as np

from fusion.rooms.field import RoomField
from fusion.rooms.settings import RoomsConfig
from fusion.state import Array

_REACH = 3.0  # sigmas of the prior that are searched
_LEAST_REACH_M = 3.0  # how far in any case: a map that fits better elsewhere is wrong, or the walk is
_STEP_M = 0.3
_MOST_STEPS = 30  # to either side: with a wide prior they are longer
_TURNS = np.linspace(-2.4, 2.4, 7)  # sigmas
_LEARNED = 0.8  # of the prior's variance left: more has told nothing


@dataclass(frozen=True, slots=True)
class Look:
    """What a stretch shows of the shift D that lays it on a map.

    ``rows`` (k, 2), ``values`` (k,) and ``noise`` (k,): measurements ``rows·D`` with their variances, m and m².
    ``evidence``: ln of how many times likelier the stretch is by the map where the prior has it than anywhere;
    ``elsewhere``: the same wherever it fits within reach, less the evidence.
    """

    rows: Array
    values: Array
    noise: Array
    evidence: float
    elsewhere: float

    @property
    def is_full(self) -> bool:
        """Whether both directions are told."""
        return len(self.values) == 2

    def shift(self) -> tuple[Array, Array]:
        """D (2,) and its covariance (2, 2), of a full look."""
        inverse = np.linalg.inv(self.rows)
        return inverse @ self.values, inverse @ np.diag(self.noise) @ inverse.T


def look(walk: Array, prior: Array, field: RoomField, config: RoomsConfig) -> Look:
    """Lay a walk (n, 2) m, the newest point last, over a map; ``prior`` (2, 2) m² is the covariance of D."""
    scale, axes = np.linalg.eigh(prior)
    sigma = np.sqrt(np.maximum(scale, 1e-6))
    units = [_grid(float(each)) for each in sigma]
    white = np.stack(np.meshgrid(*units, indexing="ij"), axis=-1).reshape(-1, 2)
    shifts = white * sigma @ axes.T
    likelihood = _likelihood(walk, shifts, field, config)
    turn_weight = np.exp(-0.5 * _TURNS**2)
    likelihood = np.log(np.exp(likelihood) @ (turn_weight / turn_weight.sum()))
    log_prior = -0.5 * (white**2).sum(axis=1)
    log_prior -= _log_sum(log_prior)
    posterior = likelihood + log_prior
    evidence = _log_sum(posterior)
    anywhere = _log_sum(likelihood) - np.log(len(likelihood))
    weight = np.exp(posterior - evidence)
    mean = weight @ white
    spread = (weight[:, None] * (white - mean)).T @ (white - mean)
    rows, values, noise = _told(mean, spread)
    return Look(rows / sigma @ axes.T, values, noise, float(evidence), float(anywhere - evidence))


def _grid(sigma_m: float) -> Array:
    """Shifts along an axis, in its sigmas."""
    reach = max(_REACH, _LEAST_REACH_M / sigma_m)
    half = min(int(np.ceil(reach * sigma_m / _STEP_M)), _MOST_STEPS)
    return np.linspace(-reach, reach, 2 * half + 1)


def _likelihood(walk: Array, shifts: Array, field: RoomField, config: RoomsConfig) -> Array:
    """ln of the likelihood ratio (shifts, turns)."""
    end = walk[-1]
    low, high = walk.min(axis=0) + shifts.min(axis=0), walk.max(axis=0) + shifts.max(axis=0)
    mean = max(field.mean(low, high), 1e-3)
    found = np.empty((len(shifts), len(_TURNS)))
    for number, angle in enumerate(_TURNS * config.turn_sigma_rad):
        cosine, sine = np.cos(angle), np.sin(angle)
        turned = (walk - end) @ np.array([[cosine, sine], [-sine, cosine]]) + end
        k = field.at(turned[None] + shifts[:, None])
        ratio = (1.0 - config.elsewhere) * k / mean + config.elsewhere
        found[:, number] = np.log(ratio).sum(axis=1)
    return found * min(1.0, config.spacing_m / config.correlation_m)


def _told(mean: Array, spread: Array) -> tuple[Array, Array, Array]:
    """Rows, values and noise in the prior's own axes."""
    left, vectors = np.linalg.eigh(spread)
    learned = left < _LEARNED
    left, vectors = np.clip(left[learned], 1e-4, None), vectors[:, learned]
    return vectors.T, (vectors.T @ mean) / (1.0 - left), left / (1.0 - left)


def _log_sum(values: Array) -> float:
    highest = float(values.max())
    return highest + float(np.log(np.exp(values - highest).sum()))
