"""A soldier nobody senses for seconds, indoors: ``python -m proving_ground.evaluation.fusion.dark_times``.

The power of a soldier's computer is cut for three to six seconds, or the gateway is killed: what the body did
meanwhile nobody measured. Every soldier of building-clearing, four times a seed, each alone; of the positions that
are published from then on: errors, and whether the truth is inside the ellipses.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from proving_ground.evaluation.fusion.by_seeds import print_table
from proving_ground.evaluation.fusion.library_honesty import Honesty, honesty
from proving_ground.evaluation.fusion.lines import Heard
from proving_ground.exercises.event_time.inprocess_play import line_job
from proving_ground.exercises.event_time.line import play_line
from proving_ground.exercises.exercise import Exercise, Fault, Soldier
from proving_ground.exercises.source import open_exercise

SCENARIO: Final = "building-clearing"
SEEDS: Final = (1, 3, 5)
_ABOUT_S: Final = (60.0, 90.0, 120.0, 150.0)
_WITHIN_S: Final = 25.0
_LASTS_S: Final = (3.0, 6.0)
_POOR_PCT: Final = 80.0


def _power_cut(soldier: str, at_s: float, for_s: float) -> Fault:
    return Fault(at_s, "power_cut", soldier, {"for_s": for_s})


def _gateway_killed(soldier: str, at_s: float, _for_s: float) -> Fault:
    return Fault(at_s, "process_killed", soldier, {"process": "sensor-gateway"})


FAULTS: Final = {"power cut": _power_cut, "gateway killed": _gateway_killed}


def measure(seeds: Sequence[int] = SEEDS) -> dict[str, list[Honesty]]:
    """What was published after each fault, by its kind."""
    found: dict[str, list[Honesty]] = {name: [] for name in FAULTS}
    for seed in seeds:
        exercise = open_exercise(SCENARIO, seed)
        for soldier, at_s, for_s in _drawn(exercise, seed):
            for name, make in FAULTS.items():
                fault = make(soldier.id, at_s, for_s)
                found[name].append(_after(replace(exercise, faults=(fault,)), soldier, at_s))
    return found


def _drawn(exercise: Exercise, seed: int) -> Iterator[tuple[Soldier, float, float]]:
    """Who is in the dark from when on, for how long, s."""
    rng = np.random.default_rng(seed)
    for soldier in exercise.soldiers:
        for about_s in _ABOUT_S:
            yield soldier, about_s + rng.uniform(0.0, _WITHIN_S), rng.uniform(*_LASTS_S)


def _after(exercise: Exercise, soldier: Soldier, at_s: float) -> Honesty:
    begins_ns = exercise.begins_ns
    job = line_job(exercise, soldier, begins_ns, begins_ns + round(exercise.duration_s * NS_PER_S), False)
    heard = Heard(exercise, soldier, job.identity, job.origin, job.fusion, ())
    published = [position for _, position in play_line(job).positions]
    return honesty(heard, [one for one in published if one.time_ns > begins_ns + at_s * NS_PER_S])


def table(found: Mapping[str, Sequence[Honesty]]) -> list[str]:
    """Lines of a Markdown table; p95 and the share inside are of one case each."""
    lines = [
        "| fault | cases | p95 m: median | worst | end m: median | inside 95 %: mean | cases under 80 % |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for name, cases in found.items():
        p95_m = [float(np.percentile(one.error_m, 95)) for one in cases]
        end_m = [float(one.error_m[-1]) for one in cases]
        inside = np.array([100.0 * one.inside.mean() for one in cases])
        lines.append(
            f"| {name} | {len(cases)} | {np.median(p95_m):.1f} | {max(p95_m):.1f} | {np.median(end_m):.1f}"
            f" | {inside.mean():.1f} | {np.count_nonzero(inside < _POOR_PCT)} |"
        )
    return lines


if __name__ == "__main__":
    print_table("what seconds in the dark cost", SEEDS, lambda seeds: table(measure(seeds)))
