"""From the scenario's ``[site]`` to geometry; whatever does not fit together is a fault at its own key."""

import difflib
import math
from collections.abc import Collection, Iterable

import shapely
from shapely import LineString, Point, Polygon

from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.schema.site import Building, Door, Hill, Lift, SiteTable, Stairs
from proving_ground.scenario.site import (
    CLEARANCE_M,
    OUTSIDE,
    Doorway,
    LiftShaft,
    Mound,
    Site,
    Space,
    Staircase,
    Xy,
    outside,
    shared_wall,
)

_NEAR_M = 0.3  # a door's stated middle may lie this far off its wall
_CAR_HALF_M = 0.5  # a lift's car, from its middle to where people stand
_OVERLAP_M2 = 0.05
_TREAD_M = (0.2, 0.45)  # depth of a step that people can climb


def build_site(table: SiteTable) -> Site:
    """The site's geometry; ScenarioFault names the first table that does not fit."""
    heights = _heights(table)
    rooms = _rooms(table, heights)
    obstacles = {obstacle.name: Polygon(obstacle.outline_m) for obstacle in table.obstacles}
    bounds = Polygon(table.outdoor_m) if table.outdoor_m else None
    ground_rooms = [space.polygon for space in rooms.values() if space.level == 0]
    spaces = {**rooms, OUTSIDE: outside(ground_rooms, obstacles.values(), bounds)}
    parts = _Joints(spaces, heights)
    for index, building in enumerate(table.buildings):
        parts.add(building, f"site.buildings[{index}]")
    places = _places(table, spaces, heights)
    return Site(
        heights_m=heights,
        spaces=spaces,
        doors=tuple(parts.doors),
        stairs=tuple(parts.stairs),
        lifts=tuple(parts.lifts),
        mounds=tuple(_mound(hill, f"site.hills[{i}]", ground_rooms) for i, hill in enumerate(table.hills)),
        places=places,
        denied_buildings=frozenset(building.name for building in table.buildings if building.gps_denied),
        obstacles=obstacles,
        bounds=bounds,
    )


def known(name: str, names: Collection[str], key: str, what: str) -> str:
    """``name`` if it is one of ``names``; else a fault that says what was meant."""
    if name in names:
        return name
    nearest = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"known: {', '.join(sorted(names)) or 'none'}"
    raise ScenarioFault(key, f"there is no {what} {name!r}; {hint}")


def _heights(table: SiteTable) -> dict[int, float]:
    heights: dict[int, float] = {}
    for index, floor in enumerate(table.floors):
        if floor.level in heights:
            raise ScenarioFault(f"site.floors[{index}]", f"floor {floor.level} stands there twice")
        heights[floor.level] = floor.height_m
    ordered = [heights[level] for level in sorted(heights)]
    if ordered != sorted(set(ordered)):
        raise ScenarioFault("site.floors", "heights of the floors must rise with their levels")
    if heights.setdefault(0, 0.0) != 0.0:
        raise ScenarioFault("site.floors", "floor 0 must be at height_m = 0.0, the ground outside")
    return heights


def _rooms(table: SiteTable, heights: dict[int, float]) -> dict[str, Space]:
    rooms: dict[str, Space] = {}
    for place, building in enumerate(table.buildings):
        for index, room in enumerate(building.rooms):
            key = f"site.buildings[{place}].rooms[{index}]"
            if room.name in rooms or room.name == OUTSIDE:
                raise ScenarioFault(key, f"the name {room.name!r} is taken; make each room's unique")
            if room.floor not in heights:
                raise ScenarioFault(key, f"there is no floor {room.floor}; add it to site.floors")
            space = Space(room.name, room.floor, Polygon(room.outline_m), building.name)
            _check_room(space, rooms.values(), key)
            rooms[room.name] = space
    return rooms


def _check_room(space: Space, others: Iterable[Space], key: str) -> None:
    if not space.polygon.is_valid:
        raise ScenarioFault(key, f"the outline of {space.name!r} crosses itself")
    if space.free.is_empty:
        raise ScenarioFault(key, f"{space.name!r} is too narrow for a person ({2 * CLEARANCE_M:g} m)")
    for other in others:
        if other.level == space.level and other.polygon.intersection(space.polygon).area > _OVERLAP_M2:
            raise ScenarioFault(key, f"{space.name!r} and {other.name!r} overlap")


def _places(
    table: SiteTable, spaces: dict[str, Space], heights: dict[int, float]
) -> dict[str, tuple[Xy, int]]:
    places: dict[str, tuple[Xy, int]] = {}
    for index, place in enumerate(table.places):
        key = f"site.places[{index}]"
        if place.name in places or place.name in spaces:
            raise ScenarioFault(key, f"the name {place.name!r} is taken")
        if place.floor not in heights:
            raise ScenarioFault(key, f"there is no floor {place.floor}; add it to site.floors")
        places[place.name] = (place.at_m, place.floor)
    return places


def _mound(hill: Hill, key: str, ground_rooms: list[Polygon]) -> Mound:
    if any(Point(hill.at_m).distance(room) < hill.radius_m for room in ground_rooms):
        raise ScenarioFault(key, "a hill must not reach under a building: move it or make radius_m smaller")
    return Mound(hill.at_m, hill.height_m, hill.radius_m)


