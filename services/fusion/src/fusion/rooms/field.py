"""A map's floor as a field: how much likelier a walk passes a point, for the map, than any other point around.

A point at distance d from where the mapper walked weighs ``k = exp(−d²/2s²)``. Somebody who walks there by the map
has density ``(1 − e)·k/k̄ + e`` in units of somebody's who may walk anywhere in the area, with k̄ the mean of k over
the area and e the share of a walk that goes where the mapper did not. Of ground that is walked all over nothing is
learned, as k/k̄ is one everywhere. A wall that was seen weighs nothing: nobody walks in it.
"""

import math
from functools import cached_property

import numpy as np

from bootprint.rooms import RoomMap, cells_of
from fusion.rooms.settings import RoomsConfig
from fusion.state import Array

_STEP_M = 0.25  # of the field
_REACH = 3.0  # sigmas: further off a walk is elsewhere
_CHUNK = 4096


class RoomField:
    """One floor of a map."""

    def __init__(self, rooms: RoomMap, floor: int, config: RoomsConfig) -> None:
        cells = {place: cell for place, cell in cells_of(rooms.runs).items() if place.floor == floor}
        self._config = config
        # A cell is as wide as it is: its middle is that much beside the way.
        self._scale_m = math.hypot(config.walked_sigma_m, rooms.cell_m / math.sqrt(12.0))
        self.walked = _middles(rooms, [place[1:] for place, cell in cells.items() if cell.kind == "walked"])
        self._walls = _middles(rooms, [place[1:] for place, cell in cells.items() if cell.kind == "wall"])
        self._cell_m = rooms.cell_m
        self._sigma_m = np.array([cell.sigma_m for cell in cells.values() if cell.kind == "walked"])

    @cached_property
    def corner(self) -> Array:
        """The lower left end of the field, (2,) m."""
        return np.asarray(self.walked.min(axis=0) - _REACH * self._scale_m)

    @cached_property
    def weights(self) -> Array:
        """k on a grid, (rows, columns), from the corner on."""
        far = self.walked.max(axis=0) + _REACH * self._scale_m
        columns, rows = (np.ceil((far - self.corner) / _STEP_M) + 1).astype(int)
        east, north = np.meshgrid(np.arange(columns), np.arange(rows))
        points = self.corner + _STEP_M * np.column_stack([east.ravel(), north.ravel()])
        weights = np.exp(-0.5 * (_distances(points, self.walked) / self._scale_m) ** 2)
        if len(self._walls):
            weights[_distances(points, self._walls) < 0.5 * self._cell_m] = 0.0
        return np.asarray(weights.reshape(rows, columns))

    def at(self, points: Array) -> Array:
        """k at points (..., 2) m; zero beyond the field."""
        index = np.rint((points - self.corner) / _STEP_M).astype(int)
        rows, columns = self.weights.shape
        inside = (index >= 0).all(axis=-1) & (index[..., 0] < columns) & (index[..., 1] < rows)
        column, row = np.where(inside, index[..., 0], 0), np.where(inside, index[..., 1], 0)
        return np.where(inside, self.weights[row, column], 0.0)

    def mean(self, low: Array, high: Array) -> float:
        """Mean of k over a rectangle between (2,) and (2,) m."""
        east = np.arange(low[0], high[0] + _STEP_M, _STEP_M)
        north = np.arange(low[1], high[1] + _STEP_M, _STEP_M)
        return float(self.at(np.stack(np.meshgrid(east, north), axis=-1)).mean())

    def sigma_m(self, points: Array) -> float:
        """How sure the mapper was where the map passes points (n, 2): the median."""
        squared = ((points[:, None] - self.walked[None]) ** 2).sum(axis=2)
        return float(np.median(self._sigma_m[squared.argmin(axis=1)]))


def _middles(rooms: RoomMap, rows_columns: list[tuple[int, int]]) -> Array:
    """Middles (n, 2) m of cells."""
    at = np.array(rows_columns, dtype=np.float64).reshape(-1, 2)[:, ::-1]
    return np.asarray((at + 0.5) * rooms.cell_m)


def _distances(points: Array, others: Array) -> Array:
    """How far from the nearest of the others each point is, (n,) m."""
    found = []
    for begin in range(0, len(points), _CHUNK):
        some = points[begin : begin + _CHUNK]
        squared = (some**2).sum(axis=1)[:, None] + (others**2).sum(axis=1)[None] - 2.0 * some @ others.T
        found.append(squared.min(axis=1))
    return np.asarray(np.sqrt(np.maximum(np.concatenate(found), 0.0)))
