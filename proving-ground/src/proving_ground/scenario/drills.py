"""Plans of drills: stacking up at a door, clearing a room, bounding in pairs, following somebody."""

import math

import numpy as np
import shapely

from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.group import Group, Walker, arc, displaced
from proving_ground.scenario.moves import PACE_M_S
from proving_ground.scenario.orders import Await
from proving_ground.scenario.paths import Position, Stretch, door_side
from proving_ground.scenario.routes import Passage, joined, length_m, trimmed
from proving_ground.scenario.schema.tasks import Bound, Clear, Follow, StackUp
from proving_ground.scenario.site import OUTSIDE, Doorway, Site, Space, Xy
from proving_ground.scenario.site_builder import known

_WALL_M = 0.4  # from the wall to the middle of one who stands along it
_JAMB_M = 0.5  # from the door's edge to the first in the stack
_CORNER_M = 0.6  # from the walls to one who covers a corner
_ENTER_AT_MOST = 4


def plan_stack_up(group: Group, task: StackUp, walkers: list[Walker], key: str) -> None:
    """Everyone to a place along the wall, facing the door; all there, hold."""
    site = group.router.site
    doors = {door.name: door for door in site.doors}
    door = doors[known(group.named(task.door), doors, f"{key}.door", "door")]
    before = _near_side(group, walkers[0], door, key)
    slots = _stack(site, door, before, len(walkers), task.spacing_m)
    group.meet(walkers)
    for walker, slot in zip(walkers, slots, strict=True):
        way = group.router.way(walker.position, [slot], "stairs", key)
        group.go(walker, Passage(tuple(way), task.gait, PACE_M_S[task.gait]))
        group.face(walker, door.middle_m)
    group.meet(walkers)
    for walker in walkers:
        group.stay(walker, "stand", task.hold_s)


def _near_side(group: Group, walker: Walker, door: Doorway, key: str) -> str:
    """The side of a door that one comes to first."""
    if walker.position.space in door.spaces:
        return walker.position.space
    sides = [Position(door_side(group.router.site, door, space), space) for space in door.spaces]
    ways = [group.router.way(walker.position, [side], "stairs", key) for side in sides]
    return min(zip(map(length_m, ways), door.spaces, strict=True))[1]


def _stack(site: Site, door: Doorway, space: str, count: int, spacing_m: float) -> list[Position]:
    """Places along the wall on one side of the door, in further rows if the wall is short."""
    front = door_side(site, door, space)
    inward = _unit((front[0] - door.middle_m[0], front[1] - door.middle_m[1]))
    sides = [_row(site, door, space, inward, side, spacing_m) for side in (1.0, -1.0)]
    slots = max(sides, key=len)[:count]
    if len(slots) < count:  # too little room: the rest stand behind each other at the last place
        slots += [slots[-1] if slots else front] * (count - len(slots))
    return [Position(slot, space) for slot in slots]


def _row(site: Site, door: Doorway, space: str, inward: Xy, side: float, spacing_m: float) -> list[Xy]:
    """Free places on one side of a door that see its front, the nearest first."""
    front = door_side(site, door, space)
    places = []
    for row in range(3):
        for index in range(8):
            along = side * (door.width_m / 2.0 + _JAMB_M + index * spacing_m)
            off = _WALL_M + row * spacing_m
            place = (
                door.middle_m[0] + along * door.along[0] + off * inward[0],
                door.middle_m[1] + along * door.along[1] + off * inward[1],
            )
            if shapely.covers(site.spaces[space].within, shapely.LineString([front, place])):
                places.append(place)
    return places


def plan_clear(group: Group, task: Clear, walkers: list[Walker], key: str) -> None:
    """The first four enter in turn and go along the walls to the corners, alternating; the others cover outside."""
    site = group.router.site
    rooms = {space.name for space in site.rooms()}
    room = site.spaces[known(group.named(task.room), rooms, f"{key}.room", "room")]
    door = _entrance(group, walkers[0], room, key)
    inside = door_side(site, door, room.name)
    posts = _corner_routes(room, inside, door)
    group.meet(walkers)
    for index, walker in enumerate(walkers[:_ENTER_AT_MOST]):
        group.stay(walker, "stand", index * task.interval_s)
        goals = [Position(at, room.name) for at in (inside, *posts[index])]
        way = group.router.way(walker.position, goals, "stairs", key)
        group.go(walker, Passage(tuple(way), "walk", task.speed_m_s))
        group.face(walker, room.middle_m)
        group.stay(walker, "stand", task.hold_s)
    group.meet(walkers)


def _entrance(group: Group, walker: Walker, room: Space, key: str) -> Doorway:
    """The door by which one gets into a room soonest."""
    doors = [door for door in group.router.site.doors if room.name in door.spaces]
    if walker.position.space == room.name or not doors:
        raise ScenarioFault(
            f"{key}.room",
            f"{room.name!r} has no door" if not doors else f"{walker.id} is in {room.name!r} already",
        )

    def distance(door: Doorway) -> float:
        side = Position(door_side(group.router.site, door, room.name), room.name)
        return length_m(group.router.way(walker.position, [side], "stairs", key))

    return min(doors, key=distance)


