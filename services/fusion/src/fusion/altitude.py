"""Heights that feet cannot feel: lifts, by air pressure; and floors, where climbing ends (METHODS A8).

Feet know stairs. In a lift they stand, and only the pressure changes. So pressure is compared with what the feet
climbed: while they stand and it runs away from them by more than wind, doors and weather have lately made it, the
soldier rides, and height follows the pressure until that rests. Weather drifts too slowly to matter over a ride,
and under the open sky, where wind presses, nobody rides. A ride ends on a floor, and so do stairs: where the
storey's height is known, the height is drawn to the nearest floor, unless it is too far from every one (a landing).
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import FootStep, Pressure
from fusion.config import AltitudeConfig

_SEA_LEVEL_PA, _SCALE_M, _EXPONENT = 101_325.0, 44_330.77, 0.190263  # ISO 2533, up to 11 km
_WINDOW_S = 12.0  # of pressure that is remembered
_REST_S = 1.5  # over which a level is averaged
_SHORTEST_SPAN_S = 0.5
_STEEP = 0.12  # rise over way of a step: no floor is that steep


@dataclass(frozen=True, slots=True)
class Climb:
    """The soldier went up by ``up_m`` without a step; ``sigma_m`` of the whole ride, once it has ``ended``."""

    up_m: float
    sigma_m: float
    ended: bool = False
    ridden_m: float = 0.0


def pressure_height_m(pressure_pa: float) -> float:
    """Height above sea level at which the standard atmosphere has this pressure."""
    return float(_SCALE_M * (1.0 - (pressure_pa / _SEA_LEVEL_PA) ** _EXPONENT))


class LiftWatch:
    """Pressure and steps in, rides out."""

    def __init__(self, config: AltitudeConfig, *, floors_known: bool = True) -> None:
        self._config = config
        self._least_ride_m = config.least_ride_m if floors_known else config.least_blind_ride_m
        self._heights: deque[tuple[float, float]] = deque()  # s, m: by pressure, less what feet climbed
        self._zero_ns: int | None = None
        self._climbed_m: dict[str, float] = {}  # by foot
        self._moved_s = -math.inf
        self._noise_m = 0.0
        self._floor_m: float | None = None  # the level before the ride
        self._ridden_m = 0.0

    @property
    def rides(self) -> bool:
        """Whether the soldier is in a lift that moves."""
        return self._floor_m is not None

    def step(self, place: str, step: FootStep) -> None:
        """What a foot climbed is explained; a foot that walks rides no lift."""
        self._climbed_m[place] = self._climbed_m.get(place, 0.0) + step.displacement_m[2]
        if math.hypot(*step.displacement_m[:2]) > self._config.walking_m:
            self._moved_s = self._seconds(step.time_ns)

    def _seconds(self, time_ns: int) -> float:
        self._zero_ns = time_ns if self._zero_ns is None else self._zero_ns
        return (time_ns - self._zero_ns) / NS_PER_S

    def pressure(self, pressure: Pressure, *, outdoors: bool) -> Climb | None:
        """A sample; what was ridden since the last, if anything."""
        now_s = self._seconds(pressure.time_ns)
        if self._heights and not 0.0 < now_s - self._heights[-1][0] < _WINDOW_S:
            self._heights.clear()
            self._floor_m = None
        climbed = sum(self._climbed_m.values()) / max(len(self._climbed_m), 1)
        self._heights.append((now_s, pressure_height_m(pressure.pressure_pa) - climbed))
        while now_s - self._heights[0][0] > _WINDOW_S:
            self._heights.popleft()
        return self._ride(now_s) if self.rides else self._set_off(now_s, outdoors)

    def _set_off(self, now_s: float, outdoors: bool) -> Climb | None:
        """Whether a ride has begun: a run of pressure while standing, out of the noise of before."""
        level, before = (
            self._mean(now_s - _SHORTEST_SPAN_S),
            self._mean(now_s - _WINDOW_S, self._before_s(now_s)),
        )
        if level is None or before is None:
            return None
        stands_s = now_s - self._moved_s
        away = level - before
        limit = max(self._least_ride_m, self._config.noise_gate * self._noise_m)
        if outdoors or stands_s < self._config.standing_s or abs(away) < limit:
            self._learn_noise(away if stands_s < self._config.standing_s else 0.0)
            return None
        self._floor_m, self._ridden_m = before, 0.0
        return self._ride(now_s)

    def _before_s(self, now_s: float) -> float:
        """A ride can only have begun when the feet had come to stand."""
        return max(now_s - _WINDOW_S + _REST_S, min(self._moved_s + 1.0, now_s - _REST_S))

    def _learn_noise(self, away_m: float) -> None:
        self._noise_m += 0.02 * (abs(away_m) - self._noise_m)

    def _ride(self, now_s: float) -> Climb | None:
        level = self._mean(now_s - _SHORTEST_SPAN_S)
        if level is None or self._floor_m is None:
            return None
        rests = self._rate(now_s - self._config.rest_s) < self._config.rest_m_s
        if rests:
            level = self._mean(now_s - _REST_S) or level
        by = level - self._floor_m - self._ridden_m
        self._ridden_m += by
        if rests or self._moved_s > now_s - 0.5:
            ridden = self._end()
            return Climb(by, self._config.ride_sigma_m, ended=True, ridden_m=ridden)
        return Climb(by, self._config.ride_sigma_m)

    def _end(self) -> float:
        """Pressure stands for another floor from now on; how far up that is."""
        ridden, self._floor_m = self._ridden_m, None
        self._heights = deque(
            (at, height) for at, height in self._heights if at > self._heights[-1][0] - _REST_S
        )
        return ridden

    def _mean(self, from_s: float, to_s: float = math.inf) -> float | None:
        seen = [height for at, height in self._heights if from_s <= at <= to_s]
        return sum(seen) / len(seen) if seen else None

    def _rate(self, from_s: float) -> float:
        """Size of the rate since then by least squares, m/s; infinite while there is too little."""
        seen = np.array([sample for sample in self._heights if sample[0] >= from_s])
        if len(seen) < 4 or seen[-1, 0] - seen[0, 0] < _SHORTEST_SPAN_S:
            return math.inf
        centred = seen[:, 0] - seen[:, 0].mean()
        return abs(float(centred @ seen[:, 1] / (centred @ centred)))

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._zero_ns = None if self._zero_ns is None else self._zero_ns + by_ns


class Landing:
    """Notices where climbing has ended: at a floor, if it is near one."""

    def __init__(self, config: AltitudeConfig, storey_m: float | None) -> None:
        self._config = config
        self._storey_m = storey_m
        self._climbs = False
        self._level_m = 0.0

    def step(self, step: FootStep) -> bool:
        """A step; True when it shows that stairs have ended."""
        across = math.hypot(*step.displacement_m[:2])
        if step.motion == "stairs" or abs(step.displacement_m[2]) > max(_STEEP * across, 0.1):
            self._climbs, self._level_m = True, 0.0
            return False
        self._level_m += across
        if not self._climbs or self._level_m < self._config.level_way_m:
            return False
        self._climbs = False
        return True

    def floor_m(self, up_m: float) -> float | None:
        """The height of the floor that is meant by a height where climbing ended; None if none is near."""
        if self._storey_m is None:
            return None
        floor = self._storey_m * round(up_m / self._storey_m)
        return floor if abs(up_m - floor) <= self._config.floor_share * self._storey_m else None

    def is_between(self, up_m: float) -> bool:
        """Whether floors are known and none is near."""
        return self._storey_m is not None and self.floor_m(up_m) is None
