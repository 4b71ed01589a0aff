"""A soldier's velocity as it is to be told: the way just gone, where that and the fusion's velocity agree.

A fusion's velocity is the mean of a stride that is over, and must be smoothed against the sway of the next ones, so
it is more than a second old: who stops or turns would be shown metres ahead. The way of the last moments is
fresher; it only lies when a fix has moved the position, and then the two disagree by more than people on foot can.
"""

import math
from collections import deque
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.messages import Position
from sa_hub.radio.ground import METRES_PER_DEG, cosine
from sa_hub.tracks import SmoothVelocity

WAY_NS: Final = 800_000_000
"""The way of so long: most of a stride."""
_SHORTEST_NS: Final = WAY_NS // 2
_LONGEST_NS: Final = 2 * WAY_NS
_DISAGREE_M_S: Final = 2.0

Place = tuple[int, float, float]


class Motion:
    """One soldier's velocity, from its positions in the order of their times."""

    def __init__(self) -> None:
        self._smooth = SmoothVelocity()
        self._places: deque[Place] = deque()

    def update(self, position: Position) -> tuple[float, float]:
        """(east, north) m/s."""
        east, north, _ = position.velocity_m_s
        smooth = self._smooth.update(position.time_ns, east, north)
        now = position.time_ns, position.latitude_deg, position.longitude_deg
        way = _velocity(self._before(now), now)
        if way is None or math.dist(way, smooth) > _DISAGREE_M_S:
            return smooth
        return way

    def _before(self, now: Place) -> Place:
        """Where the way to ``now`` began; afresh when time goes back."""
        places = self._places
        if places and now[0] <= places[-1][0]:
            places.clear()
        places.append(now)
        while len(places) > 1 and now[0] - places[1][0] >= WAY_NS:
            places.popleft()
        return places[0]


def _velocity(begin: Place, end: Place) -> tuple[float, float] | None:
    """None if too little time lies between, or too much."""
    elapsed_ns = end[0] - begin[0]
    if not _SHORTEST_NS <= elapsed_ns <= _LONGEST_NS:
        return None
    elapsed_s = elapsed_ns / NS_PER_S
    turned_deg = (end[2] - begin[2] + 180.0) % 360.0 - 180.0
    east_m = turned_deg * METRES_PER_DEG * cosine(begin[1])
    return east_m / elapsed_s, (end[1] - begin[1]) * METRES_PER_DEG / elapsed_s
