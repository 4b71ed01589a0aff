"""Degrees to metres and back for many soldiers at once: what senders and receivers predict by, so both do alike.

One metre per degree for the whole earth, and the cosine of the latitude that one starts from: within 0.6 % of the
ellipsoid, of the way that a soldier goes between two reports.
"""

import math
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.prediction import moved_m

FloatArray = npt.NDArray[np.float64]
Degrees = TypeVar("Degrees", float, FloatArray)
METRES_PER_DEG: Final = 40_007_863.0 / 360.0
_SMALLEST_COSINE: Final = 1e-3


def cosine(latitude_deg: float) -> float:
    """Of the latitude, never zero."""
    return max(math.cos(math.radians(latitude_deg)), _SMALLEST_COSINE)


def cosines(latitude_deg: FloatArray) -> FloatArray:
    """`cosine` of many."""
    return np.maximum(np.cos(np.radians(latitude_deg)), _SMALLEST_COSINE)


def turn_deg(difference_deg: Degrees) -> Degrees:
    """A difference of longitudes or azimuths the short way round: −180° to 180°."""
    return (difference_deg + 180.0) % 360.0 - 180.0


def moved_deg(
    latitude_deg: float, longitude_deg: float, velocity_m_s: tuple[float, float], elapsed_ns: int
) -> tuple[float, float]:
    """Where one is some time after being there with this velocity, by the rule of `bootprint.prediction`."""
    east_m, north_m = moved_m(*velocity_m_s, elapsed_ns / NS_PER_S)
    latitude = min(max(latitude_deg + north_m / METRES_PER_DEG, -90.0), 90.0)
    longitude = longitude_deg + east_m / (METRES_PER_DEG * cosine(latitude_deg))
    return latitude, turn_deg(longitude)
