"""Ways through the site as legs of an itinerary: heights, gaits on stairs and in lifts, and keeping distance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bootprint.geodesy import wrap_angle
from proving_ground.people import GaitName, Leg
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.paths import Paths, Position, Stretch, Way
from proving_ground.scenario.site import OUTSIDE, LiftShaft, Site, Staircase, Xy

FloatArray = npt.NDArray[np.float64]
_HILL_STEP_M = 4.0  # way-points on hills are no further apart
_SHORTEST_M = 0.25  # what is nearer is not worth a step
_SHUFFLE_M = 0.15  # before and behind stairs and lifts, what is less is left out
_FAR_OFF_M = 1.0
_RIDE_S = 2.0  # a lift's starting and stopping
_TURN_START_S, _TURN_RAD_S = 0.4, 2.2  # a quick turn on the spot: 90° in 1.1 s, 180° in 1.8 s
_TURN_FROM_RAD = 0.5  # from here on one turns before one moves sideways or backward
# Yaw of the body relative to the way: stepping to the left one faces 90° right of it.
_FACING_RAD = {"side_step_left": -math.pi / 2, "side_step_right": math.pi / 2, "backward": math.pi}


@dataclass(frozen=True)
class Passage:
    """A way and how it is gone."""

    way: tuple[Stretch, ...]
    gait: GaitName
    speed_m_s: float | None


class Router:
    """Finds ways on a site and says what they are like under the feet."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.paths = Paths(site)

    def way(self, start: Position, goals: Sequence[Position], by: Way, key: str) -> list[Stretch]:
        """The shortest way through the goals in order; a fault at ``key`` if there is none."""
        stretches: list[Stretch] = []
        for goal in goals:
            found = self.paths.between(start, goal, by)
            if found is None:
                raise ScenarioFault(key, f"there is no way from {self.tell(start)} to {self.tell(goal)}")
            stretches.extend(found)
            start = goal
        return joined(stretches)

    def position(self, at_m: Xy, level: int, key: str) -> Position:
        """The point on a storey, or where that has no room on the ground; moved off walls.

        A fault at ``key`` if that moves it far: into water, or out of bounds.
        """
        space = self.site.space_at(at_m, level) or self.site.space_at(at_m, 0)
        assert space is not None  # the ground is everywhere
        settled = space.settle(at_m)
        if math.dist(settled, at_m) > _FAR_OFF_M:
            raise ScenarioFault(
                key, f"nobody can be at [{at_m[0]:g}, {at_m[1]:g}]: it is blocked or out of bounds"
            )
        return Position(settled, space.name)

    def tell(self, position: Position) -> str:
        """A position as a person says it."""
        east, north = position.at_m
        return f"[{east:.1f}, {north:.1f}] ({position.space})"

    def level(self, position: Position) -> int:
        """The storey."""
        return self.site.spaces[position.space].level

    def ground(self, position: Position) -> FloatArray:
        """The point (1, 3) under the feet."""
        return self._lifted(np.array([position.at_m]), [position.space])

    def legs(self, passage: Passage, yaw_rad: float) -> list[Leg]:
        """The legs of a passage that starts facing ``yaw_rad``."""
        legs: list[Leg] = []
        for stretch in passage.way:
            if isinstance(stretch.joint, Staircase):
                legs.append(_climb(stretch, stretch.joint))
            elif isinstance(stretch.joint, LiftShaft):
                legs.extend(self._ride(stretch, stretch.joint))
            elif length_m([stretch]) > _SHUFFLE_M:
                legs.extend(self._level(stretch, passage, yaw_rad))
            yaw_rad = final_yaw(legs, yaw_rad)
        return legs

    def _level(self, stretch: Stretch, passage: Passage, yaw_rad: float) -> list[Leg]:
        points = self._points(stretch)
        if passage.gait not in _FACING_RAD:
            return [Leg(passage.gait, points, speed_m_s=passage.speed_m_s)]
        legs: list[Leg] = []
        for start, end in pairwise(points):
            course = math.atan2(end[1] - start[1], end[0] - start[0])
            facing = yaw_rad + wrap_angle(course + _FACING_RAD[passage.gait] - yaw_rad)
            if abs(facing - yaw_rad) > _TURN_FROM_RAD:
                legs.append(turn_leg(start[None], facing - yaw_rad, facing))
            segment = np.stack([start, end])
            legs.append(Leg(passage.gait, segment, speed_m_s=passage.speed_m_s, facing_rad=facing))
            yaw_rad = facing
        return legs

    def _points(self, stretch: Stretch) -> FloatArray:
        """Way-points (k, 3) of a stretch on the level; outside with enough of them to follow the hills."""
        points = [stretch.points_m[0]]
        spaces = [stretch.spaces[0]]
        for end, space in zip(stretch.points_m[1:], stretch.spaces[1:], strict=True):
            hilly = space == OUTSIDE and spaces[-1] == OUTSIDE and self._hilly(points[-1], end)
            count = max(1, math.ceil(math.dist(points[-1], end) / _HILL_STEP_M)) if hilly else 1
            start = points[-1]
            for index in range(1, count + 1):
                share = index / count
                points.append(
                    end
                    if index == count
                    else (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
                )
                spaces.append(space)
        return self._lifted(np.array(points), spaces)

    def _hilly(self, start: Xy, end: Xy) -> bool:
        """Whether the straight line may touch a hill."""
        middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
        reach = 0.5 * math.dist(start, end)
        return any(math.dist(mound.at_m, middle) < mound.radius_m + reach for mound in self.site.mounds)

    def _lifted(self, points_m: FloatArray, spaces: Sequence[str]) -> FloatArray:
        heights = np.array(
            [self.site.ground_m(point[None], space)[0] for point, space in zip(points_m, spaces, strict=True)]
        )
        return np.column_stack([points_m, heights])

    def _ride(self, stretch: Stretch, lift: LiftShaft) -> list[Leg]:
        here, there = (
            self.ground(Position(point, space))
            for point, space in zip(stretch.points_m, stretch.spaces, strict=True)
        )
        rise_m = abs(float(there[0, 2] - here[0, 2]))
        return [
            Leg("stand", here, duration_s=lift.doors_s),
            Leg("lift", np.concatenate([here, there]), duration_s=rise_m / lift.speed_m_s + _RIDE_S),
            Leg("stand", there, duration_s=lift.doors_s),
        ]


def joined(stretches: Sequence[Stretch]) -> list[Stretch]:
    """The same way with neighbouring stretches on the level made one, none of which has no length."""
    result: list[Stretch] = []
    for stretch in stretches:
        if stretch.kind == "level" and length_m([stretch]) == 0.0:
            continue
        if result and result[-1].kind == stretch.kind == "level":
            before = result.pop()
            stretch = Stretch("level", before.points_m + stretch.points_m, before.spaces + stretch.spaces)
        result.append(_without_repeats(stretch) if stretch.kind == "level" else stretch)
    return result


def _without_repeats(stretch: Stretch) -> Stretch:
    """A stretch on the level that has no point twice in a row."""
    kept = [
        index
        for index, point in enumerate(stretch.points_m)
        if index == 0 or math.dist(point, stretch.points_m[index - 1]) > 1e-6
    ]
    points, spaces = stretch.points_m, stretch.spaces
    return Stretch("level", tuple(points[i] for i in kept), tuple(spaces[i] for i in kept))


def length_m(way: Sequence[Stretch]) -> float:
    """Horizontal length."""
    return sum(math.dist(a, b) for stretch in way for a, b in pairwise(stretch.points_m))


def worth_going(way: Sequence[Stretch]) -> bool:
    """Whether it is more than a shuffle."""
    return any(stretch.kind != "level" for stretch in way) or length_m(way) >= _SHORTEST_M


def trimmed(way: Sequence[Stretch], back_m: float, site: Site) -> list[Stretch]:
    """The way without its last ``back_m`` metres; nobody stops on stairs, so not further back than their end."""
    result = list(way)
    while back_m > 0.0 and result and result[-1].kind == "level":
        last = result.pop()
        length = length_m([last])
        if length > back_m:
            return [*result, _cut(last, length - back_m, site)]
        back_m -= length
    return result


def _cut(stretch: Stretch, at_m: float, site: Site) -> Stretch:
    """A stretch on the level up to an arc length; its end is moved off the walls."""
    points, spaces = [stretch.points_m[0]], [stretch.spaces[0]]
    for point, space in zip(stretch.points_m[1:], stretch.spaces[1:], strict=True):
        step = math.dist(points[-1], point)
        if step >= at_m:
            share = at_m / step if step else 0.0
            (x0, y0), (x1, y1) = points[-1], point
            level = site.spaces[space].level
            end = (x0 + share * (x1 - x0), y0 + share * (y1 - y0))
            around = site.space_at(end, level) or site.spaces[space]
            return Stretch("level", (*points, around.settle(end)), (*spaces, around.name))
        points.append(point)
        spaces.append(space)
        at_m -= step
    return stretch


def in_car(way: Sequence[Stretch], offset_m: Xy) -> list[Stretch]:
    """The way of one who stands beside the middle of every lift's car."""
    result = list(way)
    for index, stretch in enumerate(result):
        if stretch.kind != "lift" or index == 0:
            continue
        result[index] = replace(
            stretch, points_m=tuple(_beside(point, offset_m) for point in stretch.points_m)
        )
        before = result[index - 1]
        if before.kind == "level":
            result[index - 1] = replace(
                before, points_m=(*before.points_m[:-1], _beside(before.points_m[-1], offset_m))
            )
        if index + 1 < len(result) and result[index + 1].kind == "level":
            after = result[index + 1]
            result[index + 1] = replace(
                after, points_m=(_beside(after.points_m[0], offset_m), *after.points_m[1:])
            )
    return result


def _beside(point: Xy, offset_m: Xy) -> Xy:
    return point[0] + offset_m[0], point[1] + offset_m[1]


def turn_leg(place_m: FloatArray, by_rad: float, facing_rad: float) -> Leg:
    """A turn on the spot (1, 3) to a yaw, as quick as feet allow."""
    duration_s = _TURN_START_S + abs(by_rad) / _TURN_RAD_S
    return Leg("turn", place_m, duration_s=duration_s, facing_rad=facing_rad)


def course_rad(way: Sequence[Stretch]) -> float | None:
    """The direction in which a way sets off; None for a lift's ride, in which one stands."""
    for stretch in way:
        if stretch.kind == "lift":
            return None
        for start, end in pairwise(stretch.points_m):
            if math.dist(start, end) > _SHUFFLE_M:
                return math.atan2(end[1] - start[1], end[0] - start[0])
    return None


def final_yaw(legs: Sequence[Leg], yaw_rad: float) -> float:
    """Which way one faces after these legs, having faced ``yaw_rad`` before."""
    for leg in reversed(legs):
        if leg.facing_rad is not None:
            return leg.facing_rad
        if leg.gait != "lift" and len(leg.points_m) > 1:
            east, north = (leg.points_m[-1] - leg.points_m[-2])[:2]
            return math.atan2(north, east)
    return yaw_rad


def _climb(stretch: Stretch, stairs: Staircase) -> Leg:
    """Up or down all flights, landings between them."""
    points = np.column_stack([np.array(stairs.points_m), np.array(stairs.heights_m)])
    return Leg("stairs", points if stretch.points_m[0] == stairs.points_m[0] else points[::-1])
