"""Which floor, with a probability: from heights where somebody stayed a while (METHODS A8).

A stay is some seconds on the level. Its height is compared with the floors already visited, and with those not yet
visited, which lie a whole number of storeys away; the storey's height is learned from neighbouring floors. So
unequal storeys are no trouble once seen, and a landing is no floor.
"""

import math
from dataclasses import dataclass

from bootprint.messages import TimeNs

STAY_S = 7.0
_MOST_FLOORS_AWAY = 12
_LOWEST_STOREY_M = 2.2
_UNEVEN_M = 0.7  # by which storeys of one building differ: ground floors are high
_SAME_SIGMA_M = 0.4  # of two stays on one floor: thresholds, and what the altimeter missed
_LANDING_DENSITY = 0.02  # a m: somebody waits between floors
_ON_A_FLOOR = 0.5  # the least probability of being on any
_RARE = 0.6  # how much rarer each further unvisited floor is
_NS_PER_S = 1_000_000_000


@dataclass(slots=True)
class _Visited:
    """A floor's height: mean of its stays and their number."""

    height_m: float
    stays: int = 1


class FloorCounter:
    """The floor by number, ``start_floor`` where it began, and ``probability`` of it.

    ``storey_m`` and its sigma: what is known beforehand; where nothing is, several storeys climbed at once are
    counted by the usual height.
    """

    def __init__(self, start_floor: int, storey_m: float, storey_sigma_m: float) -> None:
        self.floor = start_floor
        self.probability = 1.0
        self.storey_m = storey_m
        self._storey_variance = storey_sigma_m**2
        self._visited: dict[int, _Visited] = {}
        self._start_floor = start_floor
        self._since_ns: TimeNs | None = None
        self._counted = False

    def update(self, time_ns: int, height_m: float, sigma_m: float, level: bool) -> None:
        """Take a height in, its sigma, and whether it is kept (on the level, standing or walking)."""
        if not level:
            self._since_ns, self._counted = None, False
            return
        if self._since_ns is None:
            self._since_ns = time_ns
        if self._counted or time_ns - self._since_ns < STAY_S * _NS_PER_S:
            return
        self._counted = True
        self._stay(height_m)

    def at(self, height_m: float) -> tuple[int, float]:
        """The floor at this height and its probability: that of the last stay where no floor is near."""
        shares = self.probabilities(height_m)
        best = max(shares, key=lambda floor: shares[floor], default=self.floor)
        if sum(shares.values()) < _ON_A_FLOOR:
            best = self.floor
        return best, shares.get(best, 0.0)

    def moved(self, shift_m: float) -> None:
        """Heights were corrected by this much from outside: floors keep their place."""
        for visited in self._visited.values():
            visited.height_m += shift_m

    def probabilities(self, height_m: float) -> dict[int, float]:
        """Of each floor at this height; what is missing to 1 is that of being between floors."""
        if not self._visited:
            return {self._start_floor: 1.0}
        weights = {}
        lowest, highest = min(self._visited), max(self._visited)
        for floor in range(lowest - _MOST_FLOORS_AWAY, highest + _MOST_FLOORS_AWAY + 1):
            nearest, away = self._nearest(floor)
            apart_m = height_m - nearest.height_m
            if away and abs(apart_m) < abs(away) * _LOWEST_STOREY_M:
                continue
            variance = _SAME_SIGMA_M**2 + away**2 * self._storey_variance + abs(away) * _UNEVEN_M**2
            miss = apart_m - away * self.storey_m
            density = math.exp(-0.5 * miss**2 / variance) / math.sqrt(2.0 * math.pi * variance)
            weights[floor] = density * _RARE ** abs(away)
        total = sum(weights.values()) + _LANDING_DENSITY
        return {floor: weight / total for floor, weight in weights.items()}

    def _nearest(self, floor: int) -> tuple[_Visited, int]:
        """The visited floor nearest to a floor, and how many storeys that lies above it."""
        nearest = min(self._visited, key=lambda known: abs(known - floor))
        return self._visited[nearest], floor - nearest

    def _stay(self, height_m: float) -> None:
        shares = self.probabilities(height_m)
        best = max(shares, key=lambda floor: shares[floor])
        if sum(shares.values()) < _ON_A_FLOOR:
            return  # between floors: the one before stands
        self.floor, self.probability = best, shares[best]
        known = self._visited.get(best)
        if known is None:
            self._learn_storey(best, height_m)
            self._visited[best] = _Visited(height_m)
        else:
            known.stays += 1
            known.height_m += max(1.0 / known.stays, 0.3) * (height_m - known.height_m)

    def _learn_storey(self, floor: int, height_m: float) -> None:
        """From the way to the nearest floor known: a Kalman update of the storey's height."""
        if not self._visited:
            return
        nearest, away = self._nearest(floor)
        storeys = abs(away)
        seen_m = abs(height_m - nearest.height_m) / storeys
        variance = 2.0 * (_SAME_SIGMA_M / storeys) ** 2 + _UNEVEN_M**2 / storeys
        gain = self._storey_variance / (self._storey_variance + variance)
        self.storey_m += gain * (seen_m - self.storey_m)
        self._storey_variance *= 1.0 - gain
