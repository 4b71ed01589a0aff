"""The lines that shots may take from where we are: our weapon's, or what we face, and those to observed targets."""

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bootprint.awareness import Aim, Reason
from bootprint.clock import NS_PER_S
from bootprint.geodesy import azimuth_of, ground_offset
from bootprint.messages import Observation, Position
from sa_hub.awareness.danger import Corridor
from sa_hub.awareness.settings import WarningSettings

_WIDEST_SIGMA_RAD: Final = 0.6
"""A direction less sure than this is no line."""
_FACING_SIGMA_RAD: Final = 0.35
"""Of what a body faces where nobody says, and how far people look aside from where they walk."""
_WALKING_M_S: Final = 0.3
_FACING_VALID_NS: Final = 3 * NS_PER_S
_MOST_TARGETS: Final = 16


@dataclass(frozen=True, slots=True)
class Target:
    """An observed target, relative to us: east and north, m, and one sigma, m, ours included."""

    east_m: float
    north_m: float
    sigma_m: float


@dataclass(frozen=True, slots=True)
class _Facing:
    azimuth_rad: float
    sigma_rad: float


class Lines:
    """What is known of directions. Times are those of arrival here, for a sensor's clock may be any."""

    def __init__(self, settings: WarningSettings) -> None:
        self._settings = settings
        self._aim: tuple[Aim, int] | None = None
        self._facing: tuple[_Facing, int] | None = None
        self._targets: OrderedDict[tuple[str, int], tuple[Observation, int]] = OrderedDict()

    def aim(self, aim: Aim, now_ns: int) -> None:
        """Our weapon points there."""
        self._aim = (aim, now_ns)

    def position(self, position: Position, now_ns: int) -> None:
        """What our body faces, as the fusion says, or the way we walk."""
        facing = _facing_of(position)
        self._facing = None if facing is None else (facing, now_ns)

    def target(self, observation: Observation, now_ns: int) -> None:
        """Somebody, perhaps ourselves, has seen something there."""
        self._targets[observation.soldier, observation.time_ns] = (observation, now_ns)
        while len(self._targets) > _MOST_TARGETS:
            self._targets.popitem(last=False)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back: directions of before are of the past, and targets go back with it."""
        self._aim = self._facing = None
        for key, (observation, arrived_ns) in self._targets.items():
            self._targets[key] = (observation, arrived_ns - by_ns)

    def pointing(self, now_ns: int) -> tuple[Reason, Corridor] | None:
        """The line of our weapon, or for want of it of our body."""
        aim = self._current_aim(now_ns)
        if aim is not None:
            corridor = self._corridor(aim.azimuth_rad, aim.azimuth_sigma_rad, aim)
            return None if corridor is None else ("in_aim", corridor)
        if self._facing is None or not self._settings.facing or now_ns - self._facing[1] > _FACING_VALID_NS:
            return None
        corridor = self._corridor(self._facing[0].azimuth_rad, self._facing[0].sigma_rad, None)
        return None if corridor is None else ("in_facing", corridor)

    def targets(self, place_deg: tuple[float, float], sigma_m: float, now_ns: int) -> list[Target]:
        """The targets of late, relative to our place (latitude, longitude) of this sigma."""
        for key, (_, arrived_ns) in list(self._targets.items()):
            if now_ns - arrived_ns > self._settings.target_s * NS_PER_S:
                del self._targets[key]
        return [
            Target(
                *ground_offset(place_deg, (seen.latitude_deg, seen.longitude_deg)),
                math.hypot(sigma_m, seen.accuracy_m),
            )
            for seen, _ in self._targets.values()
        ]

    def to_targets(self, targets: list[Target]) -> Iterator[Corridor]:
        """The lines from us to targets within our range: past them, too, as shots go."""
        for target in targets:
            distance_m = math.hypot(target.east_m, target.north_m)
            if 0.0 < distance_m <= self._settings.range_m:
                azimuth_rad = azimuth_of(target.east_m, target.north_m)
                corridor = self._corridor(azimuth_rad, target.sigma_m / distance_m, None)
                if corridor is not None:
                    yield corridor

    def _current_aim(self, now_ns: int) -> Aim | None:
        if self._aim is None:
            return None
        aim, arrived_ns = self._aim
        return aim if now_ns - arrived_ns <= aim.valid_s * NS_PER_S else None

    def _corridor(self, azimuth_rad: float, sigma_rad: float, aim: Aim | None) -> Corridor | None:
        """A corridor of the settings' width; None if the direction is too unsure."""
        if sigma_rad > _WIDEST_SIGMA_RAD:
            return None
        reach_m = self._settings.range_m
        return Corridor(
            azimuth_rad=azimuth_rad,
            azimuth_sigma_rad=sigma_rad,
            range_m=reach_m if aim is None or aim.range_m is None else aim.range_m,
            half_width_m=self._settings.half_width_m,
            elevation_rad=None if aim is None else aim.elevation_rad,
            elevation_sigma_rad=None if aim is None else aim.elevation_sigma_rad,
        )


def _facing_of(position: Position) -> _Facing | None:
    if position.facing_rad is not None:
        sigma_rad = position.facing_sigma_rad
        return _Facing(position.facing_rad, _FACING_SIGMA_RAD if sigma_rad is None else sigma_rad)
    if position.course_rad is None or position.speed_m_s < _WALKING_M_S:
        return None
    return _Facing(position.course_rad, math.hypot(position.course_sigma_rad or 0.0, _FACING_SIGMA_RAD))
