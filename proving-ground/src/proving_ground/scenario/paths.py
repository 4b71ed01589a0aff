"""The shortest way on foot from one point of a site to another: a visibility graph through doors, stairs and lifts.

Nodes are the corners that stand out into a space, both sides of every door, both ends of every staircase and
every stop of a lift. Two nodes of one space are joined where the straight line between them keeps its distance
from the walls; the shortest ways between all nodes are computed once (Dijkstra).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import Polygon

from proving_ground.scenario.site import Doorway, LiftShaft, Site, Space, Staircase, Xy

FloatArray = npt.NDArray[np.float64]
Way = Literal["stairs", "lift"]
DOOR_STEP_M = 0.45  # from the middle of a door to where one stands before it
_UPHILL = 2.0  # a metre of stairs costs as much as two on the level
_LIFT_COST_M = 15.0  # what a ride costs, so that nobody takes it without changing floors
_UNWANTED = 1e5  # a lift where stairs were asked for, or the other way round: only if there is no other way


@dataclass(frozen=True)
class Position:
    """A point of a space."""

    at_m: Xy
    space: str


@dataclass(frozen=True)
class Stretch:
    """Part of a way: with the space of each point on the level, or up and down by stairs or lift."""

    kind: Literal["level", "stairs", "lift"]
    points_m: tuple[Xy, ...]
    spaces: tuple[str, ...]
    joint: Staircase | LiftShaft | None = None


Joint = Doorway | Staircase | LiftShaft


class Paths:
    """Answers questions for the shortest way on one site."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._nodes: list[Position] = []
        self._joints: dict[tuple[int, int], Joint] = {}
        self._add_joints()
        self._add_corners()

    def between(self, start: Position, goal: Position, by: Way = "stairs") -> list[Stretch] | None:
        """The shortest way, or None if there is none."""
        if start.space == goal.space and self._sees(start, goal):
            return [Stretch("level", (start.at_m, goal.at_m), (start.space, goal.space))]
        chain = self._chain(start, goal, by)
        return None if chain is None else self._stretches(start, chain, goal)

    def doors_along(self, way: list[Stretch]) -> list[Doorway]:
        """The doors that a way leads through, in order."""
        doors = []
        for stretch in way:
            for before, after in zip(stretch.spaces, stretch.spaces[1:], strict=False):
                if before != after and stretch.kind == "level":
                    doors.append(self._door_of(stretch, before, after))
        return doors

    def _door_of(self, stretch: Stretch, before: str, after: str) -> Doorway:
        line = shapely.LineString(stretch.points_m)
        candidates = [door for door in self._site.doors if set(door.spaces) == {before, after}]
        return min(candidates, key=lambda door: line.distance(shapely.Point(door.middle_m)))

    # -- the graph ----------------------------------------------------------------------------------------------

    def _add(self, at_m: Xy, space: str) -> int:
        self._nodes.append(Position(at_m, space))
        return len(self._nodes) - 1

    def _join(self, first: int, second: int, joint: Joint) -> None:
        self._joints[first, second] = self._joints[second, first] = joint

    def _add_joints(self) -> None:
        for door in self._site.doors:
            first, second = (self._add(door_side(self._site, door, space), space) for space in door.spaces)
            self._join(first, second, door)
        for stairs in self._site.stairs:
            foot = self._add(stairs.points_m[0], stairs.spaces[0])
            self._join(foot, self._add(stairs.points_m[-1], stairs.spaces[1]), stairs)
        for lift in self._site.lifts:
            stops = [self._add(lift.at_m, space) for space in lift.spaces]
            for index, stop in enumerate(stops):
                for other in stops[index + 1 :]:
                    self._join(stop, other, lift)

    def _add_corners(self) -> None:
        for space in self._site.spaces.values():
            for corner in jutting_corners(space.free):
                self._add(corner, space.name)

    @cached_property
    def _in_space(self) -> dict[str, list[int]]:
        found: dict[str, list[int]] = {name: [] for name in self._site.spaces}
        for index, node in enumerate(self._nodes):
            found[node.space].append(index)
        return found

    @cached_property
    def _solved(self) -> dict[Way, tuple[FloatArray, npt.NDArray[np.int32]]]:
        """By way of changing floors: distances between all nodes, and each node's predecessor on the way."""
        return {"stairs": self._solve(_UNWANTED, 1.0), "lift": self._solve(1.0, _UNWANTED)}

    def _solve(self, lift_factor: float, stairs_factor: float) -> tuple[FloatArray, npt.NDArray[np.int32]]:
        size = len(self._nodes)
        lengths = np.zeros((size, size))
        for space, nodes in self._in_space.items():
            self._fill_visible(lengths, self._site.spaces[space], nodes)
        for (first, second), joint in self._joints.items():
            lengths[first, second] = self._cost(first, second, joint, lift_factor, stairs_factor)
        distances, predecessors = dijkstra(csr_array(lengths), return_predecessors=True)
        return distances, predecessors

    def _cost(self, first: int, second: int, joint: Joint, lift_factor: float, stairs_factor: float) -> float:
        if isinstance(joint, Staircase):
            return (
                _UPHILL * stairs_factor * float(np.linalg.norm(np.diff(joint.points_m, axis=0), axis=1).sum())
            )
        if isinstance(joint, LiftShaft):
            return _LIFT_COST_M * lift_factor
        return math.dist(self._nodes[first].at_m, self._nodes[second].at_m)

    def _fill_visible(self, lengths: FloatArray, space: Space, nodes: list[int]) -> None:
        if len(nodes) < 2:
            return
        first, second = np.triu_indices(len(nodes), k=1)
        places = np.array([self._nodes[node].at_m for node in nodes])
        ends = np.stack([places[first], places[second]], axis=1)
        seen = shapely.covers(space.within, shapely.linestrings(ends))
        distance = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        index = np.array(nodes)
        # Nodes at one point are joined by a hair: zero means "not joined" to the solver.
        lengths[index[first[seen]], index[second[seen]]] = np.maximum(distance[seen], 1e-9)
        lengths[index[second[seen]], index[first[seen]]] = np.maximum(distance[seen], 1e-9)

    # -- questions ----------------------------------------------------------------------------------------------

    def _sees(self, first: Position, second: Position) -> bool:
        line = shapely.LineString([first.at_m, second.at_m])
        return bool(shapely.covers(self._site.spaces[first.space].within, line))

    def _visible(self, position: Position) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """Nodes seen from a position, and how far they are."""
        nodes = np.array(self._in_space[position.space], dtype=np.int64)
        if nodes.size == 0:
            return nodes, np.empty(0)
        places = np.array([self._nodes[node].at_m for node in nodes])
        ends = np.stack([np.broadcast_to(position.at_m, places.shape), places], axis=1)
        seen = shapely.covers(self._site.spaces[position.space].within, shapely.linestrings(ends))
        return nodes[seen], np.linalg.norm(places[seen] - position.at_m, axis=1)

    def _chain(self, start: Position, goal: Position, by: Way) -> list[int] | None:
        """The nodes on the shortest way."""
        distances, predecessors = self._solved[by]
        firsts, to_first = self._visible(start)
        lasts, from_last = self._visible(goal)
        if firsts.size == 0 or lasts.size == 0:
            return None
        total = to_first[:, None] + distances[np.ix_(firsts, lasts)] + from_last[None, :]
        best = np.unravel_index(np.argmin(total), total.shape)
        if not np.isfinite(total[best]):
            return None
        first, node = int(firsts[best[0]]), int(lasts[best[1]])
        chain = [node]
        while node != first:
            node = int(predecessors[first, node])
            chain.append(node)
        return chain[::-1]

    def _stretches(self, start: Position, chain: list[int], goal: Position) -> list[Stretch]:
        stretches: list[Stretch] = []
        points, spaces = [start.at_m], [start.space]
        for index, node in enumerate(chain):
            joint = self._joints.get((chain[index - 1], node)) if index else None
            here = self._nodes[node]
            if joint is None or isinstance(joint, Doorway):
                points.append(here.at_m)
                spaces.append(here.space)
                continue
            _close(stretches, points, spaces)
            stretches.append(_ride(joint, self._nodes[chain[index - 1]], here))
            points, spaces = [here.at_m], [here.space]
        points.append(goal.at_m)
        spaces.append(goal.space)
        _close(stretches, points, spaces)
        return stretches