class _Joints:
    """Collects doors, stairs and lifts of the buildings, each checked against the rooms it joins."""

    def __init__(self, spaces: dict[str, Space], heights_m: dict[int, float]) -> None:
        self.doors: list[Doorway] = []
        self.stairs: list[Staircase] = []
        self.lifts: list[LiftShaft] = []
        self._spaces = spaces
        self._heights = heights_m
        self._names: set[str] = set()

    def add(self, building: Building, key: str) -> None:
        """Everything of one building."""
        for index, door in enumerate(building.doors):
            self.doors.append(self._door(door, f"{key}.doors[{index}]"))
        for index, stairs in enumerate(building.stairs):
            self.stairs.append(self._staircase(stairs, f"{key}.stairs[{index}]"))
        for index, lift in enumerate(building.lifts):
            self.lifts.append(self._lift(lift, f"{key}.lifts[{index}]"))

    def _unique(self, name: str, key: str) -> str:
        if name in self._names:
            raise ScenarioFault(key, f"the name {name!r} is taken; give this one another name")
        self._names.add(name)
        return name

    def _space(self, name: str, key: str) -> Space:
        return self._spaces[known(name, self._spaces, key, "room")]

    def _door(self, door: Door, key: str) -> Doorway:
        first, second = sorted(
            (self._space(name, key) for name in door.between), key=lambda space: space.name == OUTSIDE
        )
        if first is second or first.level != second.level or first.name == OUTSIDE:
            raise ScenarioFault(key, "a door joins two different rooms of one floor, or one and the outside")
        walls = self._walls(first, second)
        if not walls:
            raise ScenarioFault(key, f"{first.name!r} and {second.name!r} share no wall")
        wall, middle = _place_door(door, walls, key)
        (x0, y0), (x1, y1) = wall.coords
        along = ((x1 - x0) / wall.length, (y1 - y0) / wall.length)
        name = self._unique(door.name or " - ".join(door.between), key)
        return Doorway(name, (first.name, second.name), first.level, middle, along, door.width_m)

    def _walls(self, first: Space, second: Space) -> list[LineString]:
        if second.name != OUTSIDE:
            return shared_wall(first.polygon, second.polygon, ())
        others = [s.polygon for s in self._spaces.values() if s.level == first.level and s is not first]
        return shared_wall(first.polygon, None, [other for other in others if other is not second.polygon])

    def _staircase(self, stairs: Stairs, key: str) -> Staircase:
        foot, head = (self._space(name, key) for name in stairs.between)
        if not foot.level < head.level:
            raise ScenarioFault(key, f"the foot, {foot.name!r}, must be on a floor below {head.name!r}")
        for space, end in ((foot, stairs.points_m[0]), (head, stairs.points_m[-1])):
            _check_inside(space, end, key, "the end of the stairs")
        heights = _climb(stairs, self._heights[foot.level], self._heights[head.level], key)
        name = self._unique(stairs.name, key)
        return Staircase(name, stairs.between, stairs.points_m, heights, stairs.width_m)

    def _lift(self, lift: Lift, key: str) -> LiftShaft:
        spaces = [self._space(name, key) for name in lift.rooms]
        levels = [space.level for space in spaces]
        if levels != sorted(set(levels)):
            raise ScenarioFault(key, "rooms of a lift must be listed from the bottom up, one a floor")
        for space in spaces:
            for east in (-_CAR_HALF_M, _CAR_HALF_M):
                for north in (-_CAR_HALF_M, _CAR_HALF_M):
                    corner = (lift.at_m[0] + east, lift.at_m[1] + north)
                    _check_inside(space, corner, key, "the lift's car")
        return LiftShaft(self._unique(lift.name, key), lift.at_m, lift.rooms, lift.speed_m_s, lift.doors_s)


def _climb(stairs: Stairs, foot_m: float, head_m: float, key: str) -> tuple[float, ...]:
    """Height at each of the stairs' points; a fault if nobody could climb them."""
    lengths = [math.dist(a, b) for a, b in zip(stairs.points_m[::2], stairs.points_m[1::2], strict=True)]
    risers = max(round((head_m - foot_m) / stairs.riser_m), 1)
    tread_m = sum(lengths) / risers
    low_m, high_m = _TREAD_M
    if not low_m <= tread_m <= high_m:
        raise ScenarioFault(
            key,
            f"{risers} steps of {stairs.riser_m:g} m on {sum(lengths):.1f} m of flights are {tread_m:.2f} m deep: "
            f"make the flights {low_m * risers:.1f} to {high_m * risers:.1f} m long",
        )
    heights = [foot_m]
    for length in lengths:
        heights += [heights[-1] + (head_m - foot_m) * length / sum(lengths)] * 2
    return tuple(heights[:-1])


def _check_inside(space: Space, at_m: Xy, key: str, what: str) -> None:
    if not shapely.covers(space.within, Point(at_m)):
        east, north = at_m
        raise ScenarioFault(
            key,
            f"{what} at [{east:g}, {north:g}] is not inside {space.name!r}, {CLEARANCE_M:g} m off its walls",
        )


def _place_door(door: Door, walls: list[LineString], key: str) -> tuple[LineString, Xy]:
    """The piece of wall that the door is in, and its middle; a fault if it does not fit there."""
    if door.at_m is None:
        wall = max(walls, key=lambda line: line.length)
        middle = wall.interpolate(0.5, normalized=True)
    else:
        stated = Point(door.at_m)
        wall = min(walls, key=lambda line: line.distance(stated))
        if wall.distance(stated) > _NEAR_M:
            raise ScenarioFault(
                key, f"at_m is {wall.distance(stated):.1f} m off the wall of {' and '.join(door.between)}"
            )
        middle = wall.interpolate(wall.project(stated))
    room = min(wall.project(middle), wall.length - wall.project(middle))
    if door.width_m / 2.0 > room + 1e-9:
        raise ScenarioFault(
            key, f"a door of {door.width_m:g} m does not fit there: {math.floor(200 * room) / 100:g} m would"
        )
    return wall, (middle.x, middle.y)
