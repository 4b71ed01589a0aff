"""FOI's straight line (METHODS D4, D7): 49 m, eleven walks of three people, the feet drifting oppositely.

Each walk starts at a known point, walked off in a known direction, as FOI's did along a tape. The drifts are drawn
for every walk such that a foot alone ends up to 2.5 m off, as theirs did.

python -m proving_ground.evaluation.fusion.straight_line
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bootprint.config import convert
from bootprint.topics import Identity
from fusion.config import FusionConfig
from pdr_engine.config import PdrConfig
from proving_ground.evaluation.fusion.dual_walks import ORIGIN, DualWalk, dual_walk
from proving_ground.inprocess import play_run, positions_of
from proving_ground.people import Person
from sensor_gateway.recordings.run import FEET

LENGTH_M = 49.0
SEEDS = range(201, 223, 2)  # eleven odd ones: what was chosen was chosen on even ones
PEOPLE = 3
_DRIFT_RAD_S = (0.0008, 0.0030)  # of a foot alone: 0.7 to 2.5 m after 49 m in 35 s
_IDENTITY = Identity("trial", "alpha", "a1")


@dataclass(frozen=True, slots=True)
class LineWalk:
    """One walk: how far from the true end the positions ended, m, with both feet and with each alone."""

    person: int
    drift_deg_per_min: float
    both_m: float
    left_m: float
    right_m: float


def walk_line(seed: int, person: int) -> LineWalk:
    """The walk of a seed by one of the people."""
    rng = np.random.default_rng([seed, 49])
    drift = float(rng.uniform(*_DRIFT_RAD_S)) * float(rng.choice([-1.0, 1.0]))
    who = Person.drawn(np.random.default_rng([person, 11]))
    walk = dual_walk([(0.0, 0.0), (0.0, LENGTH_M)], seed, person=who, opposite_drift_rad_s=drift)
    both, left, right = (_end_error_m(walk, feet) for feet in (FEET, FEET[:1], FEET[1:]))
    return LineWalk(person, float(np.degrees(drift)) * 60.0, both, left, right)


def _end_error_m(walk: DualWalk, feet: Sequence[str]) -> float:
    run = replace(walk.run, imus={place: walk.run.imus[place] for place in feet})
    start = {
        "east_m": 0.0,
        "north_m": 0.0,
        "sigma_m": 0.05,
        "azimuth_deg": walk.azimuth_deg,
        "azimuth_sigma_deg": 0.5,
    }
    fusion = convert({"feet": list(feet), "gnss_sources": [], "start": start}, FusionConfig, where="trial")
    pdr = convert({"places": list(feet)}, PdrConfig, where="trial")
    last = list(positions_of(play_run(run, _IDENTITY, ORIGIN, pdr, fusion, start_ns=0)))[-1]
    true = run.truth["body"].position_m[-1]
    return float(np.hypot(last.east_m - true[0], last.north_m - true[1]))


def straight_line(seeds: Sequence[int] = SEEDS) -> list[LineWalk]:
    """All walks, the people taking turns."""
    return [walk_line(seed, index % PEOPLE) for index, seed in enumerate(seeds)]


def straight_line_table(walks: Sequence[LineWalk]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [
        "| walk | person | opposite drift, °/min | both feet, m | left alone, m | right alone, m |",
        "|---|---|---|---|---|---|",
    ]
    for index, walk in enumerate(walks, start=1):
        ends = f"{walk.both_m:.2f} | {walk.left_m:.2f} | {walk.right_m:.2f}"
        lines.append(f"| {index} | {walk.person + 1} | {walk.drift_deg_per_min:+.1f} | {ends} |")
    figures = np.array([(walk.both_m, walk.left_m, walk.right_m) for walk in walks])
    for name, of in (("median", np.median), ("worst", np.max)):
        lines.append(f"| {name} | | | " + " | ".join(f"{value:.2f}" for value in of(figures, axis=0)) + " |")
    return lines


if __name__ == "__main__":
    sys.stdout.write("\n".join(straight_line_table(straight_line())) + "\n")
