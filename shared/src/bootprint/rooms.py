"""Maps of rooms (METHODS D5b): where a soldier has walked, and what a camera has seen, floor by floor.

A map is a grid of square cells in ENU around the realm's origin: column ``c`` and row ``r`` are the cell of
``[c·cell_m, (c + 1)·cell_m)`` east and ``[r·cell_m, (r + 1)·cell_m)`` north. It travels as runs of equal cells
along its rows; people and files are told it as GeoJSON (`bootprint.rooms_geojson`).
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Final, Literal, NamedTuple

from msgspec import Meta

from bootprint.messages import Message, Name

Kind = Literal["walked", "seen", "wall"]
MOST_RUNS: Final = 4096
"""Of a whole map: some 60 kB on the bus."""
SIGMAS_M: Final = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)
"""How sure a cell's place is, rounded up to one of these, so that neighbours are alike."""
Floor = Annotated[int, Meta(ge=-100, le=1000)]
Index = Annotated[int, Meta(ge=-100_000, le=100_000)]
Length = Annotated[int, Meta(ge=1, le=10_000)]
Sigma = Annotated[float, Meta(gt=0.0, le=1000.0)]
Level = Annotated[float, Meta(ge=-10_000.0, le=10_000.0)]
Run = tuple[Floor, Index, Index, Length, Kind, Sigma]
"""Equal cells of a row: floor, row, first column, how many, what they are, one sigma of their place in m."""


class Place(NamedTuple):
    """Names a cell."""

    floor: int
    row: int
    column: int


class Cell(NamedTuple):
    """What a cell is, and the mapper's own horizontal sigma where it was found, m."""

    kind: Kind
    sigma_m: float


class RoomMap(Message, frozen=True):
    """All that a soldier's fusion has mapped up to ``time_ns``; it replaces what the same ``soldier`` told before.

    ``levels``: each floor's number, and its height above the realm's origin in m.
    """

    soldier: Name
    cell_m: Annotated[float, Meta(ge=0.1, le=10.0)]
    levels: Annotated[tuple[tuple[Floor, Level], ...], Meta(max_length=64)] = ()
    runs: Annotated[tuple[Run, ...], Meta(max_length=MOST_RUNS)] = ()


def rounded_sigma_m(sigma_m: float) -> float:
    """The least of `SIGMAS_M` that is not below; the largest for all beyond."""
    return next((each for each in SIGMAS_M if sigma_m <= each), SIGMAS_M[-1])


def runs_of(cells: Mapping[Place, Cell]) -> list[Run]:
    """Cells as runs, row by row."""
    runs: list[Run] = []
    for place in sorted(cells):
        cell = cells[place]
        if runs and _goes_on(runs[-1], place, cell):
            floor, row, first, length, kind, sigma_m = runs[-1]
            runs[-1] = (floor, row, first, length + 1, kind, sigma_m)
        else:
            runs.append((place.floor, place.row, place.column, 1, cell.kind, cell.sigma_m))
    return runs


def _goes_on(run: Run, place: Place, cell: Cell) -> bool:
    floor, row, first, length, kind, sigma_m = run
    return (floor, row, first + length, kind, sigma_m) == (*place, *cell)


def cells_of(runs: Iterable[Run]) -> dict[Place, Cell]:
    """Runs as cells; where runs overlap the last counts."""
    return {
        Place(floor, row, column): Cell(kind, sigma_m)
        for floor, row, first, length, kind, sigma_m in runs
        for column in range(first, first + length)
    }
