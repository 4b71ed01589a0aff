"""A site's plan as GeoJSON (RFC 7946): read from a file beside the scenario, written for maps and pages.

Every feature has ``properties.kind``: room, door, stairs, lift, place, obstacle, outdoor; the other properties are
the keys of that table in the scenario, a room's, door's, stairs' and lift's ``building`` by name. Coordinates are
longitude and latitude; the scenario's origin turns them into metres. Walls are written too, and not read: they
follow from the rooms.
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import shapely

from bootprint.config import Origin, fit
from bootprint.config_errors import Misfit
from bootprint.errors import ConfigError
from bootprint.geodesy import LocalFrame
from proving_ground.scenario.schema.scenario import ScenarioFile
from proving_ground.scenario.schema.site import SiteTable
from proving_ground.scenario.site import Site, Xy

Feature = dict[str, Any]
_KINDS = ("room", "door", "stairs", "lift", "place", "obstacle", "outdoor")
_IN_BUILDING = {"room": "rooms", "door": "doors", "stairs": "stairs", "lift": "lifts"}
_ON_SITE = {"place": "places", "obstacle": "obstacles"}
_COORDINATES = {
    "room": ("Polygon", "polygon_m"),
    "obstacle": ("Polygon", "polygon_m"),
    "outdoor": ("Polygon", "outdoor_m"),
    "stairs": ("LineString", "points_m"),
    "door": ("Point", "at_m"),
    "lift": ("Point", "at_m"),
    "place": ("Point", "at_m"),
}
_DIGITS = 9  # of a degree: a tenth of a millimetre


def read_plan(path: Path, file: ScenarioFile) -> ScenarioFile:
    """The scenario with the plan's features before its own; ConfigError names the feature at fault."""
    values = _site_values(path, _features(path), LocalFrame(file.origin))
    site = fit(values, SiteTable)
    if isinstance(site, Misfit):
        raise ConfigError(f"{path}: {site.reason}")
    own = file.site
    merged = SiteTable(
        floors=own.floors,
        outdoor_m=own.outdoor_m or site.outdoor_m,
        buildings=site.buildings + own.buildings,
        obstacles=site.obstacles + own.obstacles,
        hills=own.hills,
        places=site.places + own.places,
    )
    return _with_site(file, merged)


def _with_site(file: ScenarioFile, site: SiteTable) -> ScenarioFile:
    values = {name: getattr(file, name) for name in file.__struct_fields__}
    return ScenarioFile(**{**values, "site": site})


def _features(path: Path) -> list[Feature]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: not valid JSON: {error}") from error
    features = document.get("features") if isinstance(document, dict) else None
    if not isinstance(features, list):
        raise ConfigError(f"{path}: not a GeoJSON FeatureCollection")
    return features


def _site_values(path: Path, features: list[Feature], frame: LocalFrame) -> dict[str, Any]:
    values: dict[str, Any] = {"buildings": [], "places": [], "obstacles": []}
    buildings: dict[str, dict[str, Any]] = {}
    for index, feature in enumerate(features):
        where = f"{path}: features[{index}]"
        kind, row = _row(feature, frame, where)
        if kind == "outdoor":
            values["outdoor_m"] = row["outdoor_m"]
        elif kind in _ON_SITE:
            values[_ON_SITE[kind]].append(row)
        elif kind in _IN_BUILDING:
            name = row.pop("building", None)
            if not isinstance(name, str):
                raise ConfigError(f"{where}: a {kind} needs the property 'building', the name of one")
            buildings.setdefault(name, {"name": name}).setdefault(_IN_BUILDING[kind], []).append(row)
    values["buildings"] = list(buildings.values())
    return values


def _row(feature: Feature, frame: LocalFrame, where: str) -> tuple[str, dict[str, Any]]:
    """A feature's kind and its row of the scenario's table."""
    properties = feature.get("properties") if isinstance(feature, dict) else None
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    if not isinstance(properties, dict) or not isinstance(geometry, dict):
        raise ConfigError(f"{where}: not a GeoJSON feature with properties and geometry")
    kind = properties.get("kind")
    if kind == "wall":
        return kind, {}
    if kind not in _KINDS:
        raise ConfigError(f"{where}: properties.kind is {kind!r}: expected one of {', '.join(_KINDS)}")
    shape, key = _COORDINATES[kind]
    if geometry.get("type") != shape:
        raise ConfigError(f"{where}: a {kind} must be a {shape}, not {geometry.get('type')!r}")
    row = {name: value for name, value in properties.items() if name != "kind" and value is not None}
    row[key] = _local(geometry.get("coordinates"), shape, frame, where)
    return kind, row


