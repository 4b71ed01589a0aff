"""What surrounds the soldiers of a scenario, as the sensors' models want it: iron, air, sky, walls and light."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely

from bootprint.clock import NS_PER_S
from bootprint.geomagnetism import earth_field
from proving_ground.people import leg_duration_s
from proving_ground.scenario.scenario import Play, Scenario
from proving_ground.scenario.schema.world import Dipole
from proving_ground.scenario.site import Doorway
from proving_ground.scenario.zones import (
    TOP_STOREY_M,
    building_areas,
    light_zones,
    reception_zones,
    storey_span_m,
)
from proving_ground.sensors.air import Air, DoorSlam, LiftShaft
from proving_ground.sensors.camera_world import CameraWorld, Figure, Slab
from proving_ground.sensors.gnss_conditions import GnssConditions
from proving_ground.sensors.magnetics import Dipoles, Magnetics, iron_row, lift_shaft, storey_iron
from proving_ground.sensors.places import Area, Walls

_CAR_M = 1.0  # from the middle of a lift's car to its walls
_SLAM_SHARE = 0.3  # of the doors fall shut behind the first who passes
_SLAM_AFTER_S = 1.5
_DOOR_MIDDLE_M = 1.0  # above its floor
_REACH_M = 0.7  # who comes so near to a door's middle goes through it


@dataclass(frozen=True)
class Surroundings:
    """Everything around the soldiers of one play; the same for the same seed."""

    scenario: Scenario
    play: Play
    seed: int

    @cached_property
    def magnetics(self) -> Magnetics:
        """The earth's field and all iron: buildings', lifts', and the scenario's own."""
        file = self.scenario.file
        field = earth_field(file.origin, round(file.start.timestamp() * NS_PER_S))
        return Magnetics(field, sum([*self._bodies(), *self._rails(), *self._storeys()], start=Dipoles()))

    def _bodies(self) -> Iterator[Dipoles]:
        """Single pieces and rows of iron that the scenario names."""
        for index, body in enumerate(self.scenario.file.magnetic):
            height_m = self.scenario.site.heights_m[body.floor] + body.up_m
            if isinstance(body, Dipole):
                yield Dipoles(np.array([[*body.at_m, height_m]]), np.array([body.moment_a_m2]))
                continue
            points = np.column_stack([body.points_m, np.full(len(body.points_m), height_m)])
            for piece, (start, end) in enumerate(pairwise(points)):
                seed = self._seed(1, index, piece)
                yield iron_row(start, end, body.spacing_m, body.moment_a_m2, seed)

    def _rails(self) -> Iterator[Dipoles]:
        """Rails and counterweights of lifts."""
        site = self.scenario.site
        for index, lift in enumerate(site.lifts):
            heights = [site.heights_m[site.spaces[space].level] for space in lift.spaces]
            foot = np.array([*lift.at_m, heights[0]])
            yield lift_shaft(foot, heights[-1] + TOP_STOREY_M, self._seed(2, index))

    def _storeys(self) -> Iterator[Dipoles]:
        """Reinforcement and fittings, storey by storey."""
        site = self.scenario.site
        for index, building in enumerate(self.scenario.file.site.buildings):
            for level in site.heights_m if building.iron else ():
                outline = site.outline(building.name, level)
                if not outline.is_empty:
                    (west, south, east, north), (low, high) = outline.bounds, storey_span_m(site, level)
                    box = np.array([[west, south, low], [east, north, high]])
                    yield storey_iron(box[0], box[1], self._seed(7, index, level + 100), building.iron)

    @cached_property
    def sky(self) -> GnssConditions:
        """Where satellites can be received."""
        return GnssConditions(reception_zones(self.scenario), self.outer_walls, seed=self._seed(3))

    @cached_property
    def air(self) -> Air:
        """The air: weather, wind, doors and lifts."""
        file, site = self.scenario.file, self.scenario.site
        return Air(
            origin_height_m=file.origin.height_m,
            drift_pa_per_sqrt_h=file.weather.drift_pa_per_sqrt_h,
            offset_pa=file.weather.offset_pa,
            wind_m_s=file.weather.wind_m_s,
            indoors=tuple(area for b in file.site.buildings for area in building_areas(site, b.name)),
            doors=tuple(self._slams()),
            lifts=tuple(LiftShaft(_car(lift.at_m)) for lift in site.lifts),
            seed=self._seed(4),
        )

    @cached_property
    def walls(self) -> Walls:
        """All walls, from floor to ceiling, doors open."""
        ends, heights = [], []
        for level, walls in self.scenario.site.walls.items():
            for wall in shapely.get_parts(walls):
                for pair in pairwise(wall.coords):
                    ends.append(pair)
                    heights.append(storey_span_m(self.scenario.site, level))
        return _walls(ends, heights)

    @cached_property
    def outer_walls(self) -> Walls:
        """The ground floor's walls towards the outside: what reflects satellites."""
        site = self.scenario.site
        outlines = [site.outline(building.name, 0) for building in self.scenario.file.site.buildings]
        ends = [pair for o in outlines if not o.is_empty for pair in pairwise(o.exterior.coords)]
        return _walls(ends, [storey_span_m(site, 0)] * len(ends))

    def view(self, figures: tuple[Figure, ...]) -> CameraWorld:
        """What a camera sees, people among it."""
        return CameraWorld(self.walls, self._slabs, figures, light_zones(self.scenario), seed=self._seed(5))

    @cached_property
    def _slabs(self) -> tuple[Slab, ...]:
        """The ground, and floors and ceilings of every storey of every building."""
        site = self.scenario.site
        slabs = {Slab(0.0)}
        for building in self.scenario.file.site.buildings:
            for level in site.heights_m:
                outline = site.outline(building.name, level)
                if not outline.is_empty:
                    west, south, east, north = outline.bounds
                    for height_m in storey_span_m(site, level):
                        slabs.add(Slab(height_m, (west, south), (east, north)))
        return tuple(sorted(slabs, key=lambda slab: (slab.height_m, slab.low_m)))

    @property
    def floors_m(self) -> tuple[float, ...]:
        """Heights of the floors between storeys."""
        return tuple(sorted(self.scenario.site.heights_m.values()))[1:]

    def _seed(self, *what: int) -> int:
        """A seed of its own for each part."""
        return int(np.random.SeedSequence([self.seed, *what]).generate_state(1)[0])

    def _slams(self) -> list[DoorSlam]:
        """Some doors fall shut behind the first who goes through them."""
        rng = np.random.default_rng(self._seed(6))
        slams = []
        for door in self.scenario.site.doors:
            chosen = rng.random() < _SLAM_SHARE
            first_s = self._first_through(door)
            if chosen and first_s is not None:
                height_m = self.scenario.site.heights_m[door.level] + _DOOR_MIDDLE_M
                slams.append(DoorSlam(first_s + _SLAM_AFTER_S, np.array([*door.middle_m, height_m])))
        return slams

    def _first_through(self, door: Doorway) -> float | None:
        """When somebody first goes through a door; at an even pace along the leg that leads through it."""
        floor_m, ceiling_m = storey_span_m(self.scenario.site, door.level)
        middle = shapely.Point(door.middle_m)
        times = []
        for soldier, table in self.play.timetables.items():
            start_s = table.itinerary.start_s
            for leg in table.itinerary.legs:
                duration_s = leg_duration_s(self.play.persons[soldier], leg)
                if leg.travels and floor_m <= leg.points_m[0, 2] < ceiling_m:
                    way = shapely.LineString(leg.points_m[:, :2])
                    if way.distance(middle) < _REACH_M and way.intersects(door.gap):
                        times.append(start_s + duration_s * way.project(middle, normalized=True))
                start_s += duration_s
        return min(times, default=None)


def _car(at_m: tuple[float, float]) -> Area:
    return Area.box(at_m[0] - _CAR_M, at_m[1] - _CAR_M, at_m[0] + _CAR_M, at_m[1] + _CAR_M)


def _walls(
    ends: list[tuple[tuple[float, ...], tuple[float, ...]]], heights: list[tuple[float, float]]
) -> Walls:
    if not ends:
        return Walls()
    return Walls(np.array(ends), np.array(heights))
