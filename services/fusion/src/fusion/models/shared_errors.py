"""What a foot's steps have in common, as states: a scale error, a slope, a turn (`bootprint.messages.FootStep`).

Each is a number of unit variance, times the sigma that a step names for it. With ``s``, ``q``, ``t`` the numbers,
a told step (d, Δψ) of horizontal length |d_h| and duration T was in truth

    d' = d·(1 + σ_s·s) + (0, 0, σ_q·|d_h|·q),        Δψ' = Δψ + σ_t·T·t.

So they grow with the sum of all steps, not with its root, and whatever tells where the foot really went (the other
foot, satellites) tells them too. They are first-order Gauss-Markov processes: soles and biases change slowly.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import FootStep, Vector3
from fusion.config import FeetConfig
from fusion.state import Array, Layout

_NEGLIGIBLE = 1e-12  # of what is left of a covariance: rounding


@dataclass(frozen=True, slots=True)
class Shares:
    """How much a step has of each shared error: ``per_unit`` (4, 3), ∂(forward, left, up, turn)/∂(s, q, t)."""

    per_unit: Array

    def corrected(self, step: FootStep, numbers: Array) -> tuple[Vector3, float]:
        """The step's displacement and turn without the shared errors (3,)."""
        forward, left, up, turn = (float(part) for part in self.per_unit @ numbers)
        ahead, aside, above = step.displacement_m
        return (ahead + forward, aside + left, above + up), step.heading_change_rad + turn

    def own(self, covariance: Array) -> Array | None:
        """What of the step's covariance (4, 4) is its own; None if it does not hold what it names as shared."""
        left: Array = covariance - self.per_unit @ self.per_unit.T
        lowest = float(np.linalg.eigvalsh(left)[0])
        scale = float(np.trace(covariance))
        if lowest < -1e-6 * scale - _NEGLIGIBLE:
            return None
        return left + max(0.0, -lowest) * np.eye(4)


@dataclass(frozen=True, slots=True)
class StepError:
    """A step's ``own`` covariance (4, 4) of (forward, left, up m, turn rad), and its shares of what feet share."""

    own: Array
    shares: Shares | None


def prior(layout: Layout, boots: FeetConfig) -> tuple[Array, Array]:
    """State and covariance before the first step: nothing but how feet are, and how little is known of it.

    Scale and slope of the two feet are alike (the same person, the same estimator), their turns are not.
    """
    state, covariance = np.zeros(layout.size), np.zeros((layout.size, layout.size))
    for one in layout.blocks:
        covariance[layout.compass(one), layout.compass(one)] = 1.0
        for other in layout.blocks:
            alike = boots.common_correlation
            shared = np.eye(3) if one is other else np.diag([alike, alike, 0.0])
            covariance[one.common, other.common] = shared
    state[layout.width] = boots.width_m
    covariance[layout.width, layout.width] = boots.width_sigma_m**2
    return state, covariance


def shares_of(step: FootStep) -> Shares | None:
    """The step's shares; None if it does not name all its shared errors."""
    sigmas = (step.common_scale_sigma, step.common_slope_sigma, step.common_turn_sigma_rad_s)
    if None in sigmas:
        return None
    scale, slope, turn = (float(sigma or 0.0) for sigma in sigmas)
    per_unit = np.zeros((4, 3))
    per_unit[:3, 0] = scale * np.array(step.displacement_m)
    per_unit[2, 1] = slope * math.hypot(*step.displacement_m[:2])
    per_unit[3, 2] = turn * max(0, step.time_ns - step.start_time_ns) / 1e9
    return Shares(per_unit)


def kept(duration_s: float, lifetime_s: float) -> float:
    """The share of a shared error that is still the same after so long."""
    return math.exp(-max(0.0, duration_s) / lifetime_s)
