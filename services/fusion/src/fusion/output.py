"""What is published: `Position` messages out of a fused estimate, with reliability, floor and mode."""

import math
from dataclasses import dataclass, field

import numpy as np

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame, azimuth_of, major_axis_sigma_m
from bootprint.messages import Mode, MotionClass, Position, Vector3, upper_triangle
from fusion.protection import Protection
from fusion.state import Array

_COURSE_SPEED_M_S = 0.3  # slower than this a course means nothing
_HALF_RELIABLE_M = 5.0
_LEAVES_FLOOR = 0.6  # storeys from the last floor, for another one


@dataclass(frozen=True, slots=True)
class Estimate:
    """The fused answer at one moment: ENU m, covariance (3, 3) m², velocity m/s; ``course_sigma_rad`` if known.

    ``facing``: azimuth of the body and its sigma, rad.
    """

    mode: Mode
    enu: Vector3
    covariance: Array
    velocity: Vector3 = (0.0, 0.0, 0.0)
    speed_m_s: float = 0.0
    course_sigma_rad: float | None = None
    facing: tuple[float, float] | None = None
    motion: MotionClass = "unknown"
    sources: tuple[str, ...] = ()
    rejections: dict[str, str] = field(default_factory=dict)
    protection: Protection | None = None


class Publisher:
    """Turns estimates into messages of one soldier."""

    def __init__(self, origin: Origin, floor_height_m: float | None) -> None:
        self._frame = LocalFrame(origin)
        self._floor_height_m = floor_height_m
        self.sequence = 0  # of the next message
        self._floor: int | None = None

    def position(self, time_ns: int, estimate: Estimate) -> Position:
        """The message, numbered from zero."""
        east, north, up = estimate.enu
        latitude, longitude, height = self._frame.to_geodetic(east, north, up)
        course, course_sigma = _course(estimate)
        message = Position(
            time_ns=time_ns,
            sequence=self.sequence,
            mode=estimate.mode,
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            east_m=east,
            north_m=north,
            up_m=up,
            covariance_m2=_six(estimate.covariance),
            velocity_m_s=estimate.velocity,
            speed_m_s=estimate.speed_m_s,
            course_rad=course,
            course_sigma_rad=course_sigma,
            facing_rad=None if estimate.facing is None else estimate.facing[0],
            facing_sigma_rad=None if estimate.facing is None else estimate.facing[1],
            floor=self._floor_of(estimate),
            motion=estimate.motion,
            sources=estimate.sources,
            rejected=tuple(estimate.rejections),
            reliability_pct=reliability_pct(estimate),
            rejections=estimate.rejections,
            protection_m=None if estimate.protection is None else estimate.protection.radius_m,
            external_reliability_m=None if estimate.protection is None else estimate.protection.external_m,
        )
        self.sequence += 1
        return message

    def _floor_of(self, estimate: Estimate) -> int | None:
        """Floor by height above the origin (the ground floor's level), if known; sticks to the last one."""
        if self._floor_height_m is None or estimate.mode == "unplaced":
            return None
        storeys = estimate.enu[2] / self._floor_height_m
        if self._floor is None or abs(storeys - self._floor) > _LEAVES_FLOOR:
            self._floor = round(storeys)
        return self._floor


def horizontal_sigma_m(covariance: Array) -> float:
    """Root of the larger eigenvalue of the horizontal part, m."""
    return major_axis_sigma_m(float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1]))


def reliability_pct(estimate: Estimate) -> float:
    """``100 / (1 + (σ/5 m)²)`` of the horizontal σ; half of it while coasting, 0 when unplaced or lost.

    So 1 m is 96 %, 5 m is 50 %, 15 m is 10 %.
    """
    if estimate.mode in ("unplaced", "lost"):
        return 0.0
    value = 100.0 / (1.0 + (horizontal_sigma_m(estimate.covariance) / _HALF_RELIABLE_M) ** 2)
    return 0.5 * value if estimate.mode == "coasting" else value


def _course(estimate: Estimate) -> tuple[float | None, float | None]:
    east, north, _ = estimate.velocity
    if estimate.course_sigma_rad is None or math.hypot(east, north) < _COURSE_SPEED_M_S:
        return None, None
    return azimuth_of(east, north), estimate.course_sigma_rad


def _six(covariance: Array) -> tuple[float, float, float, float, float, float]:
    ee, en, eu, nn, nu, uu = upper_triangle(np.asarray(covariance))
    return ee, en, eu, nn, nu, uu
