"""A team while its plan is made: where each member stands, which way it faces, and the orders it has got."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bootprint.geodesy import wrap_angle, yaw_of_azimuth
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.orders import Act, Mark, Meet, Note, Order, OrderBook, Stay
from proving_ground.scenario.paths import Position, Stretch
from proving_ground.scenario.routes import Passage, Router, course_rad, final_yaw, turn_leg, worth_going
from proving_ground.scenario.schema.people import Formation, Team
from proving_ground.scenario.schema.tasks import Posture, Task
from proving_ground.scenario.schema.units import Spot
from proving_ground.scenario.site import OUTSIDE, Xy
from proving_ground.scenario.site_builder import known

_GOLDEN_ANGLE_RAD = 2.4
_CAR_SPACING_M = 0.4
_FACED_RAD = 0.3  # who faces a thing nearly enough does not turn
_ABOUT_RAD = 1.3  # who has to go further off than this turns before setting off
_AHEAD = ("walk", "run", "sprint", "crawl")


@dataclass
class Walker:
    """A member: ``rank`` counts from 0 in the team."""

    id: str
    rank: int
    start: Position
    yaw_rad: float
    position: Position = field(init=False)
    trails: dict[str, list[Passage]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.position = self.start


@dataclass
class Group:
    """A team of one unit; ``copy`` counts the units that have the same team, from 1."""

    team: Team
    key: str
    unit: str
    copy: int
    router: Router
    book: OrderBook
    walkers: list[Walker]
    formation: Formation
    task_name: str = ""

    def named(self, name: str) -> str:
        """A name with ``{k}`` replaced by the copy's number."""
        return name.replace("{k}", str(self.copy))

    def label(self, name: str) -> str:
        """A task's name as all the scenario knows it."""
        return f"{self.unit}/{self.named(name)}"

    def chosen(self, task: Task, key: str) -> list[Walker]:
        """The members that do a task."""
        if not task.who:
            return self.walkers
        if max(task.who) > len(self.walkers):
            raise ScenarioFault(
                f"{key}.who", f"the team has {len(self.walkers)} members, not {max(task.who)}"
            )
        return [self.walkers[number - 1] for number in task.who]

    def position(self, spot: Spot, level: int, key: str) -> Position:
        """Where a spot is; numbers are on this level, shifted for copies."""
        site = self.router.site
        if not isinstance(spot, str):
            shift = self.team.shift_m
            at = (spot[0] + (self.copy - 1) * shift[0], spot[1] + (self.copy - 1) * shift[1])
            return self.router.position(at, level, key)
        name = self.named(spot)
        if name in site.places:
            return self.router.position(*site.places[name], key)
        known(name, {*site.spaces, *site.places} - {OUTSIDE}, key, "room or place")
        return Position(site.spaces[name].middle_m, name)

    # -- orders ---------------------------------------------------------------------------------------------------

    def give(self, walker: Walker, *orders: Order) -> None:
        """Orders for one member."""
        for order in orders:
            self.book.give(walker.id, order)

    def note(self, walkers: Sequence[Walker], text: str, key: str) -> None:
        """A line in the timeline of these members."""
        for walker in walkers:
            self.give(walker, Note(text, key))

    def meet(self, walkers: Sequence[Walker], posture: Posture = "stand") -> None:
        """They wait for each other."""
        if len(walkers) > 1:
            meeting = self.book.meeting([walker.id for walker in walkers])
            for walker in walkers:
                self.give(walker, Meet(meeting, posture))

    def mark(self, walkers: Sequence[Walker], label: str) -> None:
        """They have done it."""
        for walker in walkers:
            self.give(walker, Mark(label))

    def stay(self, walker: Walker, posture: Posture, for_s: float, until_s: float = 0.0) -> None:
        """A member keeps a posture."""
        self.give(walker, Stay(posture, for_s, until_s))

    def go(self, walker: Walker, passage: Passage) -> None:
        """A member goes a way."""
        if not worth_going(passage.way):
            return
        course = course_rad(passage.way)
        if (
            course is not None
            and passage.gait in _AHEAD
            and abs(wrap_angle(course - walker.yaw_rad)) > _ABOUT_RAD
        ):
            self.turn(walker, course)
        legs = self.router.legs(passage, walker.yaw_rad)
        self.give(walker, *(Act(leg) for leg in legs))
        last = passage.way[-1]
        walker.position = Position(last.points_m[-1], last.spaces[-1])
        walker.yaw_rad = final_yaw(legs, walker.yaw_rad)
        walker.trails.setdefault(self.task_name, []).append(passage)

    def turn(self, walker: Walker, yaw_rad: float, turn_s: float | None = None) -> None:
        """A member turns on the spot, the shorter way; as quickly as feet allow unless told how long it takes."""
        by = wrap_angle(yaw_rad - walker.yaw_rad)
        if abs(by) < _FACED_RAD:
            return
        walker.yaw_rad += by
        leg = turn_leg(self.router.ground(walker.position), by, walker.yaw_rad)
        self.give(walker, Act(leg if turn_s is None else replace(leg, duration_s=turn_s)))

    def face(self, walker: Walker, at_m: Xy) -> None:
        """A member turns towards a point."""
        east, north = at_m[0] - walker.position.at_m[0], at_m[1] - walker.position.at_m[1]
        self.turn(walker, math.atan2(north, east))

    def beside(self, position: Position, index: int) -> Position:
        """A free point near a position, another one for each index: so that nobody stands on anybody's feet."""
        radius, turn = 0.7 * math.sqrt(index), _GOLDEN_ANGLE_RAD * index
        (east, north), space = position.at_m, self.router.site.spaces[position.space]
        at = (east + radius * math.cos(turn), north + radius * math.sin(turn))
        return Position(space.settle(at), position.space)