def door_side(site: Site, door: Doorway, space: str) -> Xy:
    """Where one stands before a door, on the side of a space."""
    (x, y), (east, north) = door.middle_m, door.along
    sides = [
        (x - DOOR_STEP_M * north, y + DOOR_STEP_M * east),
        (x + DOOR_STEP_M * north, y - DOOR_STEP_M * east),
    ]
    polygon = site.spaces[space].polygon
    return min(sides, key=lambda side: polygon.distance(shapely.Point(side)))


def jutting_corners(free: Polygon) -> list[Xy]:
    """Corners of a polygon, holes included, that stand out into it: shortest ways bend only there."""
    corners: list[Xy] = []
    oriented = shapely.orient_polygons(free)
    for ring in [oriented.exterior, *oriented.interiors] if not free.is_empty else []:
        points = np.asarray(ring.coords)[:-1]
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        corners.extend((float(x), float(y)) for x, y in points[cross < -1e-9])
    return corners


def _close(stretches: list[Stretch], points: list[Xy], spaces: list[str]) -> None:
    """Add a stretch on the level, unless it has no length."""
    if max(math.dist(points[0], point) for point in points) > 1e-6:
        stretches.append(Stretch("level", tuple(points), tuple(spaces)))


def _ride(joint: Staircase | LiftShaft, here: Position, there: Position) -> Stretch:
    if isinstance(joint, LiftShaft):
        return Stretch("lift", (here.at_m, there.at_m), (here.space, there.space), joint)
    points = joint.points_m if here.space == joint.spaces[0] else joint.points_m[::-1]
    return Stretch("stairs", points, (here.space, there.space), joint)
