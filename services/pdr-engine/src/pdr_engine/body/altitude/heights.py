"""Height, climb and floor of the body-worn unit, as far as there is air pressure (METHODS A8)."""

import math
from dataclasses import dataclass

from pdr_engine.body.altitude.altimeter import LAG_S, Altimeter
from pdr_engine.body.altitude.floors import FloorCounter
from pdr_engine.body.altitude.vertical import VerticalChannel
from pdr_engine.body.movement.classes import Climb
from pdr_engine.body.settings import AltitudeSettings

_NS_PER_S = 1_000_000_000
_FRESH_NS = 5 * _NS_PER_S  # of pressure: without it for longer nobody knows how high it is
_STEEPEST = 0.5  # of rise over way: steeper ones are no slopes


@dataclass(frozen=True, slots=True)
class Height:
    """At a step: height m and sigma, floor and its probability, climb for the class, ``rate_m_s`` on a slope."""

    height_m: float
    sigma_m: float
    floor: int
    floor_probability: float
    climb: Climb
    rate_m_s: float

    def slope_rad(self, speed_m_s: float) -> float:
        """Of the way, for steps of this speed along it (METHODS A2)."""
        share = self.rate_m_s / speed_m_s if speed_m_s > 0.0 else 0.0
        return math.asin(max(-_STEEPEST, min(_STEEPEST, share)))


class Heights:
    """Pressure and steps in, heights out; nothing is known, and no filter made, before the first pressure."""

    def __init__(self, settings: AltitudeSettings) -> None:
        self._settings = settings
        self._altimeter: Altimeter | None = None
        self._floors = FloorCounter(settings.start_floor, settings.storey_m, settings.storey_sigma_m)
        self._channel = VerticalChannel()
        self._newest_ns = 0

    def accelerate(self, time_ns: int, force_m_s2: float) -> None:
        """The vertical specific force since the last call."""
        if self._altimeter is not None:
            self._channel.accelerate(time_ns, force_m_s2)

    def pressure(self, time_ns: int, pressure_pa: float) -> None:
        """Take a sample in."""
        if self._altimeter is None:
            self._altimeter = Altimeter(self._settings)
        altimeter = self._altimeter
        altimeter.pressure(time_ns, pressure_pa, self._channel)
        self._newest_ns = max(self._newest_ns, time_ns)
        level = altimeter.settled_way == "level"
        lagged_ns = time_ns - round(LAG_S * _NS_PER_S)
        self._floors.update(lagged_ns, altimeter.settled_height_m, altimeter.sigma_m, level)

    def reference(self, time_ns: int, height_m: float, sigma_m: float) -> None:
        """A height from satellites or a known place."""
        if self._altimeter is not None:
            before_m = self._altimeter.settled_height_m
            self._altimeter.reference(time_ns, height_m, sigma_m)
            self._floors.moved(self._altimeter.settled_height_m - before_m)

    @property
    def reference_ns(self) -> int | None:
        """When a height last came from outside."""
        return None if self._altimeter is None else self._altimeter.reference_ns

    def climb_at(self, time_ns: int) -> Climb | None:
        """What stairs there were at a time not long ago, as it is known now."""
        return None if self._altimeter is None else self._altimeter.climb_at(time_ns)

    def step(self, time_ns: int) -> Height | None:
        """A step ended; the height, None without fresh pressure."""
        altimeter = self._altimeter
        if altimeter is None or time_ns - self._newest_ns > _FRESH_NS:
            return None
        altimeter.step(time_ns)
        height_m = altimeter.height_m
        floor, probability = self._floors.at(height_m)
        return Height(
            height_m=height_m,
            sigma_m=altimeter.sigma_m,
            floor=floor,
            floor_probability=probability,
            climb=altimeter.climb(self._channel.height_m),
            rate_m_s=altimeter.slope_rate_m_s,
        )
