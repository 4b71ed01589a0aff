"""What a camera can see: walls, floors, ceilings, moving people and the light; and casting rays at it.

People are upright cylinders. Light and smoke are those where the camera is: nearly right, since soldiers see
little beyond the room they are in.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.places import Area, Walls

SKY = -1
SIGHT_M = 100.0  # walls further off are not looked at
_PARALLEL = 1e-9
_NEAREST_M = 1e-3


@dataclass(frozen=True)
class Slab:
    """A floor or ceiling: a level rectangle from ``low_m`` to ``high_m`` (east, north) at a height."""

    height_m: float
    low_m: tuple[float, float] = (-np.inf, -np.inf)
    high_m: tuple[float, float] = (np.inf, np.inf)


@dataclass(frozen=True)
class Figure:
    """Somebody in view: an upright cylinder that stands ``below_m`` below its motion and follows it."""

    motion: Motion
    radius_m: float = 0.25
    height_m: float = 1.8
    below_m: float = 1.0


@dataclass(frozen=True)
class LightZone:
    """Darkness (``strength``: share of the light that is missing) or smoke (``strength``: extinction, 1/m)."""

    kind: Literal["dark", "smoke"]
    area: Area
    strength: float
    start_s: float = -np.inf
    end_s: float = np.inf

    def amount(self, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        """Its strength where it is felt, else 0, at times (n,) and places (n, 3)."""
        active = (time_s >= self.start_s) & (time_s < self.end_s) & self.area.holds(place_m)
        return np.where(active, self.strength, 0.0)


@dataclass(frozen=True)
class CameraWorld:
    """Everything in view. ``contrast``: of the textures, 0 blank walls to 1; ``seed`` chooses them.

    ``tile_m``: surfaces repeat the same pattern after so much.
    """

    walls: Walls = field(default_factory=Walls)
    slabs: tuple[Slab, ...] = ()
    figures: tuple[Figure, ...] = ()
    zones: tuple[LightZone, ...] = ()
    contrast: float = 0.6
    seed: int = 0
    tile_m: float | None = None

    @property
    def first_figure(self) -> int:
        """The number of the first surface that moves; walls come first, then slabs, then figures."""
        return len(self.walls) + len(self.slabs)

    def light(self, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        """Share of full light at times (n,) and places (n, 3), (n,)."""
        share = np.ones(len(time_s))
        for zone in self.zones:
            if zone.kind == "dark":
                share = np.minimum(share, 1.0 - zone.amount(time_s, place_m))
        return share

    def smoke_per_m(self, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        """Extinction at times (n,) and places (n, 3), 1/m, (n,)."""
        total = np.zeros(len(time_s))
        for zone in self.zones:
            if zone.kind == "smoke":
                total += zone.amount(time_s, place_m)
        return total


@dataclass(frozen=True)
class Hits:
    """What rays (m, r) meet first: ``distance`` in lengths of the ray's direction (inf: nothing), the ``surface``'s
    number (SKY: none), and the place on it, ``along_m`` and ``across_m``."""

    distance: FloatArray
    surface: npt.NDArray[np.int64]
    along_m: FloatArray
    across_m: FloatArray


@dataclass(frozen=True)
class _Meeting:
    """Where rays (m, r) meet one surface; ``distance`` inf where they do not."""

    distance: FloatArray
    along_m: FloatArray
    across_m: FloatArray


def cast(world: CameraWorld, time_s: FloatArray, origin_m: FloatArray, direction: FloatArray) -> Hits:
    """Cast rays of directions (m, r, 3) from origins (m, 3) at times (m,)."""
    shape = direction.shape[:2]
    distance, surface = np.full(shape, np.inf), np.full(shape, SKY)
    along, across = np.zeros(shape), np.zeros(shape)
    for number, meeting in _meetings(world, time_s, origin_m, direction):
        nearer = meeting.distance < distance
        distance = np.where(nearer, meeting.distance, distance)
        surface[nearer] = number
        along = np.where(nearer, meeting.along_m, along)
        across = np.where(nearer, meeting.across_m, across)
    return Hits(distance, surface, along, across)


def _meetings(
    world: CameraWorld, time_s: FloatArray, origin_m: FloatArray, direction: FloatArray
) -> Iterator[tuple[int, _Meeting]]:
    """The surfaces in sight, each with its number."""
    for number in world.walls.near(origin_m, SIGHT_M):
        ends, heights = world.walls.ends_m[number], world.walls.heights_m[number]
        yield int(number), _meet_wall(ends, heights, origin_m, direction)
    for number, slab in enumerate(world.slabs, start=len(world.walls)):
        yield number, _meet_slab(slab, origin_m, direction)
    for number, figure in enumerate(world.figures, start=world.first_figure):
        yield number, _meet_figure(figure, figure.motion.at(time_s)[0], origin_m, direction)


def _meet_wall(
    ends_m: FloatArray, heights_m: FloatArray, origin_m: FloatArray, direction: FloatArray
) -> _Meeting:
    """Plan: origin + t·ray = start + s·side, by Cramer's rule."""
    side = ends_m[1] - ends_m[0]
    length = float(np.linalg.norm(side))
    apart = (ends_m[0] - origin_m[:, :2])[:, None]
    x, y = direction[..., 0], direction[..., 1]
    turn = x * side[1] - y * side[0]
    turn = np.where(np.abs(turn) < _PARALLEL, np.inf, turn)
    distance = (apart[..., 0] * side[1] - apart[..., 1] * side[0]) / turn
    share = (apart[..., 0] * y - apart[..., 1] * x) / turn
    height = origin_m[:, 2:] + distance * direction[..., 2]
    met = (distance > _NEAREST_M) & (share >= 0.0) & (share <= 1.0)
    met &= (height >= heights_m[0]) & (height <= heights_m[1])
    return _Meeting(np.where(met, distance, np.inf), share * length, height)


def _meet_slab(slab: Slab, origin_m: FloatArray, direction: FloatArray) -> _Meeting:
    rise = np.where(np.abs(direction[..., 2]) < _PARALLEL, np.inf, direction[..., 2])
    distance = (slab.height_m - origin_m[:, 2:]) / rise
    east, north = (origin_m[:, axis, None] + distance * direction[..., axis] for axis in (0, 1))
    met = (distance > _NEAREST_M) & (east >= slab.low_m[0]) & (east <= slab.high_m[0])
    met &= (north >= slab.low_m[1]) & (north <= slab.high_m[1])
    return _Meeting(np.where(met, distance, np.inf), east, north)


def _meet_figure(
    figure: Figure, place_m: FloatArray, origin_m: FloatArray, direction: FloatArray
) -> _Meeting:
    """Plan: |origin + t·ray − centre|² = radius²; the nearer root."""
    apart = (origin_m - place_m)[:, None]
    square = (direction[..., :2] ** 2).sum(axis=-1)
    half = (apart[..., :2] * direction[..., :2]).sum(axis=-1)
    rest = half**2 - square * ((apart[..., :2] ** 2).sum(axis=-1) - figure.radius_m**2)
    distance = (-half - np.sqrt(np.maximum(rest, 0.0))) / np.maximum(square, _PARALLEL)
    height = apart[..., 2] + figure.below_m + distance * direction[..., 2]
    met = (rest > 0.0) & (distance > _NEAREST_M) & (height >= 0.0) & (height <= figure.height_m)
    across = np.arctan2(*(apart[..., axis] + distance * direction[..., axis] for axis in (1, 0)))
    return _Meeting(np.where(met, distance, np.inf), across * figure.radius_m, height)