def _corner_routes(room: Space, inside: Xy, door: Doorway) -> list[list[Xy]]:
    """Where each of four goes behind the door: left wall to its end, right wall, near left, near right corner."""
    inner = room.polygon.buffer(-_CORNER_M, join_style="mitre")
    inner = room.free if inner.is_empty or inner.geom_type != "Polygon" else inner
    inward = _unit((inside[0] - door.middle_m[0], inside[1] - door.middle_m[1]))
    corners = np.asarray(inner.exterior.coords)[:-1]
    depth = (corners - inside) @ np.array(inward)
    left = (corners - inside) @ np.array([-inward[1], inward[0]])
    sides = []
    for choice in (left >= 0.0, left < 0.0):
        nearest = np.argsort(depth[choice], kind="stable")
        sides.append([(float(x), float(y)) for x, y in corners[choice][nearest]] or [room.middle_m])
    near_and_far = [[side[0], side[-1]] if len(side) > 1 else side for side in sides]
    return [near_and_far[0], near_and_far[1], [sides[0][0]], [sides[1][0]]]


def plan_bound(group: Group, task: Bound, walkers: list[Walker], key: str) -> None:
    """Buddy rushes: odd members half a bound ahead, then each pair's halves pass each other in turn."""
    level = group.router.level(walkers[0].position)
    goal = group.position(task.to, level, f"{key}.to")
    lanes = [_lane(group, walkers, index, goal, key) for index in range(len(walkers))]
    reached = [0.0] * len(lanes)
    turn = 0
    while any(reached[i] < length_m([lane]) - 1e-6 for i, lane in enumerate(lanes)):
        group.meet(walkers, task.posture)
        for index, (walker, lane) in enumerate(zip(walkers, lanes, strict=True)):
            if index % 2 == turn % 2:
                ahead = reached[index] + task.length_m * (1.0 if turn == 0 else 2.0)
                part = _part(lane, reached[index], ahead)
                reached[index] = min(ahead, length_m([lane]))
                group.go(walker, Passage((part,), task.gait, PACE_M_S[task.gait]))
        turn += 1
    group.meet(walkers, task.posture)


def _lane(group: Group, walkers: list[Walker], index: int, goal: Position, key: str) -> Stretch:
    """A member's own way to its place in the line at the goal."""
    walker, first = walkers[index], walkers[0].position.at_m
    heading = math.atan2(goal.at_m[1] - first[1], goal.at_m[0] - first[0])
    side = (index + 1) // 2 * group.formation.spacing_m * (1.0 if index % 2 else -1.0)
    if goal.space != OUTSIDE or walker.position.space != OUTSIDE:
        raise ScenarioFault(key, "bounds are for open ground, not for rooms")
    at = group.router.site.spaces[OUTSIDE].settle(displaced(goal.at_m, heading, (0.0, side)))
    way = group.router.way(walker.position, [Position(at, OUTSIDE)], "stairs", key)
    if len(way) != 1:
        raise ScenarioFault(
            key, "there is no ground to bound over: the way has no length, or leads by stairs"
        )
    return way[0]


def _part(lane: Stretch, from_m: float, to_m: float) -> Stretch:
    """A piece of a stretch in the open, by arc length."""
    along, points = arc(lane), np.array(lane.points_m)
    stops = [from_m, *along[(along > from_m + 1e-6) & (along < to_m - 1e-6)], min(to_m, along[-1])]
    places = [
        (float(np.interp(s, along, points[:, 0])), float(np.interp(s, along, points[:, 1]))) for s in stops
    ]
    return Stretch("level", tuple(places), (OUTSIDE,) * len(places))


def plan_follow(
    group: Group, task: Follow, walkers: list[Walker], key: str, others: dict[str, tuple[Group, Walker]]
) -> None:
    """Set off when the one to follow has, ``spacing_m`` behind, and go the same way with the same gaits."""
    soldier = group.named(task.soldier)
    known(soldier, others, f"{key}.soldier", "soldier further up in the file")
    ahead, leader = others[soldier]
    name = ahead.named(task.task)
    trail = leader.trails.get(name)
    if trail is None:
        known(name, [n for n in leader.trails if n], f"{key}.task", f"named move of {soldier}")
        raise ScenarioFault(f"{key}.task", f"{soldier} has no move named {name!r}")
    pace = trail[0].speed_m_s or PACE_M_S.get(trail[0].gait, 1.0)
    for index, walker in enumerate(walkers, start=1):
        back = index * task.spacing_m
        group.give(walker, Await(begun(ahead.label(name), soldier), back / pace))
        for number, passage in enumerate(trail, start=1):
            start = Position(passage.way[0].points_m[0], passage.way[0].spaces[0])
            way = joined([*group.router.way(walker.position, [start], "stairs", key), *passage.way])
            if number == len(trail):
                way = trimmed(way, back, group.router.site)
            group.go(walker, Passage(tuple(way), passage.gait, passage.speed_m_s))


def begun(label: str, soldier: str) -> str:
    """The mark that a soldier makes when a named task begins."""
    return f"{label} begun by {soldier}"


def _unit(vector: Xy) -> Xy:
    length = math.hypot(*vector)
    return vector[0] / length, vector[1] / length
