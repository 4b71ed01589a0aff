"""Does fusion keep its word over the library? What `bootprint exercise honesty` tells.

Some soldiers of every scenario, spread over its teams, by several seeds: the share of true places inside the 95 %
ellipse of the position that was published for the moment, and the mean of the normalised squared error (2 when
honest). Long scenarios are played for their first part.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bootprint.clock import NS_PER_S
from bootprint.messages import Position
from proving_ground.evaluation.alignment import FloatArray, interpolated
from proving_ground.evaluation.fusion.lines import Heard, fused, heard_in
from proving_ground.scenario.build import exercise_of, instrumented
from proving_ground.scenario.cast import Soldier
from proving_ground.scenario.loading import load_scenario, play

Row = dict[str, Any]
LONGEST_S = 900.0
SOLDIERS = 2
SEEDS = (1, 3, 5)
_CHI2_95_TWO = 5.991464547107979
_CHI2_95_ONE = 3.841458820694124


@dataclass(frozen=True)
class Honesty:
    """One soldier's published positions beside the truth, each (n,): error m, and its normalised square.

    ``height_squared``: the height's own; NaN where the truth has none.
    """

    scenario: str
    seed: int
    soldier: str
    error_m: FloatArray
    squared: FloatArray
    height_squared: FloatArray

    @property
    def inside(self) -> FloatArray:
        """Whether each place was inside, as numbers."""
        return np.asarray(self.squared <= _CHI2_95_TWO, dtype=np.float64)


def cases(
    scenario: str, seed: int, soldiers: int = SOLDIERS, longest_s: float = LONGEST_S
) -> Iterator[Heard]:
    """What some soldiers of a scenario hear; only they are instrumented."""
    loaded = load_scenario(scenario)
    played = play(loaded, seed)
    chosen = _spread(loaded.cast.soldiers, soldiers)
    only = replace(loaded, cast=replace(loaded.cast, soldiers=chosen))
    everyone = tuple(instrumented(only, played, seed))
    exercise = exercise_of(only, seed, everyone, played.duration_s)
    for soldier in everyone:
        yield heard_in(exercise, soldier, min(longest_s, exercise.duration_s))


def _spread(soldiers: Sequence[Soldier], count: int) -> tuple[Soldier, ...]:
    """So many, evenly from the first to the last."""
    places = np.unique(np.linspace(0, len(soldiers) - 1, count).round().astype(int))
    return tuple(soldiers[index] for index in places)


def honesty(heard: Heard, positions: Sequence[Position]) -> Honesty:
    """Compare each placed position with the truth at its own time."""
    placed = [one for one in positions if one.mode != "unplaced"]
    time_s = np.array([(one.time_ns - heard.begins_ns) / NS_PER_S for one in placed])
    truth = heard.soldier.truth
    within = (time_s >= truth.time_s[0]) & (time_s <= truth.time_s[-1])
    placed = [one for one, good in zip(placed, within, strict=True) if good]
    time_s = time_s[within]
    enu = np.array([(one.east_m, one.north_m, one.up_m) for one in placed]).reshape(-1, 3)
    six = np.array([one.covariance_m2 for one in placed]).reshape(-1, 6)
    miss = enu - interpolated(time_s, truth.time_s, truth.position_m)
    flat = np.stack([six[:, [0, 1]], six[:, [1, 3]]], axis=1)
    squared = np.einsum("ki,kij,kj->k", miss[:, :2], np.linalg.inv(flat), miss[:, :2])
    return Honesty(
        heard.exercise.name,
        0,
        heard.soldier.id,
        np.hypot(*miss[:, :2].T),
        squared,
        miss[:, 2] ** 2 / six[:, 5],
    )


def measure(scenario: str, seeds: Sequence[int] = SEEDS, soldiers: int = SOLDIERS) -> list[Honesty]:
    """Every chosen soldier of every seed."""
    return [
        replace(honesty(heard, fused(heard)), seed=seed)
        for seed in seeds
        for heard in cases(scenario, seed, soldiers)
    ]


def rows(found: Sequence[Honesty]) -> list[Row]:
    """A row a scenario, and one of all; soldiers count alike, however long they were played."""
    names = sorted({one.scenario for one in found})
    by_name = (_row(name, [one for one in found if one.scenario == name]) for name in names)
    return [*by_name, _row("all", found)]


def _row(name: str, found: Sequence[Honesty]) -> Row:
    shares = [_share(one.inside) for one in found]
    heights = [_share((one.height_squared <= _CHI2_95_ONE)[np.isfinite(one.height_squared)]) for one in found]
    return {
        "scenario": name,
        "soldiers": len(found),
        "error_p95_m": float(np.mean([np.percentile(one.error_m, 95) for one in found])),
        "inside_95_pct": float(np.mean(shares)),
        "least_inside_95_pct": float(np.min(shares)),
        "height_inside_95_pct": float(np.nanmean(heights)),
        "normalised_squared": float(np.mean([np.mean(one.squared) for one in found])),
    }


def _share(inside: FloatArray | npt.NDArray[np.bool_]) -> float:
    return 100.0 * float(np.mean(inside)) if inside.size else float("nan")


def table(found: Sequence[Honesty]) -> list[str]:
    """The rows as lines of a Markdown table."""
    lines = [
        "| scenario | soldiers | p95 m | inside 95 %: mean | worst soldier | height | normalised² (2) |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    return [*lines, *(_line(row) for row in rows(found))]


def _line(row: Row) -> str:
    name, soldiers, error_m, *shares, squared = row.values()
    told = " | ".join(f"{share:.1f}" for share in shares)
    return f"| {name} | {soldiers} | {error_m:.1f} | {told} | {squared:.2f} |"
