"""``[site]``: buildings with rooms, doors, stairs and lifts; the ground around them; places with names."""

from typing import Annotated

from msgspec import Meta

from bootprint.config import Config
from proving_ground.scenario.schema.units import Length, Name, Outline, Point, Rectangle, Speed, outline_of


class Shape(Config, kw_only=True, frozen=True):
    """A rectangle or a polygon: one of the two."""

    rectangle_m: Annotated[Rectangle | None, Meta(description="west, south, east, north")] = None
    polygon_m: Annotated[Outline | None, Meta(description="corners in order, in place of the rectangle")] = (
        None
    )

    def __post_init__(self) -> None:
        _ = self.outline_m

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """The corners."""
        return outline_of(self.rectangle_m, self.polygon_m)


class Floor(Config, kw_only=True, frozen=True):
    """A storey, the same in every building."""

    level: Annotated[int, Meta(ge=-20, le=200, description="0 is the ground floor, basements are negative")]
    height_m: Annotated[float, Meta(ge=-500, le=1000, description="of its floor above the scenario's origin")]


class Room(Shape, kw_only=True, frozen=True):
    """A room; its outline is where the middle of its walls is, so that neighbours share their walls."""

    name: Annotated[Name, Meta(description="unique on the site; tasks go there by this name")]
    floor: Annotated[int, Meta(description="level of the storey")] = 0


class Door(Config, kw_only=True, frozen=True):
    """An opening in the wall that two rooms share, or that a room shares with the `outside`."""

    between: Annotated[tuple[str, str], Meta(description='two rooms, or a room and "outside"')]
    at_m: Annotated[Point | None, Meta(description="its middle (default: the middle of the shared wall)")] = (
        None
    )
    width_m: Annotated[Length, Meta(description="of the opening")] = 0.9
    name: Annotated[
        str, Meta(description="tasks may name it (default: the rooms, as in `hall - kitchen`)")
    ] = ""


class Stairs(Config, kw_only=True, frozen=True):
    """A flight of stairs, or several joined by level landings: points are pairs, foot and head of each flight."""

    name: Name
    between: Annotated[tuple[str, str], Meta(description="the room at the foot and the room at the head")]
    points_m: Annotated[
        tuple[Point, ...],
        Meta(min_length=2, description="foot and head of each flight in turn, upwards"),
    ]
    width_m: Length = 1.2
    riser_m: Annotated[
        float, Meta(ge=0.1, le=0.25, description="height of one step (METHODS A8: 0.1625 to 0.196)")
    ] = 0.175

    def __post_init__(self) -> None:
        if len(self.points_m) % 2:
            raise ValueError("points_m are pairs, foot and head of each flight: their number must be even")


class Lift(Config, kw_only=True, frozen=True):
    """A lift whose car stops in one room on each floor."""

    name: Name
    at_m: Annotated[Point, Meta(description="middle of the car")]
    rooms: Annotated[tuple[str, ...], Meta(min_length=2, description="where it stops, from the bottom up")]
    speed_m_s: Speed = 1.0
    doors_s: Annotated[
        Length, Meta(description="from stepping in to moving, and from stopping to stepping out")
    ] = 4.0


class Building(Config, kw_only=True, frozen=True):
    """A building: nothing but its rooms and what joins them."""

    name: Name
    gps_denied: Annotated[bool, Meta(description="receivers get no fix inside")] = True
    iron: Annotated[
        float,
        Meta(ge=0, le=10, description="in floors and walls, which bends compasses; 0 is a wooden house"),
    ] = 1.0
    rooms: Annotated[tuple[Room, ...], Meta(min_length=1)]
    doors: tuple[Door, ...] = ()
    stairs: tuple[Stairs, ...] = ()
    lifts: tuple[Lift, ...] = ()


class Place(Config, kw_only=True, frozen=True):
    """A point with a name, for tasks to go to."""

    name: Name
    at_m: Point
    floor: int = 0


class Obstacle(Shape, kw_only=True, frozen=True):
    """Ground that nobody walks on: water, a wall, a building that nobody enters."""

    name: Name


class Hill(Config, kw_only=True, frozen=True):
    """A round hill, or a hollow: height · cos²(π/2 · distance/radius), nothing beyond its radius."""

    at_m: Point
    height_m: Annotated[float, Meta(ge=-1000, le=1000)]
    radius_m: Length


class SiteTable(Config, kw_only=True, frozen=True):
    """Where it happens; east and north in metres from the scenario's origin."""

    plan: Annotated[
        str | None, Meta(description="GeoJSON file beside the scenario; its features come before those below")
    ] = None
    floors: Annotated[tuple[Floor, ...], Meta(min_length=1)] = (Floor(level=0, height_m=0.0),)
    outdoor_m: Annotated[
        Outline | None, Meta(description="the ground one may walk on (default: no bounds)")
    ] = None
    buildings: tuple[Building, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    hills: tuple[Hill, ...] = ()
    places: tuple[Place, ...] = ()