def _local(coordinates: Any, shape: str, frame: LocalFrame, where: str) -> Any:
    try:
        if shape == "Point":
            return _metres(coordinates, frame)
        if shape == "LineString":
            return [_metres(pair, frame) for pair in coordinates]
        ring = coordinates[0][:-1] if coordinates[0][0] == coordinates[0][-1] else coordinates[0]
        return [_metres(pair, frame) for pair in ring]
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise ConfigError(f"{where}: coordinates must be numbers, longitude before latitude") from error


def _metres(pair: Any, frame: LocalFrame) -> list[float]:
    longitude, latitude = float(pair[0]), float(pair[1])
    if not (abs(longitude) <= 180.0 and abs(latitude) <= 90.0):
        raise ValueError("not degrees")
    east, north, _ = frame.to_enu(latitude, longitude, frame.origin.height_m)
    return [round(east, 3), round(north, 3)]


# -- writing ------------------------------------------------------------------------------------------------------


def write_plan(site: Site, table: SiteTable, origin: Origin) -> dict[str, Any]:
    """The site as a FeatureCollection: what the scenario says, and the walls that follow from it."""
    frame = LocalFrame(origin)
    features = [*_declared(site, table), *_walls(site)]
    return {"type": "FeatureCollection", "features": [_to_degrees(feature, frame) for feature in features]}


def _declared(site: Site, table: SiteTable) -> Iterable[Feature]:
    if table.outdoor_m:
        yield _feature("outdoor", _polygon(table.outdoor_m))
    for obstacle in table.obstacles:
        yield _feature("obstacle", _polygon(obstacle.outline_m), name=obstacle.name)
    for building in table.buildings:
        for room in building.rooms:
            shape = _polygon(room.outline_m)
            yield _feature("room", shape, name=room.name, floor=room.floor, building=building.name)
        for stairs in building.stairs:
            yield _feature(
                "stairs",
                {"type": "LineString", "coordinates": stairs.points_m},
                building=building.name,
                name=stairs.name,
                between=list(stairs.between),
                width_m=stairs.width_m,
                riser_m=stairs.riser_m,
            )
        for lift in building.lifts:
            yield _feature(
                "lift",
                {"type": "Point", "coordinates": lift.at_m},
                building=building.name,
                name=lift.name,
                rooms=list(lift.rooms),
                speed_m_s=lift.speed_m_s,
                doors_s=lift.doors_s,
            )
    yield from _doors(site)
    for place in table.places:
        yield _feature(
            "place", {"type": "Point", "coordinates": place.at_m}, name=place.name, floor=place.floor
        )


def _doors(site: Site) -> Iterable[Feature]:
    for door in site.doors:
        yield _feature(
            "door",
            {"type": "Point", "coordinates": door.middle_m},
            building=site.spaces[door.spaces[0]].building,
            name=door.name,
            between=list(door.spaces),
            width_m=door.width_m,
        )


def _walls(site: Site) -> Iterable[Feature]:
    for level, walls in site.walls.items():
        for wall in shapely.get_parts(walls):
            yield _feature("wall", {"type": "LineString", "coordinates": list(wall.coords)}, floor=level)


def _feature(kind: str, geometry: Feature, **properties: Any) -> Feature:
    return {"type": "Feature", "properties": {"kind": kind, **properties}, "geometry": geometry}


def _polygon(outline: Iterable[Xy]) -> Feature:
    """Counter-clockwise and closed, as RFC 7946 wants it."""
    ring = shapely.orient_polygons(shapely.Polygon(list(outline))).exterior
    return {"type": "Polygon", "coordinates": [list(ring.coords)]}


def _to_degrees(feature: Feature, frame: LocalFrame) -> Feature:
    geometry = feature["geometry"]
    return {**feature, "geometry": {**geometry, "coordinates": _degrees(geometry["coordinates"], frame)}}


def _degrees(coordinates: Any, frame: LocalFrame) -> Any:
    if isinstance(coordinates[0], float | int):
        latitude, longitude, _ = frame.to_geodetic(coordinates[0], coordinates[1], 0.0)
        return [round(longitude, _DIGITS), round(latitude, _DIGITS)]
    return [_degrees(inner, frame) for inner in coordinates]
