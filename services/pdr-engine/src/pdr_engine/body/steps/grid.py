"""The regular stream that steps are looked for in: 50 cells a second, whatever the sensor's rate.

A cell holds the mean over its 20 ms of the signal drawn straight between the samples. A fast sensor is thereby
low-passed before it is thinned, a slow one filled in, short gaps bridged.
"""

from collections.abc import Iterator
from typing import NamedTuple

CELL_NS = 20_000_000
CELL_S = CELL_NS * 1e-9


class Cell(NamedTuple):
    """Means over one cell that begins at ``time_ns``; ``values`` as they were put in."""

    time_ns: int
    values: tuple[float, ...]


class Grid:
    """Turns values at any times into cells. Cells begin at multiples of 20 ms of event time."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._before: tuple[float, ...] | None = None
        self._time_ns = 0
        self._cell = 0
        self._sums = [0.0] * width

    def restart(self) -> None:
        """Forget the unfinished cell: the stream broke."""
        self._before = None

    def add(self, time_ns: int, values: tuple[float, ...]) -> Iterator[Cell]:
        """Take values in; yields each cell that is finished by them."""
        if self._before is None:
            self._begin(time_ns, values)
            return
        while (edge_ns := (self._cell + 1) * CELL_NS) <= time_ns:
            share = (edge_ns - self._time_ns) / (time_ns - self._time_ns)
            at_edge = tuple(a + share * (b - a) for a, b in zip(self._before, values, strict=True))
            self._integrate(edge_ns, at_edge)
            yield Cell(self._cell * CELL_NS, tuple(total / CELL_NS for total in self._sums))
            self._cell += 1
            self._sums = [0.0] * self._width
        if time_ns > self._time_ns:
            self._integrate(time_ns, values)

    def _begin(self, time_ns: int, values: tuple[float, ...]) -> None:
        """The part of the first cell before the first sample is taken to be like it."""
        self._cell = time_ns // CELL_NS
        lead_ns = time_ns - self._cell * CELL_NS
        self._sums = [value * lead_ns for value in values]
        self._before, self._time_ns = values, time_ns

    def _integrate(self, time_ns: int, values: tuple[float, ...]) -> None:
        assert self._before is not None
        half_ns = 0.5 * (time_ns - self._time_ns)
        before = self._before
        self._sums = [s + half_ns * (a + b) for s, a, b in zip(self._sums, before, values, strict=True)]
        self._before, self._time_ns = values, time_ns
