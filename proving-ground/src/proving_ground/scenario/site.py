"""The site as geometry: spaces one can be in, walls between them, and the doors, stairs and lifts that join them.

Rooms share their walls: a wall is a line, where the outlines of two rooms run together, less the doors in it.
Everything outside is one space on the ground floor. Metres east and north of the scenario's origin.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiLineString, Point, Polygon

FloatArray = npt.NDArray[np.float64]
Xy = tuple[float, float]
OUTSIDE = "outside"
CLEARANCE_M = 0.3  # between a person's middle and a wall
_FAR_M = 20_000.0
_TOLERANCE_M = 1e-6


@dataclass(frozen=True)
class Space:
    """A room, or the outside: where a person can be without passing a door."""

    name: str
    level: int
    polygon: Polygon
    building: str | None = None

    @cached_property
    def free(self) -> Polygon:
        """Where the middle of a person may be; of a space that a neck splits, the larger part."""
        return _largest(self.polygon.buffer(-CLEARANCE_M, join_style="mitre"))

    @cached_property
    def within(self) -> Polygon:
        """`free` with a hair's width around, prepared for many questions."""
        grown = _largest(self.free.buffer(0.01, join_style="mitre"))
        shapely.prepare(grown)
        return grown

    def settle(self, at_m: Xy) -> Xy:
        """The nearest point where the middle of a person may be."""
        point = Point(at_m)
        if shapely.covers(self.within, point):
            return at_m
        nearest = shapely.shortest_line(self.free, point).coords[0]
        return float(nearest[0]), float(nearest[1])

    @property
    def middle_m(self) -> Xy:
        """Its centroid, or another point inside if that lies outside."""
        centre = self.free.centroid
        inside = centre if self.free.covers(centre) else self.free.representative_point()
        return inside.x, inside.y


@dataclass(frozen=True)
class Doorway:
    """A gap in a wall: its middle, the unit vector along the wall, and the spaces on both sides."""

    name: str
    spaces: tuple[str, str]
    level: int
    middle_m: Xy
    along: Xy
    width_m: float

    @property
    def gap(self) -> LineString:
        """From jamb to jamb."""
        (x, y), (east, north), half = self.middle_m, self.along, self.width_m / 2.0
        return LineString([(x - half * east, y - half * north), (x + half * east, y + half * north)])


@dataclass(frozen=True)
class Staircase:
    """Stairs from the space at the foot to the one at the head: foot and head of each flight in turn."""

    name: str
    spaces: tuple[str, str]
    points_m: tuple[Xy, ...]
    heights_m: tuple[float, ...]
    width_m: float


@dataclass(frozen=True)
class LiftShaft:
    """A lift: its car's middle and the spaces it stops in, from the bottom up."""

    name: str
    at_m: Xy
    spaces: tuple[str, ...]
    speed_m_s: float
    doors_s: float


@dataclass(frozen=True)
class Mound:
    """A hill as in the scenario: height · cos²(π/2 · distance/radius)."""

    at_m: Xy
    height_m: float
    radius_m: float

    def height(self, at_m: FloatArray) -> FloatArray:
        """Heights (n,) at points (n, 2)."""
        share = np.hypot(*(at_m - np.array(self.at_m)).T) / self.radius_m
        return np.where(share < 1.0, self.height_m * np.cos(0.5 * math.pi * share) ** 2, 0.0)


@dataclass(frozen=True)
class Site:
    """Spaces by name and what joins them; ``heights_m`` of the storeys by level; named places."""

    heights_m: dict[int, float]
    spaces: dict[str, Space]
    doors: tuple[Doorway, ...]
    stairs: tuple[Staircase, ...]
    lifts: tuple[LiftShaft, ...]
    mounds: tuple[Mound, ...]
    places: dict[str, tuple[Xy, int]]
    denied_buildings: frozenset[str]
    obstacles: dict[str, Polygon]
    bounds: Polygon | None = None

    @cached_property
    def walls(self) -> dict[int, MultiLineString]:
        """Walls by level, doors left open."""
        return {level: self._walls_of(level) for level in self.heights_m}

    def _walls_of(self, level: int) -> MultiLineString:
        solid = shapely.union_all([space.polygon.exterior for space in self.rooms(level)])
        gaps = shapely.union_all(
            [door.gap.buffer(_TOLERANCE_M, cap_style="flat") for door in self.doors if door.level == level]
        )
        return MultiLineString(_lines(shapely.line_merge(solid.difference(gaps))))

    def rooms(self, level: int | None = None) -> list[Space]:
        """All rooms, or those of one storey."""
        return [
            space
            for space in self.spaces.values()
            if space.building is not None and (level is None or space.level == level)
        ]

    def outline(self, building: str, level: int) -> Polygon:
        """What a building covers on one storey (empty if nothing)."""
        rooms = [space.polygon for space in self.rooms(level) if space.building == building]
        return _largest(shapely.union_all(rooms))

    def space_at(self, at_m: Xy, level: int) -> Space | None:
        """The room around a point of a storey, or on the ground floor the outside."""
        point = Point(at_m)
        for space in self.rooms(level):
            if space.polygon.covers(point):
                return space
        return self.spaces[OUTSIDE] if level == 0 else None

    def ground_m(self, at_m: FloatArray, space: str) -> FloatArray:
        """Heights (n,) of the ground under points (n, 2) of a space."""
        if space != OUTSIDE:
            return np.full(len(at_m), self.heights_m[self.spaces[space].level])
        return sum((mound.height(at_m) for mound in self.mounds), start=np.zeros(len(at_m)))


def outside(rooms: Iterable[Polygon], obstacles: Iterable[Polygon], bounds: Polygon | None) -> Space:
    """The ground around rooms on level 0 and obstacles."""
    ground = bounds or shapely.box(-_FAR_M, -_FAR_M, _FAR_M, _FAR_M)
    taken = shapely.union_all([*rooms, *obstacles])
    return Space(OUTSIDE, 0, _largest(ground.difference(taken)))


def shared_wall(first: Polygon, second: Polygon | None, others: Iterable[Polygon]) -> list[LineString]:
    """Straight pieces of wall that two rooms share; with no second one, those that ``first`` has for itself."""
    wall = first.exterior
    shared = (
        wall.intersection(second.exterior) if second else wall.difference(shapely.union_all(list(others)))
    )
    merged = shapely.line_merge(shared) if shared.geom_type == "MultiLineString" else shared
    return [
        LineString(pair)
        for line in _lines(merged)
        for pair in zip(line.coords[:-1], line.coords[1:], strict=True)
    ]


def _lines(shape: shapely.Geometry) -> list[LineString]:
    """The lines among whatever an intersection came to."""
    return [part for part in shapely.get_parts(shape) if part.geom_type in ("LineString", "LinearRing")]


def _largest(shape: shapely.Geometry) -> Polygon:
    """The largest polygon of a shape; an empty one if there is none."""
    polygons = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    return max(polygons, key=lambda polygon: polygon.area, default=Polygon())
