"""Where and when satellites can be received: zones of denial, streets, jammers, spoofers, and walls that reflect.

Everything here is a function of time and place: two receivers side by side suffer alike.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from proving_ground.motion import FloatArray
from proving_ground.sensors.places import Area, Walls, distance_to
from proving_ground.sensors.randomness import RandomField

ZoneKind = Literal["urban", "indoors", "jammed", "spoofed"]
_MULTIPATH_PLACE_M = 6.0  # over which a reflection's bias changes
_MULTIPATH_REACH_M = 8.0  # from the wall
_SHADOW_PLACE_M, _SHADOW_TIME_S = 25.0, 120.0  # over which streets hide satellites; they move on slowly
_FULL_SKY = 12.0


@dataclass(frozen=True)
class Zone:
    """A kind of trouble in an area for a time. What ``strength`` is depends on the kind:

    ``urban``: bias of reflections, m (10 in narrow streets); outages in ``outage_share`` of the places.
    ``indoors``: depth behind the door, m, over which reception fades away (4).
    ``jammed``: metres from the area's edge inwards over which the jammer goes from felt to deaf (100).
    ``spoofed``: speed of the drag, m/s (0.5), towards ``direction_rad`` (yaw), for whoever is inside.
    """

    kind: ZoneKind
    area: Area
    strength: float
    start_s: float = -np.inf
    end_s: float = np.inf
    direction_rad: float = 0.0
    outage_share: float = 0.2

    def active(self, time_s: FloatArray, place_m: FloatArray) -> npt.NDArray[np.bool_]:
        """Whether it is felt at times (n,) and places (n, 3)."""
        return (time_s >= self.start_s) & (time_s < self.end_s) & self.area.holds(place_m)


@dataclass(frozen=True)
class Reception:
    """What a receiver has to work with at each epoch.

    ``signal`` (n,): 1 open sky, 0 no fix possible. ``bias_m`` (n, 3): of reflections, ENU. ``drag_m`` and
    ``drag_m_s`` (n, 3): what a spoofer adds to position and velocity; ``spoofed`` (n,): whether it does.
    """

    signal: FloatArray
    bias_m: FloatArray
    drag_m: FloatArray
    drag_m_s: FloatArray
    spoofed: npt.NDArray[np.bool_]

    @property
    def satellites(self) -> FloatArray:
        """How many satellites are used, whole numbers (n,)."""
        return np.asarray(
            np.round(np.where(self.spoofed, _FULL_SKY, 3.0 + (_FULL_SKY - 3.0) * self.signal)), np.float64
        )


@dataclass(frozen=True)
class GnssConditions:
    """Zones and reflecting walls; ``wall_bias_m``: bias right at a wall. Realised by ``seed``."""

    zones: tuple[Zone, ...] = ()
    walls: Walls = field(default_factory=Walls)
    wall_bias_m: float = 6.0
    seed: int = 0

    def reception(self, time_s: FloatArray, place_m: FloatArray) -> Reception:
        """At rising times (n,) and the places (n, 3) of one receiver."""
        reflections = RandomField.drawn([_MULTIPATH_PLACE_M] * 3, 3, self.seed).at(place_m)
        signal = np.ones(len(time_s))
        strength = self.wall_bias_m * np.exp(-distance_to(self.walls.ends_m, place_m) / _MULTIPATH_REACH_M)
        for zone in self.zones:
            active = zone.active(time_s, place_m)
            if zone.kind == "urban":
                strength = np.where(active, np.maximum(strength, zone.strength), strength)
            signal = np.where(active, np.minimum(signal, self._signal(zone, time_s, place_m)), signal)
        drag, pull, spoofed = self._drag(time_s, place_m)
        return Reception(np.where(spoofed, 1.0, signal), strength[:, None] * reflections, drag, pull, spoofed)

    def _signal(self, zone: Zone, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        if zone.kind == "urban":
            return self._street(zone, time_s, place_m)
        if zone.kind == "spoofed":
            return np.ones(len(time_s))
        return np.clip(1.0 - zone.area.depth_m(place_m) / zone.strength, 0.0, 1.0)

    def _street(self, zone: Zone, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        """Houses hide satellites: a smooth field of place and slow time, 0 on ``outage_share`` of them."""
        scales = [_SHADOW_TIME_S, _SHADOW_PLACE_M, _SHADOW_PLACE_M]
        shadow = RandomField.drawn(scales, 1, self.seed + 1).at(np.column_stack([time_s, place_m[:, :2]]))
        rank = 1.0 / (1.0 + np.exp(-1.702 * shadow[:, 0]))  # nearly the normal distribution function
        clear = (rank - zone.outage_share) / max(1.0 - zone.outage_share, 1e-9)
        return np.clip(0.3 + 0.6 * clear, 0.0, 0.8) * (clear > 0.0)

    def _drag(
        self, time_s: FloatArray, place_m: FloatArray
    ) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
        """A spoofer starts at the true position and pulls away with its speed while the receiver stays with it."""
        drag, pull = np.zeros((len(time_s), 3)), np.zeros((len(time_s), 3))
        caught = np.zeros(len(time_s), dtype=np.bool_)
        steps = np.diff(time_s, prepend=time_s[:1])
        for zone in (zone for zone in self.zones if zone.kind == "spoofed"):
            active = zone.active(time_s, place_m)
            inside_s = np.cumsum(np.where(active, steps, 0.0))
            entered_s = np.maximum.accumulate(np.where(active, 0.0, inside_s))
            towards = zone.strength * np.array([np.cos(zone.direction_rad), np.sin(zone.direction_rad), 0.0])
            drag += ((inside_s - entered_s) * active)[:, None] * towards
            pull += active[:, None] * towards
            caught |= active
        return drag, pull, caught
