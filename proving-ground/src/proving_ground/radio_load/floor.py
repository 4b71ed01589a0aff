"""How few bits a second any code could do with: the rate-distortion function of a walk.

A walker's velocity is taken as Brownian motion of intensity q (m²/s³): E[(v(t+τ) − v(t))²] = q τ on each axis. The
place is its integral, with power spectral density S(ω) = q/ω⁴. Reverse water-filling (Kolmogorov 1956; Cover and
Thomas, Elements of Information Theory, chapter 10) gives for a water level θ, with ω_c = (q/θ)^¼ where S meets it,

    D(θ) = 1/(2π) ∫ min(θ, S) dω       = (θ ω_c + q/(3 ω_c³))/π  = 4 q/(3 π ω_c³)
    R(θ) = 1/(2π) ∫ max(0, ½ log₂ S/θ) dω = (2/π) ∫₀^ω_c log₂(ω_c/ω) dω = 2 ω_c/(π ln 2)

so that R(D) = 2/(π ln 2) · (4 q/(3 π D))^⅓ bits a second for one axis, D the mean squared error on it. A Gaussian
error of variance D on both axes has its 95th percentile at 2.45 √D. The bound lets a code wait as long as it likes
and look at both sides of a moment; who must speak before knowing what comes next needs more.
"""

import math
from typing import Final

import numpy as np

from proving_ground.radio_load.others_squad import smoothed
from proving_ground.radio_load.squad_tracks import SquadTracks
from proving_ground.radio_load.telling import PERIOD_S, FloatArray

P95_OF_SIGMA: Final = math.sqrt(-2.0 * math.log(0.05))
"""95th percentile of a circular Gaussian error's size, in its sigmas."""
_AXES: Final = 2
_LAGS_S: Final = np.geomspace(1.0, 60.0, 25)


def variance_of_p95_m2(error_p95_m: float) -> float:
    """The mean squared error on one axis of a circular Gaussian error with this 95th percentile."""
    return (error_p95_m / P95_OF_SIGMA) ** 2


def corner_rad_s(intensity_m2_s3: float, variance_m2: float) -> float:
    """ω_c: slower motion is told, faster motion is not."""
    return math.cbrt(4.0 * intensity_m2_s3 / (3.0 * math.pi * variance_m2))


def floor_bits_per_s(error_p95_m: float, intensity_m2_s3: float) -> float:
    """The floor for one soldier, both axes."""
    corner = corner_rad_s(intensity_m2_s3, variance_of_p95_m2(error_p95_m))
    return _AXES * 2.0 * corner / (math.pi * math.log(2.0))


def intensity_m2_s3(velocity_m_s: FloatArray, lag_s: float) -> float:
    """q of velocities (n, T, 2) told every `PERIOD_S`, from their differences over a lag."""
    steps = max(1, round(lag_s / PERIOD_S))
    change = velocity_m_s[:, steps:] - velocity_m_s[:, :-steps]
    return float(np.mean(change**2) / (steps * PERIOD_S))


def squad_floor_bits_per_s(tracks: SquadTracks, error_p95_m: float) -> float:
    """The floor for a squad: q is taken at the time scale 1/ω_c that this error asks to be told.

    People do not walk by Brownian motion: over a long time velocity returns, so that q depends on the lag.
    """
    velocity = np.stack([smoothed(one) for one in tracks.velocity_m_s])
    variance = variance_of_p95_m2(error_p95_m)
    lags = [lag for lag in _LAGS_S.tolist() if lag < 0.5 * tracks.duration_s]
    found = [(intensity_m2_s3(velocity, lag), lag) for lag in lags]
    intensity, _ = min(found, key=lambda pair: abs(math.log(pair[1] * corner_rad_s(pair[0], variance))))
    return tracks.soldiers * floor_bits_per_s(error_p95_m, intensity)
