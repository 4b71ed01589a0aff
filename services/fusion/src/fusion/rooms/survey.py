"""Draws the map of one's own walk: cells under the fused track, floor by floor, each with how sure its place is.

Only walking without satellites is drawn: outdoors a map of ways says nothing. What a camera has seen is added by
`Survey.see`. A cell that is found again keeps the better of both sigmas, and what is walked is no wall.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.geodesy import major_axis_sigma_m
from bootprint.messages import Position
from bootprint.rooms import MOST_RUNS, Cell, Kind, Place, RoomMap, cells_of, rounded_sigma_m, runs_of
from fusion.rooms.settings import RoomsConfig
from fusion.rooms.sight import Sight

_NEAR_A_FLOOR = 0.25  # of a storey: further off are stairs
_LONGEST_GAP_M = 2.0  # between two positions: more is a leap, not a way
_RANK: dict[Kind, int] = {"seen": 0, "wall": 1, "walked": 2}
_WALL_M = (0.4, 2.0)  # above the floor: neither floor nor ceiling, whatever the camera's tilt
_FARTHEST_M = 8.0
_MOST_CELLS = 40_000  # a hectare of them
_POINT_SIGMA = 0.05  # of its distance: a landmark's depth, the camera's heading
_MODES = ("boots", "camera", "body")


@dataclass(frozen=True, slots=True)
class Stood:
    """A place on a floor where the soldier was: ENU m, and one sigma of it."""

    floor: int
    east_m: float
    north_m: float
    up_m: float
    sigma_m: float


def stood_at(position: Position, floor_height_m: float | None, config: RoomsConfig) -> Stood | None:
    """Where a position without satellites stands; None outdoors, on stairs, or if nothing is known."""
    if position.mode not in _MODES:
        return None
    storey_m = floor_height_m or config.storey_m
    floor = round(position.up_m / storey_m)
    if floor_height_m is not None and abs(position.up_m / storey_m - floor) > _NEAR_A_FLOOR:
        return None
    ee, en, _, nn, _, _ = position.covariance_m2
    return Stood(floor, position.east_m, position.north_m, position.up_m, major_axis_sigma_m(ee, en, nn))


class Survey:
    """One soldier's map as it grows; goes on from ``known``, if there is one."""

    def __init__(self, config: RoomsConfig, soldier: str, known: RoomMap | None = None) -> None:
        self._config, self._soldier = config, soldier
        self._cells: dict[Place, Cell] = {}
        self._levels: dict[int, float] = {}
        self._hits: dict[Place, int] = {}  # landmarks seen there
        self._last: Stood | None = None
        self._told_ns: int | None = None
        self._grown = False
        self._sequence = 0
        self.full = False
        if known is not None and known.cell_m == config.cell_m:
            self._cells, self._levels = cells_of(known.runs), dict(known.levels)

    def walk(self, stood: Stood | None) -> None:
        """The soldier is there now, and went there straight from the place before."""
        last, self._last = self._last, stood
        if stood is None or stood.sigma_m > self._config.mapped_sigma_m:
            return
        self._levels.setdefault(stood.floor, stood.up_m)
        begin = last if last is not None and last.floor == stood.floor else stood
        way_m = math.hypot(stood.east_m - begin.east_m, stood.north_m - begin.north_m)
        if way_m > _LONGEST_GAP_M:
            begin, way_m = stood, 0.0
        for share in np.linspace(0.0, 1.0, 2 + int(2.0 * way_m / self._config.cell_m)):
            east = begin.east_m + share * (stood.east_m - begin.east_m)
            north = begin.north_m + share * (stood.north_m - begin.north_m)
            self.note(stood.floor, east, north, "walked", stood.sigma_m)

    def see(self, sight: Sight) -> None:
        """A camera on the soldier saw these points: walls, once they were seen often, and the space before them."""
        stood = self._last
        if stood is None or stood.sigma_m > self._config.mapped_sigma_m:
            return
        above = sight.points_m[:, 2] - stood.up_m
        for point in sight.points_m[(above > _WALL_M[0]) & (above < _WALL_M[1]), :2]:
            ray = point - sight.eye_m[:2]
            far_m = float(np.hypot(*ray))
            if not 0.0 < far_m < _FARTHEST_M:
                continue
            sigma_m = math.hypot(stood.sigma_m, _POINT_SIGMA * far_m)
            free = np.arange(0.0, far_m - 2.0 * self._config.cell_m, 0.5 * self._config.cell_m) / far_m
            for east, north in (sight.eye_m[:2] + free[:, None] * ray).tolist():
                self.note(stood.floor, east, north, "seen", sigma_m)
            place = self._place(stood.floor, float(point[0]), float(point[1]))
            if place in self._hits or len(self._hits) < _MOST_CELLS:
                self._hits[place] = self._hits.get(place, 0) + 1
            if self._hits.get(place, 0) >= self._config.wall_hits:
                self.note(stood.floor, float(point[0]), float(point[1]), "wall", sigma_m)

    def _place(self, floor: int, east_m: float, north_m: float) -> Place:
        size = self._config.cell_m
        return Place(floor, math.floor(north_m / size), math.floor(east_m / size))

    def note(self, floor: int, east_m: float, north_m: float, kind: Kind, sigma_m: float) -> None:
        """This place is of that kind."""
        place = self._place(floor, east_m, north_m)
        fresh = Cell(kind, rounded_sigma_m(sigma_m))
        known = self._cells.get(place)
        if known is None and len(self._cells) >= _MOST_CELLS:
            self.full = True
        elif known is None or _RANK[known.kind] < _RANK[kind]:
            self._cells[place], self._grown = fresh, True
        elif known.kind == kind and fresh.sigma_m < known.sigma_m:
            self._cells[place] = fresh

    def due(self, now_ns: int) -> RoomMap | None:
        """The map, if it has grown and was not told of late."""
        pause_ns = self._config.publish_s * NS_PER_S
        if not self._grown or (self._told_ns is not None and 0 <= now_ns - self._told_ns < pause_ns):
            return None
        self._told_ns, self._grown = now_ns, False
        return self.map(now_ns)

    def map(self, now_ns: int) -> RoomMap:
        """The map as it is; when it is full, what is only seen goes first."""
        runs = runs_of(self._cells)
        if len(runs) > MOST_RUNS:
            self.full = True
            runs = sorted(sorted(runs, key=lambda run: -_RANK[run[4]])[:MOST_RUNS])
        self._sequence += 1
        return RoomMap(
            time_ns=now_ns,
            sequence=self._sequence - 1,
            soldier=self._soldier,
            cell_m=self._config.cell_m,
            levels=tuple(sorted(self._levels.items())),
            runs=tuple(runs),
        )
