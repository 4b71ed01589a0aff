"""Maps of rooms as GeoJSON (RFC 7946) and back: a feature for each floor, kind and sigma, of rectangles.

A file of it is what a soldier's computer keeps, and every map viewer opens it.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, Final

import msgspec

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from bootprint.messages import TimeNs
from bootprint.rooms import Kind, RoomMap, Run

_DIGITS: Final = 9  # of a degree: a tenth of a millimetre
Ring = list[tuple[float, float]]
Rectangle = tuple[int, int, int, int]
"""First column and row, columns, rows."""


class _Properties(msgspec.Struct, kw_only=True):
    kind: Kind
    floor: int
    level_m: float
    sigma_m: float


class _Geometry(msgspec.Struct, kw_only=True):
    type: str
    coordinates: list[list[Ring]]


class _Feature(msgspec.Struct, kw_only=True):
    geometry: _Geometry
    properties: _Properties


class _File(msgspec.Struct, kw_only=True):
    soldier: str
    time_ns: TimeNs
    cell_m: float
    features: list[_Feature]


def geojson(rooms: RoomMap, origin: Origin) -> dict[str, Any]:
    """A map as a feature collection; longitudes and latitudes of the cells' outlines at their floor's level."""
    frame, levels = LocalFrame(origin), dict(rooms.levels)
    groups: dict[tuple[int, Kind, float], list[Run]] = defaultdict(list)
    for run in rooms.runs:
        groups[run[0], run[4], run[5]].append(run)
    features = [
        {
            "type": "Feature",
            "geometry": {
                "type": "MultiPolygon",
                "coordinates": [
                    [_ring(frame, each, rooms.cell_m, levels.get(floor, 0.0))] for each in _rectangles(runs)
                ],
            },
            "properties": {
                "kind": kind,
                "floor": floor,
                "level_m": levels.get(floor, 0.0),
                "sigma_m": sigma_m,
                "soldier": rooms.soldier,
            },
        }
        for (floor, kind, sigma_m), runs in sorted(groups.items())
    ]
    return {
        "type": "FeatureCollection",
        "soldier": rooms.soldier,
        "time_ns": rooms.time_ns,
        "cell_m": rooms.cell_m,
        "features": features,
    }


def _rectangles(runs: Iterable[Run]) -> list[Rectangle]:
    """Runs with equal ones in the next rows, as one each."""
    grown: dict[tuple[int, int], Rectangle] = {}  # by first column and length, the newest
    done: list[Rectangle] = []
    for _, row, first, length, _, _ in sorted(runs):
        known = grown.get((first, length))
        if known is not None and known[1] + known[3] == row:
            grown[first, length] = (first, known[1], length, known[3] + 1)
            continue
        if known is not None:
            done.append(known)
        grown[first, length] = (first, row, length, 1)
    return [*done, *grown.values()]


def _ring(frame: LocalFrame, rectangle: Rectangle, cell_m: float, level_m: float) -> Ring:
    """Counter-clockwise, closed."""
    column, row, columns, rows = rectangle
    corners = ((0, 0), (columns, 0), (columns, rows), (0, rows), (0, 0))
    return [_place(frame, (column + x) * cell_m, (row + y) * cell_m, level_m) for x, y in corners]


def _place(frame: LocalFrame, east_m: float, north_m: float, up_m: float) -> tuple[float, float]:
    latitude, longitude, _ = frame.to_geodetic(east_m, north_m, up_m)
    return round(longitude, _DIGITS), round(latitude, _DIGITS)


def read_geojson(data: bytes, origin: Origin) -> RoomMap:
    """What `geojson` made; ValueError if it is anything else."""
    try:
        file = msgspec.json.decode(data, type=_File)
    except msgspec.MsgspecError as error:
        raise ValueError(f"no map of rooms: {error}") from error
    frame = LocalFrame(origin)
    levels = {each.properties.floor: each.properties.level_m for each in file.features}
    runs = [run for feature in file.features for run in _runs(frame, feature, file.cell_m)]
    return RoomMap(
        time_ns=file.time_ns,
        soldier=file.soldier,
        cell_m=file.cell_m,
        levels=tuple(sorted(levels.items())),
        runs=tuple(sorted(runs)),
    )


def _runs(frame: LocalFrame, feature: _Feature, cell_m: float) -> list[Run]:
    told, found = feature.properties, []
    for polygon in feature.geometry.coordinates:
        if len(polygon) != 1 or len(polygon[0]) != 5:
            raise ValueError("no map of rooms: a polygon is no rectangle")
        column, row, columns, rows = _rectangle(frame, polygon[0], told.level_m, cell_m)
        found += [
            (told.floor, row + up, column, columns, told.kind, told.sigma_m) for up in range(max(rows, 0))
        ]
    return found


def _rectangle(
    frame: LocalFrame, ring: Sequence[tuple[float, float]], up_m: float, cell_m: float
) -> Rectangle:
    # The plane is tangent: heights that differ from the level's by the earth's curvature move nothing here.
    height_m = frame.origin.height_m + up_m
    first, last = (frame.to_enu(latitude, longitude, height_m) for longitude, latitude in (ring[0], ring[2]))
    column, row = round(first[0] / cell_m), round(first[1] / cell_m)
    return column, row, round(last[0] / cell_m) - column, round(last[1] / cell_m) - row
