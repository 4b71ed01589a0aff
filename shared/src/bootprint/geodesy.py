"""WGS84 and local east-north-up: the one place that knows the earth is round."""

import math

import numpy as np
import numpy.typing as npt
import pymap3d

from bootprint.config import Origin

_TURN = 2.0 * math.pi
_SEMI_MAJOR_M = 6_378_137.0
_ECCENTRICITY_SQUARED = 6.694379990141316e-3


class LocalFrame:
    """ENU metres around an origin (WGS84, ellipsoidal height); a tangent plane, good to ~1 cm/km² of curvature."""

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        self._at = (origin.latitude_deg, origin.longitude_deg, origin.height_m)

    def to_enu(
        self, latitude_deg: float, longitude_deg: float, height_m: float
    ) -> tuple[float, float, float]:
        """Geodetic to (east, north, up) in metres."""
        east, north, up = pymap3d.geodetic2enu(latitude_deg, longitude_deg, height_m, *self._at)
        return float(east), float(north), float(up)

    def to_geodetic(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float, float]:
        """ENU metres to (latitude deg, longitude deg, ellipsoidal height m)."""
        latitude, longitude, height = pymap3d.enu2geodetic(east_m, north_m, up_m, *self._at)
        return float(latitude), float(longitude), float(height)

    def all_to_geodetic(self, enu_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Points (n, 3) ENU metres to rows of (latitude deg, longitude deg, ellipsoidal height m), at once."""
        return np.column_stack(pymap3d.enu2geodetic(*enu_m.T, *self._at)).astype(np.float64)


def wrap_angle(angle_rad: float) -> float:
    """The same angle in (−π, π]."""
    wrapped = math.pi - (math.pi - angle_rad) % _TURN
    # A tiny negative number modulo a turn rounds to the whole turn.
    return wrapped if wrapped > -math.pi else math.pi


def azimuth_of(east: float, north: float) -> float:
    """Azimuth of a direction, radians clockwise from true north, in [0, 2π)."""
    azimuth = math.atan2(east, north) % _TURN
    return azimuth if azimuth < _TURN else 0.0


def yaw_of_azimuth(azimuth_rad: float) -> float:
    """Mathematical yaw (counter-clockwise from east) of an azimuth (clockwise from north); its own inverse."""
    return wrap_angle(math.pi / 2.0 - azimuth_rad)


def ground_offset(
    from_deg: tuple[float, float], to_deg: tuple[float, float], height_m: float = 0.0
) -> tuple[float, float]:
    """(east, north) metres on the ground between two near (latitude, longitude), across the antimeridian too.

    Radii of curvature at the middle latitude: good to 1e-6 of the distance up to some kilometres, and a hundred
    times as fast as a change of frames.
    """
    middle = math.radians(0.5 * (from_deg[0] + to_deg[0]))
    flattening = 1.0 - _ECCENTRICITY_SQUARED * math.sin(middle) ** 2
    normal_m = _SEMI_MAJOR_M / math.sqrt(flattening)
    meridian_m = normal_m * (1.0 - _ECCENTRICITY_SQUARED) / flattening
    turn = wrap_angle(math.radians(to_deg[1] - from_deg[1]))
    east = (normal_m + height_m) * math.cos(middle) * turn
    return east, (meridian_m + height_m) * math.radians(to_deg[0] - from_deg[0])


def major_axis_sigma_m(ee: float, en: float, nn: float) -> float:
    """Sigma along the major axis of a horizontal covariance, m: the root of its larger eigenvalue."""
    half_trace = 0.5 * (ee + nn)
    return math.sqrt(max(0.0, half_trace + math.hypot(0.5 * (ee - nn), en)))
