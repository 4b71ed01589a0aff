"""How fast and where the soldier goes, by the last strides of the feet."""

import math
from collections.abc import Sequence

import numpy as np

from bootprint.messages import MotionClass, Vector3
from fusion.boots import Boots
from fusion.feet import Foot
from fusion.models import foot_step


def speed_m_s(alive: Sequence[Foot]) -> float:
    """Mean speed of the feet's last strides."""
    strides = [foot.stride.speed_m_s for foot in alive if foot.stride is not None]
    return sum(strides) / len(strides) if strides else 0.0


def motion(
    boots: Boots, alive: Sequence[Foot], turn: tuple[float, float] | None
) -> tuple[Vector3, float, float | None]:
    """Velocity, speed and σ of the course; no direction without a ``turn`` (yaw, σ) into ENU."""
    if turn is None:
        return (0.0, 0.0, 0.0), speed_m_s(alive), None
    yaw, yaw_sigma = turn
    east, north, up = (float(part) for part in np.mean([_velocity(boots, foot) for foot in alive], axis=0))
    cosine, sine = math.cos(yaw), math.sin(yaw)
    velocity = (cosine * east - sine * north, sine * east + cosine * north, up)
    return velocity, math.hypot(east, north), _course_sigma(boots, alive, yaw_sigma)


def _course_sigma(boots: Boots, alive: Sequence[Foot], yaw_sigma: float) -> float | None:
    """Heading error and the last step's sideways error, the worst of the feet."""
    sigmas = [
        math.hypot(
            math.sqrt(max(0.0, float(boots.filter.covariance[foot.block.yaw, foot.block.yaw]))),
            foot.stride.lateral_sigma_m / foot.stride.length_m,
        )
        for foot in alive
        if foot.stride is not None and foot.stride.length_m > 0.0
    ]
    return math.hypot(max(sigmas), yaw_sigma) if sigmas else None


def _velocity(boots: Boots, foot: Foot) -> Vector3:
    """Mean velocity of a foot over its last stride, m/s."""
    if foot.stride is None or foot.stride.duration_s <= 0.0:
        return 0.0, 0.0, 0.0
    yaw = float(boots.filter.state[foot.block.yaw]) - foot.stride.turn_rad
    east, north, up = foot_step.rotate(yaw, foot.stride.displacement_m)
    return tuple(part / foot.stride.duration_s for part in (east, north, up))  # type: ignore[return-value]


def motion_class(boots: Boots, now_ns: int) -> MotionClass:
    """The motion class of the foot heard last."""
    alive = [foot for foot in boots.alive(now_ns) if foot.end_ns is not None]
    return max(alive, key=lambda foot: foot.end_ns or 0).motion if alive else "unknown"
