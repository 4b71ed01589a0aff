"""Where a foot was of late: the newest places of its steps and poses, which move along when the filter moves."""

from bisect import bisect_right
from typing import Final

import numpy as np

from fusion.state import Array, xyz
from fusion.transform import RigidTransform

MOST: Final = 64
"""Places remembered: about five seconds."""


class Trail:
    """Times (ns, ascending) and places (3,) m. Both grow to twice of what is remembered, then the old half goes."""

    __slots__ = ("_first", "_places", "_times_ns")

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._places = np.empty((2 * MOST, 3))
        self._first = 0

    def __bool__(self) -> bool:
        """Whether any place is remembered."""
        return bool(self._times_ns)

    @property
    def span_ns(self) -> tuple[int, int]:
        """The oldest and the newest time; IndexError if there is none."""
        return self._times_ns[self._first], self._times_ns[-1]

    def clear(self) -> None:
        """Nothing is known any more."""
        self._times_ns.clear()
        self._first = 0

    def put(self, time_ns: int, place: Array) -> None:
        """The foot was there then; what is no newer than the last is put in its stead."""
        times = self._times_ns
        if not times or time_ns > times[-1]:
            if len(times) == 2 * MOST:
                self._forget()
            times.append(time_ns)
            self._first = max(0, len(times) - MOST)
        self._places[len(times) - 1] = place

    def _forget(self) -> None:
        self._places[:MOST] = self._places[MOST:]
        del self._times_ns[:MOST]

    def at(self, time_ns: int) -> Array:
        """Where it was, between the places around that time, the nearest one beyond them, (3,) m.

        IndexError if no place is remembered.
        """
        times = self._times_ns
        if not times:
            raise IndexError("no place is remembered")
        after = bisect_right(times, time_ns, lo=self._first)
        if after in (self._first, len(times)):
            nearest: Array = self._places[max(after - 1, self._first)].copy()
            return nearest
        before = after - 1
        share = (time_ns - times[before]) / (times[after] - times[before])
        place: Array = self._places[before] + share * (self._places[after] - self._places[before])
        return place

    def moved_since(self, time_ns: int) -> Array | None:
        """How far it went since then, (3,) m; None if that is not remembered."""
        if not self or time_ns < self._times_ns[self._first]:
            return None
        moved: Array = self._places[len(self._times_ns) - 1] - self.at(time_ns)
        return moved

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        self._times_ns = [time_ns + by_ns for time_ns in self._times_ns]

    def carry(self, by_m: Array) -> None:
        """All places have moved, (3,) m."""
        self._places[: len(self._times_ns)] += by_m

    def transform(self, by: RigidTransform) -> None:
        """Into another frame."""
        for place in self._places[: len(self._times_ns)]:
            place[:] = by.point(xyz(place))
