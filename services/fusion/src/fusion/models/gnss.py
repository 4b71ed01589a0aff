"""What a satellite fix says about the body's position, and how much of it is new.

A receiver's errors live for tens of seconds, so fixes a second apart repeat each other. For a first-order
Gauss-Markov error of time constant τ, the mean of many samples every Δt has the variance of white noise of
variance ``σ²·2τ/Δt``: that is what an update takes as its noise. The gate takes σ² itself, for the size of one
innovation does not depend on its neighbours.
"""

import numpy as np

from bootprint.messages import GnssFix
from fusion.config import GnssConfig
from fusion.state import Array

_NO_POSITION = ("none", "dead_reckoning")  # the receiver's own dead reckoning would be counted twice
_SHORTEST_S = 0.01  # receivers are no faster; keeps fixes of one instant finite


def has_position(fix: GnssFix) -> bool:
    """Whether the fix comes from satellites and has a place."""
    return fix.fix_kind not in _NO_POSITION and fix.latitude_deg is not None and fix.longitude_deg is not None


def horizontal_sigma_m(fix: GnssFix, config: GnssConfig) -> float | None:
    """One sigma of each horizontal axis, m: the receiver's own figure, else HDOP times UERE, else None.

    A stated horizontal accuracy counts whole for each axis, which is conservative by up to √2. One that is beyond
    the range of fixes is none.
    """
    if fix.horizontal_accuracy_m is not None:
        return _believable(fix.horizontal_accuracy_m, config.accuracy_floor_m, config)
    if fix.hdop is not None and fix.hdop > 0.0:
        return _believable(fix.hdop * config.uere_m, config.accuracy_floor_m, config)
    return None


def _believable(sigma_m: float, floor_m: float, config: GnssConfig) -> float | None:
    return max(sigma_m, floor_m) if sigma_m <= 1000.0 * config.max_range_km else None


def vertical_sigma_m(fix: GnssFix, config: GnssConfig) -> float | None:
    """One sigma of the height, m; None if height or its accuracy is unknown."""
    if fix.height_m is None or fix.vertical_accuracy_m is None:
        return None
    return _believable(fix.vertical_accuracy_m, config.vertical_floor_m, config)


def correlation_inflation(since_last_s: float, moved_m: float, config: GnssConfig) -> float:
    """Factor on σ² for an update so long after the last one, and so far from there: ``max(1, 2τ/Δt)``.

    Reflections belong to the place. Who stands hears the same ones again and again, until satellites have moved on:
    there the share of news is that of the way, or of the sky's turning, if that is less.
    """
    by_place = moved_m / config.reflection_m + since_last_s / config.standing_correlation_s
    news = min(max(since_last_s, _SHORTEST_S) / max(config.correlation_s, _SHORTEST_S), by_place)
    return max(1.0, 2.0 / max(news, _SHORTEST_S / config.standing_correlation_s))


def noise(horizontal_m: float, vertical_m: float | None) -> Array:
    """Covariance (3, 3), or (2, 2) without height, of one fix, m²."""
    sigmas = [horizontal_m, horizontal_m] if vertical_m is None else [horizontal_m, horizontal_m, vertical_m]
    return np.diag(np.square(sigmas))
