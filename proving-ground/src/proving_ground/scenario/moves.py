"""Plans of simple tasks: going somewhere in formation, staying, turning, waiting."""

import math

from bootprint.geodesy import yaw_of_azimuth
from proving_ground.people import GaitName
from proving_ground.scenario.group import Group, Walker, car_offset, displaced, offsets
from proving_ground.scenario.orders import Await
from proving_ground.scenario.paths import Position, Stretch, Way
from proving_ground.scenario.routes import Passage, in_car, length_m, trimmed
from proving_ground.scenario.schema.people import Formation
from proving_ground.scenario.schema.tasks import Form, Gather, Hold, Move, TakeLift, TakeStairs, Turn, Wait
from proving_ground.scenario.site import OUTSIDE, LiftShaft, Staircase
from proving_ground.scenario.site_builder import known

OWN_START = "own start"
# A team's common pace in m/s; a soldier alone goes at the person's own.
PACE_M_S = {
    "walk": 1.35,
    "run": 2.8,
    "sprint": 4.5,
    "crawl": 0.45,
    "side_step_left": 0.7,
    "side_step_right": 0.7,
    "backward": 0.8,
}


def plan_move(group: Group, task: Move, walkers: list[Walker], key: str) -> None:
    """Go somewhere: in file, or abreast where everything is in the open."""
    goals = _goals(group, task, walkers[0], key)
    gait: GaitName = task.gait  # type: ignore[assignment]  # a class's constant, one of them
    speed = task.speed_m_s or (PACE_M_S[gait] if len(walkers) > 1 else None)
    group.meet(walkers)
    if task.to == OWN_START:
        _return(group, walkers, goals, Passage((), gait, speed), task.by, key)
        return
    everywhere = [*(walker.position for walker in walkers), *goals]
    if group.formation.kind != "file" and all(place.space == OUTSIDE for place in everywhere):
        _go_abreast(group, walkers, goals, Passage((), gait, speed), key)
    else:
        _go_in_file(group, walkers, goals, Passage((), gait, speed), task.by, key)


def _goals(group: Group, task: Move, leader: Walker, key: str) -> list[Position]:
    """Where a move leads, point by point; without the end if that is everybody's own."""
    goals: list[Position] = []
    level = group.router.level(leader.position)
    for spot, part in [*((s, f"via[{i}]") for i, s in enumerate(task.via)), (task.to, "to")]:
        if spot != OWN_START:
            goals.append(group.position(spot, level, f"{key}.{part}"))
            level = group.router.level(goals[-1])
    return goals


def _return(
    group: Group, walkers: list[Walker], goals: list[Position], how: Passage, by: Way, key: str
) -> None:
    """Everyone goes back to where they began, one after the other."""
    for index, walker in enumerate(walkers):
        way = group.router.way(walker.position, [*goals, walker.start], by, key)
        if how.speed_m_s is not None:
            group.stay(walker, "stand", index * group.formation.spacing_m / how.speed_m_s)
        group.go(walker, Passage(tuple(way), how.gait, how.speed_m_s))


def _go_in_file(
    group: Group, walkers: list[Walker], goals: list[Position], how: Passage, by: Way, key: str
) -> None:
    """All go the same way, each ``spacing_m`` behind the one before; where that is not so yet, some wait."""
    ways = [group.router.way(walker.position, goals, by, key) for walker in walkers]
    _send(group, walkers, ways, how, key)


def _send(group: Group, walkers: list[Walker], ways: list[list[Stretch]], how: Passage, key: str) -> None:
    """Everyone on a way of one's own, spaced as in a file; into lifts together."""
    start_gaps_m = _gaps(ways, group.formation.spacing_m)
    parts = []
    for index, (walker, way, gap_m) in enumerate(zip(walkers, ways, start_gaps_m, strict=True)):
        if how.speed_m_s is not None and gap_m > 0.0:
            group.stay(walker, "stand", gap_m / how.speed_m_s)
        if index:
            way = trimmed(way, index * group.formation.spacing_m, group.router.site)
            if way and way[-1].kind != "level":
                way = _make_room(group, way, index, key)
        parts.append(_up_to_lift(in_car(way, car_offset(walker)) if len(walkers) > 1 else way))
    for walker, (first, _) in zip(walkers, parts, strict=True):
        group.go(walker, Passage(tuple(first), how.gait, how.speed_m_s))
    if any(rest for _, rest in parts):
        group.meet(walkers)
        for walker, (_, rest) in zip(walkers, parts, strict=True):
            group.go(walker, Passage(tuple(rest), how.gait, how.speed_m_s))


def _gaps(ways: list[list[Stretch]], spacing_m: float) -> list[float]:
    """How far each is too near to the goal to be in file behind the first."""
    lengths = [length_m(way) for way in ways]
    return [lengths[0] + index * spacing_m - length for index, length in enumerate(lengths)]


