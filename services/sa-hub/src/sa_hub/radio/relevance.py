"""Whose place matters more than others': leaders, and who is near another squad's people or something just seen.

Blue-on-blue comes first: two squads that come near each other must know it. Weights are modest, and only their
ratio counts, since the budget sets what a bit must buy.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg

NEAR_M: Final = 100.0
SEEN_M: Final = 200.0
SEEN_NS: Final = 600 * NS_PER_S
NEAR_OTHERS: Final = 2.0
NEAR_SEEN: Final = 1.5
LEADER: Final = 1.25
_MOST_SEEN: Final = 32


@dataclass
class Relevance:
    """``units`` by roster number, and the ``leaders``' numbers."""

    units: Mapping[int, str] = field(default_factory=dict)
    leaders: Collection[int] = ()
    _seen: list[tuple[int, float, float]] = field(default_factory=list)

    def saw(self, time_ns: int, latitude_deg: float, longitude_deg: float) -> None:
        """Something was observed there."""
        self._seen = [*self._seen[1 - _MOST_SEEN :], (time_ns, latitude_deg, longitude_deg)]

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._seen = [(time_ns - by_ns, *place) for time_ns, *place in self._seen]  # type: ignore[misc]

    def weights(
        self, numbers: list[int], latitude: FloatArray, longitude: FloatArray, now_ns: int
    ) -> FloatArray:
        """(n,) factors of these soldiers' worth, at these places in degrees."""
        weights = np.where([number in self.leaders for number in numbers], LEADER, 1.0)
        self._weigh_others(weights, numbers, latitude, longitude)
        for time_ns, *seen in self._seen:
            if now_ns - time_ns <= SEEN_NS:
                near = _distances_m(latitude, longitude, seen[0], seen[1]) <= SEEN_M
                weights[near] = np.maximum(weights[near], NEAR_SEEN)
        return weights

    def _weigh_others(
        self, weights: FloatArray, numbers: list[int], latitude: FloatArray, longitude: FloatArray
    ) -> None:
        """Who is near another squad's people counts double; cells of that size keep it from n² of work."""
        units = [self.units.get(number, "") for number in numbers]
        if len(set(units)) < 2:
            return
        codes = np.unique(units, return_inverse=True)[1]
        cosine = cosines(latitude[:1])
        north = np.floor(latitude * METRES_PER_DEG / NEAR_M)
        east = np.floor(turn_deg(longitude - longitude[0]) * METRES_PER_DEG * cosine / NEAR_M)
        cells: dict[tuple[float, float], list[int]] = {}
        for index, cell in enumerate(zip(east.tolist(), north.tolist(), strict=True)):
            cells.setdefault(cell, []).append(index)
        for (column, row), here in cells.items():
            around = [
                index
                for step_east in (-1, 0, 1)
                for step_north in (-1, 0, 1)
                for index in cells.get((column + step_east, row + step_north), ())
            ]
            for index in here:
                others = [each for each in around if codes[each] != codes[index]]
                near = _distances_m(latitude[others], longitude[others], latitude[index], longitude[index])
                if np.any(near <= NEAR_M):
                    weights[index] = NEAR_OTHERS


def _distances_m(
    latitude: FloatArray, longitude: FloatArray, to_latitude: float, to_longitude: float
) -> FloatArray:
    north = (latitude - to_latitude) * METRES_PER_DEG
    east = turn_deg(longitude - to_longitude) * METRES_PER_DEG * cosines(latitude)
    return np.hypot(east, north)
