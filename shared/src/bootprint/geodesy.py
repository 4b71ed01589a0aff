"""WGS84 and local east-north-up: the one place that knows the earth is round."""

import math

import pymap3d

from bootprint.config import Origin


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


def wrap_angle(angle_rad: float) -> float:
    """The same angle in (−π, π]."""
    return math.pi - (math.pi - angle_rad) % (2.0 * math.pi)


def azimuth_of(east: float, north: float) -> float:
    """Azimuth of a direction, radians clockwise from true north, in [0, 2π)."""
    return math.atan2(east, north) % (2.0 * math.pi)


def yaw_of_azimuth(azimuth_rad: float) -> float:
    """Mathematical yaw (counter-clockwise from east) of an azimuth (clockwise from north); its own inverse."""
    return wrap_angle(math.pi / 2.0 - azimuth_rad)