def car_offset(walker: Walker) -> Xy:
    """Where in a lift's car a member stands: four corners."""
    return (
        (walker.rank % 2 - 0.5) * 2 * _CAR_SPACING_M,
        (walker.rank // 2 % 2 - 0.5) * 2 * _CAR_SPACING_M,
    )


def offsets(formation: Formation, count: int) -> list[Xy]:
    """Metres ahead and to the left of the first member, for each member."""
    if formation.offsets_m:
        stated = formation.offsets_m[:count]
        return [*stated, *[(-formation.spacing_m * (i + 1), 0.0) for i in range(count - len(stated))]]
    spacing = formation.spacing_m
    return [_offset(formation.kind, rank, spacing) for rank in range(count)]


def _offset(kind: str, rank: int, spacing_m: float) -> Xy:
    wing, side = (rank + 1) // 2, 1.0 if rank % 2 else -1.0
    match kind:
        case "column":  # two files
            return -spacing_m * (rank // 2), -spacing_m * (rank % 2)
        case "line":
            return 0.0, side * spacing_m * wing
        case "wedge":
            return -spacing_m * wing, side * spacing_m * wing
        case _:  # file
            return -spacing_m * rank, 0.0


def displaced(at_m: Xy, yaw_rad: float, offset_m: Xy) -> Xy:
    """A point that lies ``offset_m`` (ahead, left) of one who faces ``yaw_rad``."""
    ahead, left = offset_m
    return (
        at_m[0] + ahead * math.cos(yaw_rad) - left * math.sin(yaw_rad),
        at_m[1] + ahead * math.sin(yaw_rad) + left * math.cos(yaw_rad),
    )


def muster(
    team: Team, key: str, unit: str, copy: int, ids: Sequence[str], router: Router, book: OrderBook
) -> Group:
    """A team at its start, in formation."""
    group = Group(team, key, unit, copy, router, book, [], team.formation)
    first = group.position(team.at, 0, f"{key}.at")
    yaw = yaw_of_azimuth(math.radians(team.facing_deg))
    for rank, (soldier, offset) in enumerate(zip(ids, offsets(team.formation, len(ids)), strict=True)):
        at = displaced(first.at_m, yaw, offset)
        position = first if rank == 0 else _near(router, first, at)
        group.walkers.append(Walker(soldier, rank, position, yaw))
        book.orders[soldier] = []
    return group


def _near(router: Router, first: Position, at_m: Xy) -> Position:
    """The point, or the nearest one in the first member's space."""
    space = router.site.spaces[first.space]
    return Position(space.settle(at_m), space.name)


def arc(stretch: Stretch) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Arc length at each point of a stretch."""
    steps = np.hypot(*np.diff(np.array(stretch.points_m), axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])
