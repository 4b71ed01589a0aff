"""A scenario that has been read and understood: its site, its cast and everybody's orders, ready for any seed."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from proving_ground.people import Person
from proving_ground.scenario.cast import Cast, build_cast
from proving_ground.scenario.checks import check_names
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.group import Group, muster
from proving_ground.scenario.orders import OrderBook
from proving_ground.scenario.planner import plan_all
from proving_ground.scenario.routes import Router
from proving_ground.scenario.schedule import Timetable, lasting, schedule
from proving_ground.scenario.schema.scenario import ScenarioFile
from proving_ground.scenario.site import Site
from proving_ground.scenario.site_builder import build_site

FloatArray = npt.NDArray[np.float64]
_END_S = 3.0  # everybody stands at the end, for the last steps to be reported
_LONGEST_S = 12 * 3600.0
_FIRST_SEED = 1


@dataclass(frozen=True)
class Play:
    """A scenario with persons: everybody's timetable, all as long as the exercise."""

    persons: dict[str, Person]
    timetables: dict[str, Timetable]
    duration_s: float


@dataclass(frozen=True)
class Scenario:
    """What a scenario file says. ``starts``: everybody's place (1, 3) m and yaw in rad at the beginning."""

    name: str
    path: Path
    file: ScenarioFile
    site: Site
    cast: Cast
    book: OrderBook
    starts: dict[str, tuple[FloatArray, float]]

    def persons(self, seed: int) -> dict[str, Person]:
        """The soldiers' bodies and habits, drawn from the seed, each from a stream of its own."""
        return {
            soldier.id: Person.drawn(np.random.default_rng([seed, soldier.number, 0]))
            for soldier in self.cast.soldiers
        }

    def play(self, seed: int) -> Play:
        """Who does what when, with the persons that the seed draws."""
        persons = self.persons(seed)
        timetables = schedule(self.book, persons, self.starts, self.file.settle_s)
        needed_s = max(timetable.end_s for timetable in timetables.values()) + _END_S
        duration_s = self.file.duration_s or needed_s
        if max(duration_s, needed_s) > _LONGEST_S:
            raise ScenarioFault(
                "", f"the exercise would take {max(duration_s, needed_s):.0f} s: {_LONGEST_S:.0f} s at most"
            )
        if duration_s < needed_s - _END_S:
            raise ScenarioFault(
                "duration_s",
                f"{duration_s:g} s is too short: with seed {seed} the tasks take {needed_s:.0f} s",
            )
        return Play(
            persons, {soldier: lasting(t, duration_s) for soldier, t in timetables.items()}, duration_s
        )

    @cached_property
    def first_play(self) -> Play:
        """With the first seed: for lists and plans."""
        return self.play(_FIRST_SEED)


def understand(name: str, path: Path, file: ScenarioFile) -> Scenario:
    """Site, cast and orders of a file; ScenarioFault on the first thing that does not fit."""
    site, cast = build_site(file.site), build_cast(file)
    check_names(file, site, cast)
    router, book = Router(site), OrderBook()
    groups = list(_groups(file, cast, router, book))
    starts = {
        walker.id: (router.ground(walker.position), walker.yaw_rad)
        for group in groups
        for walker in group.walkers
    }
    plan_all(groups, book)
    scenario = Scenario(name, path, file, site, cast, book, starts)
    _ = scenario.first_play  # finds those who wait for each other in a circle
    return scenario


def _groups(file: ScenarioFile, cast: Cast, router: Router, book: OrderBook) -> list[Group]:
    groups = []
    for index, team in enumerate(file.teams):
        for copy, unit in enumerate(team.units, start=1):
            ids = [s.id for s in cast.soldiers if s.team == index and s.copy == copy]
            groups.append(muster(team, f"teams[{index}]", unit, copy, ids, router, book))
    return groups
