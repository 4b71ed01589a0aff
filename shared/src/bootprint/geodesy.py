"""WGS84 and local east-north-up: the one place that knows the earth is round."""

import math

import numpy as np
import numpy.typing as npt

from bootprint.config import Origin

_TURN = 2.0 * math.pi
_SEMI_MAJOR_M = 6_378_137.0
_FLATTENING = 1.0 / 298.257223563
_ECCENTRICITY_SQUARED = _FLATTENING * (2.0 - _FLATTENING)
_SECOND_ECCENTRICITY_SQUARED = _ECCENTRICITY_SQUARED / (1.0 - _ECCENTRICITY_SQUARED)
_POLE_COSINE = 1e-9  # of latitude: nearer to a pole east and north mean nothing
_SEMI_MINOR_M = _SEMI_MAJOR_M * (1.0 - _FLATTENING)


class LocalFrame:
    """ENU metres around an origin (WGS84, ellipsoidal height); a tangent plane, good to ~1 cm/km² of curvature.

    Rotations and closed forms of its own: every position and every report on the radio passes here.
    """

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        latitude, longitude = math.radians(origin.latitude_deg), math.radians(origin.longitude_deg)
        self._sin_lat, self._cos_lat = math.sin(latitude), math.cos(latitude)
        self._sin_lon, self._cos_lon = math.sin(longitude), math.cos(longitude)
        self._centre = _earth_centred(origin.latitude_deg, origin.longitude_deg, origin.height_m)

    def to_enu(
        self, latitude_deg: float, longitude_deg: float, height_m: float
    ) -> tuple[float, float, float]:
        """Geodetic to (east, north, up) in metres."""
        x, y, z = _earth_centred(latitude_deg, longitude_deg, height_m)
        x, y, z = x - self._centre[0], y - self._centre[1], z - self._centre[2]
        outward = self._cos_lon * x + self._sin_lon * y
        east = self._cos_lon * y - self._sin_lon * x
        north = self._cos_lat * z - self._sin_lat * outward
        return east, north, self._cos_lat * outward + self._sin_lat * z

    def to_geodetic(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float, float]:
        """ENU metres to (latitude deg, longitude deg, ellipsoidal height m)."""
        outward = self._cos_lat * up_m - self._sin_lat * north_m
        x = self._centre[0] + self._cos_lon * outward - self._sin_lon * east_m
        y = self._centre[1] + self._sin_lon * outward + self._cos_lon * east_m
        z = self._centre[2] + self._sin_lat * up_m + self._cos_lat * north_m
        return _geodetic(x, y, z)

    def all_to_geodetic(self, enu_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Points (n, 3) ENU metres to rows of (latitude deg, longitude deg, ellipsoidal height m)."""
        rows = [self.to_geodetic(*point) for point in enu_m.tolist()]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _earth_centred(latitude_deg: float, longitude_deg: float, height_m: float) -> tuple[float, float, float]:
    """Geodetic to earth-centred, earth-fixed x, y, z, m."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sine = math.sin(latitude)
    normal_m = _SEMI_MAJOR_M / math.sqrt(1.0 - _ECCENTRICITY_SQUARED * sine * sine)
    outward = (normal_m + height_m) * math.cos(latitude)
    z = (normal_m * (1.0 - _ECCENTRICITY_SQUARED) + height_m) * sine
    return outward * math.cos(longitude), outward * math.sin(longitude), z


def _geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Earth-centred x, y, z in m to (latitude deg, longitude deg, height m).

    Bowring (Survey Review 23, 1976), twice: the second pass brings what the first leaves (1e-9 rad some ten
    kilometres up) to the last bit. Height by Bowring 1985, which holds at the poles too.
    """
    outward = math.hypot(x, y)
    sine, cosine = z, (1.0 - _FLATTENING) * outward  # of the parametric latitude, not yet of length one
    for _ in range(2):
        length = math.hypot(sine, cosine) or 1.0
        sine, cosine = sine / length, cosine / length
        up = z + _SECOND_ECCENTRICITY_SQUARED * _SEMI_MINOR_M * sine**3
        out = outward - _ECCENTRICITY_SQUARED * _SEMI_MAJOR_M * cosine**3
        sine, cosine = (1.0 - _FLATTENING) * up, out
    latitude = math.atan2(up, out)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    height = (
        outward * cosine + z * sine - _SEMI_MAJOR_M * math.sqrt(1.0 - _ECCENTRICITY_SQUARED * sine * sine)
    )
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height


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
    normal_m, meridian_m = _radii_m(middle)
    turn = wrap_angle(math.radians(to_deg[1] - from_deg[1]))
    east = (normal_m + height_m) * math.cos(middle) * turn
    return east, (meridian_m + height_m) * math.radians(to_deg[0] - from_deg[0])


def moved_place(from_deg: tuple[float, float], east_m: float, north_m: float) -> tuple[float, float]:
    """The (latitude, longitude) so many metres away on the ground: the inverse of `ground_offset`, up to some km.

    Held at the poles; longitude within ±180°.
    """
    latitude_deg, longitude_deg = from_deg
    for _ in range(2):  # the radii are those of the middle latitude, which the first pass tells
        middle = math.radians(0.5 * (from_deg[0] + latitude_deg))
        normal_m, meridian_m = _radii_m(middle)
        latitude_deg = from_deg[0] + math.degrees(north_m / meridian_m)
    turn = east_m / (normal_m * max(math.cos(middle), _POLE_COSINE))
    longitude_deg = math.degrees(wrap_angle(math.radians(longitude_deg) + turn))
    return max(-90.0, min(90.0, latitude_deg)), longitude_deg


def _radii_m(latitude_rad: float) -> tuple[float, float]:
    """Radii of curvature east-west (normal) and north-south (meridian)."""
    flattening = 1.0 - _ECCENTRICITY_SQUARED * math.sin(latitude_rad) ** 2
    normal_m = _SEMI_MAJOR_M / math.sqrt(flattening)
    return normal_m, normal_m * (1.0 - _ECCENTRICITY_SQUARED) / flattening


def major_axis_sigma_m(ee: float, en: float, nn: float) -> float:
    """Sigma along the major axis of a horizontal covariance, m: the root of its larger eigenvalue."""
    half_trace = 0.5 * (ee + nn)
    return math.sqrt(max(0.0, half_trace + math.hypot(0.5 * (ee - nn), en)))
