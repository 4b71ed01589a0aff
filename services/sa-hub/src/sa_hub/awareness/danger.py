"""How probable it is that a friendly is where it is dangerous: within a circle, or along the line of a weapon.

Places are relative to us, east and north in metres, with one sigma for any direction: a circular normal
distribution of which ours and the friendly's errors are part.
"""

import math
from dataclasses import dataclass
from typing import Final

_LEAST_SIGMA_M: Final = 0.1
_TAIL_SIGMAS: Final = 6.0
_STRIPS: Final = 24
"""Of the circle's integral: right to 1e-3, for only strips within six sigmas of the mean are counted."""
BODY_M: Final = 2.0
"""Who stands no more than this above or below a line of fire is in its way: a man's height and its scatter."""
HEIGHT_SIGMA_M: Final = 2.0
"""Of the difference of two heights by boots and barometers; frames round to a metre beside."""
UNKNOWN_ELEVATION_RAD: Final = 0.2
"""One sigma of where a weapon may point up or down that nobody measures: slopes, windows."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a friendly is, relative to us. ``up_m`` None: a height is unknown.

    ``same_floor``: whether both are on the same floor, None where one of them has none.
    """

    east_m: float
    north_m: float
    sigma_m: float
    up_m: float | None = None
    same_floor: bool | None = None

    @property
    def distance_m(self) -> float:
        """Horizontal distance."""
        return math.hypot(self.east_m, self.north_m)


@dataclass(frozen=True, slots=True)
class Corridor:
    """What a weapon endangers: ``half_width_m`` to each side of its line, from us to ``range_m``.

    Azimuth clockwise from true north; elevation None if nobody measures it.
    """

    azimuth_rad: float
    azimuth_sigma_rad: float
    range_m: float
    half_width_m: float
    elevation_rad: float | None = None
    elevation_sigma_rad: float | None = None


def in_circle(place: Place, radius_m: float) -> float:
    """Probability that the friendly is no farther than ``radius_m`` from us, and on our level."""
    level = _on_level(place, 0.0, HEIGHT_SIGMA_M)
    return level * _disc(place.distance_m, max(place.sigma_m, _LEAST_SIGMA_M), radius_m) if level else 0.0


def in_corridor(place: Place, corridor: Corridor) -> float:
    """Probability that the friendly is in the corridor: across, along and in height.

    The weapon's angle errs by azimuth_sigma · distance across (for angles small enough that a line means anything).
    """
    sine, cosine = math.sin(corridor.azimuth_rad), math.cos(corridor.azimuth_rad)
    along_m = place.east_m * sine + place.north_m * cosine
    across_m = place.east_m * cosine - place.north_m * sine
    sigma_m = max(place.sigma_m, _LEAST_SIGMA_M)
    across_sigma_m = math.hypot(sigma_m, along_m * corridor.azimuth_sigma_rad)
    across = _within(across_m, across_sigma_m, -corridor.half_width_m, corridor.half_width_m)
    along = _within(along_m, sigma_m, 0.0, corridor.range_m)
    return across * along * _in_height(place, corridor, abs(along_m))


def _in_height(place: Place, corridor: Corridor, along_m: float) -> float:
    """How well the friendly's height agrees with where the line passes."""
    if corridor.elevation_rad is None:
        return _on_level(place, 0.0, math.hypot(HEIGHT_SIGMA_M, along_m * UNKNOWN_ELEVATION_RAD))
    sigma_rad = (
        UNKNOWN_ELEVATION_RAD if corridor.elevation_sigma_rad is None else corridor.elevation_sigma_rad
    )
    rise_m = along_m * math.tan(corridor.elevation_rad)
    return _on_level(place, rise_m, math.hypot(HEIGHT_SIGMA_M, along_m * sigma_rad))


def _on_level(place: Place, level_m: float, sigma_m: float) -> float:
    """How well a friendly's height agrees with a level above us: 1 within a man's height, less in the tails.

    Floors decide where both are known: between them stands a ceiling.
    """
    if place.same_floor is not None:
        return float(place.same_floor)
    if place.up_m is None:
        return 1.0
    beyond_m = abs(place.up_m - level_m) - BODY_M
    return math.erfc(max(0.0, beyond_m) / (sigma_m * math.sqrt(2.0)))


def _within(mean: float, sigma: float, low: float, high: float) -> float:
    """Probability that a normal variable lies between two bounds."""
    scale = sigma * math.sqrt(2.0)
    return 0.5 * (math.erf((high - mean) / scale) - math.erf((low - mean) / scale))


def _disc(distance_m: float, sigma_m: float, radius_m: float) -> float:
    """Probability that a circular normal variable, its mean ``distance_m`` from the centre, is in the disc.

    The non-central χ² with two degrees of freedom, as strips across the line to the mean, between radius · sin of
    equal steps: narrow at the rim, where chords shorten fastest.
    """
    low = max(-1.0, (distance_m - _TAIL_SIGMAS * sigma_m) / radius_m)
    high = min(1.0, (distance_m + _TAIL_SIGMAS * sigma_m) / radius_m)
    if low >= high:
        return 0.0
    first = math.asin(low)
    step = (math.asin(high) - first) / _STRIPS
    scale = sigma_m * math.sqrt(2.0)
    below = math.erf((radius_m * low - distance_m) / scale)
    total = 0.0
    for strip in range(_STRIPS):
        above = math.erf((radius_m * math.sin(first + (strip + 1) * step) - distance_m) / scale)
        half_chord_m = radius_m * math.cos(first + (strip + 0.5) * step)
        total += 0.5 * (above - below) * math.erf(half_chord_m / scale)
        below = above
    return total
