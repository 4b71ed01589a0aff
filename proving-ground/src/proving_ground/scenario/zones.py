"""Zones of a scenario as areas of space, and what they do to satellites and to light."""

import math
from collections.abc import Iterable

import numpy as np
from shapely import Polygon

from bootprint.geodesy import yaw_of_azimuth
from proving_ground.scenario.scenario import Scenario
from proving_ground.scenario.schema import world
from proving_ground.scenario.site import Site
from proving_ground.sensors.camera_world import LightZone
from proving_ground.sensors.gnss_conditions import Zone
from proving_ground.sensors.places import Area

_EVERYWHERE_M = 1e6
_BELOW_FLOOR_M = 0.3  # a storey's air reaches from a little under its floor ...
TOP_STOREY_M = 2.8  # ... to as much under the next one's; the highest is this high
_BEHIND_DOOR_M = 0.5  # over which satellites fade away: who is inside has none


def storey_span_m(site: Site, level: int) -> tuple[float, float]:
    """Heights from floor to ceiling of a storey."""
    floor_m = site.heights_m[level]
    above = [height for height in site.heights_m.values() if height > floor_m]
    return floor_m, min(above, default=floor_m + TOP_STOREY_M)


def storey_area(site: Site, outline: Polygon, level: int) -> Area:
    """A polygon of one storey, as high as the storey."""
    floor_m, ceiling_m = storey_span_m(site, level)
    corners = np.asarray(outline.exterior.coords)[:-1]
    return Area(corners, (floor_m - _BELOW_FLOOR_M, ceiling_m - _BELOW_FLOOR_M))


def building_areas(site: Site, building: str, levels: Iterable[int] = ()) -> list[Area]:
    """Storeys of a building, all or some."""
    chosen = list(levels) or list(site.heights_m)
    outlines = [(level, site.outline(building, level)) for level in chosen]
    return [storey_area(site, outline, level) for level, outline in outlines if not outline.is_empty]


def areas_of(zone: world.Zone, site: Site) -> list[Area]:
    """Where a zone is."""
    if zone.building is not None:
        return building_areas(site, zone.building, zone.floors)
    if zone.room is not None:
        space = site.spaces[zone.room]
        return [storey_area(site, space.polygon, space.level)]
    outline = zone.outline_m
    if outline is None:
        far = _EVERYWHERE_M
        outline = ((-far, -far), (far, -far), (far, far), (-far, far))
    if not zone.floors:
        return [Area(np.array(outline))]
    return [storey_area(site, Polygon(outline), level) for level in zone.floors]


def reception_zones(scenario: Scenario) -> tuple[Zone, ...]:
    """Zones for satellites: those of the scenario, and its buildings."""
    site = scenario.site
    zones = [
        Zone("indoors", area, _BEHIND_DOOR_M)
        for building in sorted(site.denied_buildings)
        for area in building_areas(site, building)
    ]
    for zone in scenario.file.zones:
        zones.extend(_reception(zone, area) for area in areas_of(zone, site) if not _is_light(zone))
    return tuple(zones)


def _is_light(zone: world.Zone) -> bool:
    return isinstance(zone, world.Dark | world.Smoke)


def _reception(zone: world.Zone, area: Area) -> Zone:
    start_s, end_s = _span(zone)
    match zone:
        case world.Denied():
            return Zone("indoors", area, zone.fade_m, start_s, end_s)
        case world.Multipath():
            return Zone("urban", area, zone.bias_m, start_s, end_s, outage_share=zone.outage_share)
        case world.Jammed():
            return Zone("jammed", area, zone.edge_m, start_s, end_s)
        case world.Spoofed():
            yaw = yaw_of_azimuth(math.radians(zone.towards_deg))
            return Zone("spoofed", area, zone.drag_m_s, start_s, end_s, direction_rad=yaw)
    raise AssertionError(f"{zone} is not about satellites")


def light_zones(scenario: Scenario) -> tuple[LightZone, ...]:
    """Zones for cameras."""
    zones = []
    for zone in scenario.file.zones:
        for area in areas_of(zone, scenario.site):
            if isinstance(zone, world.Dark):
                zones.append(LightZone("dark", area, zone.strength, *_span(zone)))
            elif isinstance(zone, world.Smoke):
                zones.append(LightZone("smoke", area, zone.extinction_per_m, *_span(zone)))
    return tuple(zones)


def _span(zone: world.Zone) -> tuple[float, float]:
    return (zone.from_s or -math.inf), (math.inf if zone.until_s is None else zone.until_s)