def _up_to_lift(way: list[Stretch]) -> tuple[list[Stretch], list[Stretch]]:
    lift = next((index for index, stretch in enumerate(way) if stretch.kind == "lift"), len(way))
    return way[:lift], way[lift:]


def _make_room(group: Group, way: list[Stretch], index: int, key: str) -> list[Stretch]:
    """A way that ends with stairs or a lift, gone on to a free point beside their end."""
    end = Position(way[-1].points_m[-1], way[-1].spaces[-1])
    return [*way, *group.router.way(end, [group.beside(end, index)], "stairs", key)]


def _go_abreast(group: Group, walkers: list[Walker], goals: list[Position], how: Passage, key: str) -> None:
    """Everyone keeps a place in the formation, which turns with the first member's way."""
    places = offsets(group.formation, len(walkers))
    ground = group.router.site.spaces[OUTSIDE]
    anchor = walkers[0].position.at_m
    headings = []
    for goal in goals:
        headings.append(math.atan2(goal.at_m[1] - anchor[1], goal.at_m[0] - anchor[0]))
        anchor = goal.at_m
    for walker, place in zip(walkers, places, strict=True):
        own = [
            Position(ground.settle(displaced(goal.at_m, heading, place)), OUTSIDE)
            for goal, heading in zip(goals, headings, strict=True)
        ]
        way = group.router.way(walker.position, own, "stairs", key)
        group.go(walker, Passage(tuple(way), how.gait, how.speed_m_s))


def plan_hold(group: Group, task: Hold, walkers: list[Walker], key: str) -> None:
    """Stay where one is."""
    for walker in walkers:
        group.stay(walker, task.posture, task.for_s, task.until_s)


def plan_turn(group: Group, task: Turn, walkers: list[Walker], key: str) -> None:
    """Turn on the spot."""
    for walker in walkers:
        if task.to_deg is not None:
            yaw = yaw_of_azimuth(math.radians(task.to_deg))
        else:
            assert task.by_deg is not None
            yaw = walker.yaw_rad - math.radians(task.by_deg)
        group.turn(walker, yaw, task.turn_s)


def plan_gather(group: Group, task: Gather, walkers: list[Walker], key: str) -> None:
    """Wait for each other."""
    group.meet(walkers, task.posture)


def plan_wait(group: Group, task: Wait, walkers: list[Walker], key: str) -> None:
    """Wait for a task's end; the label is made complete when all teams are known."""
    for walker in walkers:
        group.give(walker, Await(group.named(task.until), task.after_s, task.posture))


def plan_form(group: Group, task: Form, walkers: list[Walker], key: str) -> None:
    """Another formation from here on."""
    group.formation = Formation(kind=task.kind, spacing_m=task.spacing_m)


def plan_stairs(group: Group, task: TakeStairs, walkers: list[Walker], key: str) -> None:
    """To the near end of a staircase, and to its other end."""
    by_name = {stairs.name: stairs for stairs in group.router.site.stairs}
    stairs = by_name[known(group.named(task.by), by_name, f"{key}.by", "staircase")]
    ends = [Position(stairs.points_m[0], stairs.spaces[0]), Position(stairs.points_m[-1], stairs.spaces[1])]
    level = group.router.level(walkers[0].position)
    if level == group.router.level(ends[1]):
        ends.reverse()
    points = stairs.points_m if ends[0].space == stairs.spaces[0] else stairs.points_m[::-1]
    climb = Stretch("stairs", points, (ends[0].space, ends[1].space), stairs)
    _ride(group, walkers, ends[0], climb, key)


def plan_lift(group: Group, task: TakeLift, walkers: list[Walker], key: str) -> None:
    """Into a lift, and to another floor with it."""
    by_name = {lift.name: lift for lift in group.router.site.lifts}
    lift = by_name[known(group.named(task.by), by_name, f"{key}.by", "lift")]
    stops = {str(group.router.site.spaces[space].level): space for space in lift.spaces}
    here = str(group.router.level(walkers[0].position))
    for level, part in ((here, "by"), (str(task.to_floor), "to_floor")):
        known(level, stops, f"{key}.{part}", f"stop of {lift.name!r} on floor")
    spaces = (stops[here], stops[str(task.to_floor)])
    ride = Stretch("lift", (lift.at_m, lift.at_m), spaces, lift)
    _ride(group, walkers, Position(lift.at_m, spaces[0]), ride, key)


def _ride(group: Group, walkers: list[Walker], near: Position, ride: Stretch, key: str) -> None:
    """To the near end in file, all together, and then the ride."""
    joint = ride.joint
    assert isinstance(joint, Staircase | LiftShaft)
    group.meet(walkers)
    ways = [[*group.router.way(walker.position, [near], "stairs", key), ride] for walker in walkers]
    speed = PACE_M_S["walk"] if len(walkers) > 1 else None
    _send(group, walkers, ways, Passage((), "walk", speed), key)
