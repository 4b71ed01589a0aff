"""How far stairs are believed that pressure tells of: in wind most of them soon come to nothing.

A gust is a climb of a metre or less that no stairs follow; a flight rises by more. So stairs that rise as a flight
does are believed, and those that have only begun by as much as such beginnings lately turned out to be flights.
"""

_FLIGHT_M = 1.5
_FIRST_FLIGHTS, _FIRST_GUSTS = 4.0, 1.0  # as if so many had been seen before
_KEPT = 0.9  # of what was seen, at each further one


class Stairways:
    """Follows the heights of steps and what they were taken for."""

    def __init__(self) -> None:
        self._flights, self._gusts = _FIRST_FLIGHTS, _FIRST_GUSTS
        self._last_m: float | None = None
        self._foot_m: float | None = None  # where the stairs at hand began
        self._is_flight = False

    def step(self, is_stairs: bool, height_m: float | None) -> float:
        """The probability that a step taken for one on stairs is one; ``height_m`` where it ended."""
        if height_m is None or not is_stairs:
            self._leave()
        elif self._foot_m is None:
            self._foot_m = height_m if self._last_m is None else self._last_m
        elif not self._is_flight and abs(height_m - self._foot_m) > _FLIGHT_M:
            self._is_flight = True
            self._count(1.0, 0.0)
        self._last_m = height_m
        return 1.0 if self._is_flight else self._flights / (self._flights + self._gusts)

    def _leave(self) -> None:
        if self._foot_m is not None and not self._is_flight:
            self._count(0.0, 1.0)
        self._foot_m, self._is_flight = None, False

    def _count(self, flights: float, gusts: float) -> None:
        self._flights = _KEPT * self._flights + flights
        self._gusts = _KEPT * self._gusts + gusts
