"""Walks of a library scenario's people, for as many soldiers as wanted.

More soldiers than a scenario has are further squads of it: people of further seeds, in other streets (turned and
set down some hundred metres away), each at a time of its own; of many squads every tenth has the same people again.
A short scenario is walked there and back, again and again with other people's paces: every run starts where the
last one, played backwards, has ended.
"""

from typing import Final

import numpy as np

from proving_ground.people import PersonMotion, move
from proving_ground.radio_load.telling import INDOORS, OUTDOORS, PERIOD_S, FloatArray, Telling
from proving_ground.scenario.loading import load_scenario, play
from proving_ground.scenario.scenario import Scenario

_SQUAD_RADIUS_M: Final = 150.0
_LONG_ENOUGH_S: Final = 900.0
_MOTION: Final = 1
_SEEDS_PER_SQUAD: Final = 100
_PEOPLE: Final = 10  # squads of different people: more would take long to walk


def scenario_walks(name: str, soldiers: int, seed: int, longest_s: float) -> tuple[FloatArray, Telling]:
    """Walks (n, T, 3) m ENU every `PERIOD_S`, and how fusion errs there."""
    scenario = load_scenario(name)
    played: dict[int, FloatArray] = {}
    squads: list[FloatArray] = []
    while sum(len(squad) for squad in squads) < soldiers:
        people = len(squads) % _PEOPLE
        if people not in played:
            played[people] = _played(scenario, seed, people, min(longest_s, _LONG_ENOUGH_S))
        squads.append(_squad(played[people], seed, len(squads), soldiers, longest_s))
    length = min(squad.shape[1] for squad in squads)
    walks = np.concatenate([squad[:, :length] for squad in squads])[:soldiers]
    indoors = any(space.building for space in scenario.site.spaces.values())
    return walks, INDOORS if indoors else OUTDOORS


def _squad(walks: FloatArray, seed: int, copy: int, soldiers: int, longest_s: float) -> FloatArray:
    """One squad (k, T, 3) of all ``soldiers``: these people's walks in its own direction, place and time."""
    rng = np.random.default_rng([seed, copy])
    surplus = walks.shape[1] - round(longest_s / PERIOD_S)
    first = int(rng.integers(0, surplus)) if surplus > 0 else 0
    walks = walks[:, first : first + round(longest_s / PERIOD_S)]
    squads = -(-soldiers // len(walks))
    radius_m = 0.0 if squads == 1 else _SQUAD_RADIUS_M * np.sqrt(squads * rng.random())
    bearing = rng.uniform(0.0, 2.0 * np.pi)
    middle = radius_m * np.array([np.cos(bearing), np.sin(bearing)])
    return turned(walks, walks[:, 0].mean(axis=0), rng.uniform(0.0, 2.0 * np.pi), middle)


def turned(walks: FloatArray, about_m: FloatArray, angle_rad: float, to_m: FloatArray) -> FloatArray:
    """Walks (..., 3) turned about a point (3,) which then lies at ``to_m`` (2,); heights stay."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    rotation = np.array([[cosine, -sine], [sine, cosine]])
    flat = (walks[..., :2] - about_m[:2]) @ rotation.T + to_m
    return np.concatenate([flat, walks[..., 2:]], axis=-1)


def _played(scenario: Scenario, seed: int, copy: int, enough_s: float) -> FloatArray:
    """Runs of the scenario, each second one backwards, until it is enough."""
    parts: list[FloatArray] = []
    while sum(part.shape[1] for part in parts) * PERIOD_S < enough_s:
        run_seed = (seed * _SEEDS_PER_SQUAD + copy) * _SEEDS_PER_SQUAD + len(parts) // 2 + 1
        run = _run(scenario, run_seed) if len(parts) % 2 == 0 else parts[-1][:, ::-1]
        parts.append(run)
    return np.concatenate(parts, axis=1)


def _run(scenario: Scenario, seed: int) -> FloatArray:
    """Everybody's way in one run of the scenario, (k, T, 3)."""
    played = play(scenario, seed)
    motions: list[PersonMotion] = []
    for soldier in scenario.cast.soldiers:
        stream = np.random.SeedSequence([seed, soldier.number, _MOTION])
        itinerary = played.timetables[soldier.id].itinerary
        motions.append(move(played.persons[soldier.id], itinerary, int(stream.generate_state(1)[0])))
    walks = [motion.truth(PERIOD_S).position_m for motion in motions]
    length = min(len(walk) for walk in walks)
    return np.stack([walk[:length] for walk in walks])
