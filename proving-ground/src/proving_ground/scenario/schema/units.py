"""Types that several tables of a scenario share: lengths, points, spans of time, and places."""

from typing import Annotated

from msgspec import Meta

Length = Annotated[float, Meta(gt=0)]
Seconds = Annotated[float, Meta(ge=0)]
Share = Annotated[float, Meta(ge=0, le=1)]
Coordinate = Annotated[float, Meta(ge=-20_000, le=20_000)]
Speed = Annotated[float, Meta(ge=0.1, le=9)]
Point = tuple[Coordinate, Coordinate]
Outline = Annotated[tuple[Point, ...], Meta(min_length=3)]
Rectangle = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
Name = Annotated[str, Meta(min_length=1)]
Spot = str | Point


def outline_of(rectangle: Rectangle | None, polygon: Outline | None) -> tuple[Point, ...]:
    """The corners of whichever of the two is given; ValueError unless it is exactly one."""
    if (rectangle is None) == (polygon is None):
        raise ValueError(
            "needs either rectangle_m = [west, south, east, north] or polygon_m, a list of corners"
        )
    if polygon is not None:
        return polygon
    assert rectangle is not None
    west, south, east, north = rectangle
    if not (west < east and south < north):
        raise ValueError(
            f"rectangle_m {list(rectangle)} must be [west, south, east, north], west < east, south < north"
        )
    return ((west, south), (east, south), (east, north), (west, north))
