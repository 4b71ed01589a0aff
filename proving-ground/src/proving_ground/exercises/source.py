"""Where exercises come from: a scenario by name or path and a seed, or the squad of four that needs none.

What sensors measure is independent from soldier to soldier but for ranges and sights within a unit, so a pool may
build the units; the exercise is the same whoever builds it.
"""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from proving_ground.exercises.exercise import Exercise, FloatArray, Soldier
from proving_ground.exercises.squad import NAME, SQUAD_SIZE, simulated_squad

if TYPE_CHECKING:
    from proving_ground.scenario import Play, Scenario

OnProgress = Callable[[float], None]


def open_exercise(
    scenario: str, seed: int, *, workers: int = 1, on_progress: OnProgress = lambda _share: None
) -> Exercise:
    """The exercise of a seed, its runs in memory; ConfigError says what is wrong with the scenario."""
    if scenario == NAME:
        return simulated_squad(seed)
    loaded = _load(scenario)
    soldiers: list[Soldier] = []
    for unit in _built(scenario, seed, _units(loaded), workers):
        soldiers += unit
        on_progress(len(soldiers) / len(loaded.cast.soldiers))
    soldiers.sort(key=lambda soldier: soldier.number)
    return _exercise(loaded, seed, tuple(soldiers), _play(scenario, seed).duration_s)


def _exercise(scenario: "Scenario", seed: int, soldiers: tuple[Soldier, ...], duration_s: float) -> Exercise:
    """What the scenario's own `build` makes, of soldiers who are there already; with outlines for maps."""
    from proving_ground.scenario.build import exercise_of
    from proving_ground.scenario.geojson import write_plan

    site = write_plan(scenario.site, scenario.file.site, scenario.file.origin)
    return replace(exercise_of(scenario, seed, soldiers, duration_s), plan=_plan(scenario), site=site)


def check_scenario(scenario: str) -> None:
    """ConfigError if there is no such scenario or something is wrong with it; nothing is built."""
    if scenario != NAME:
        _load(scenario)


def soldier_count(scenario: str) -> int:
    """How many soldiers take part; nothing is built."""
    return SQUAD_SIZE if scenario == NAME else len(_load(scenario).cast.soldiers)


@lru_cache(maxsize=1)
def _load(scenario: str) -> "Scenario":
    from proving_ground.scenario import load_scenario

    return load_scenario(scenario)


def _units(scenario: "Scenario") -> list[str]:
    return list(dict.fromkeys(soldier.unit for soldier in scenario.cast.soldiers))


def _built(scenario: str, seed: int, units: Sequence[str], workers: int) -> Iterator[Sequence[Soldier]]:
    jobs = ([scenario] * len(units), [seed] * len(units), units)
    if workers <= 1 or len(units) == 1:
        yield from map(_build_unit, *jobs)
        return
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(min(workers, len(units)), context) as pool:
        yield from pool.map(_build_unit, *jobs)


def _build_unit(scenario: str, seed: int, unit: str) -> Sequence[Soldier]:
    """A unit's soldiers, everybody else moving around them."""
    from proving_ground.scenario.build import instrumented

    loaded = _load(scenario)
    members = tuple(soldier for soldier in loaded.cast.soldiers if soldier.unit == unit)
    only = replace(loaded, cast=replace(loaded.cast, soldiers=members))
    return tuple(instrumented(only, _play(scenario, seed), seed))


@lru_cache(maxsize=1)
def _play(scenario: str, seed: int) -> "Play":
    """Who does what when; kept, for one worker builds several units."""
    from proving_ground.scenario.loading import play

    return play(_load(scenario), seed)


def _plan(scenario: "Scenario") -> dict[int, Sequence[FloatArray]]:
    """Outlines of all rooms by level."""
    plan: dict[int, list[FloatArray]] = {}
    for room in scenario.site.rooms():
        outline = np.asarray(room.polygon.exterior.coords, dtype=np.float64)[:, :2]
        plan.setdefault(room.level, []).append(outline)
    return dict(plan)
