"""Storms one after the other, each with another seed, until they have lasted so long; then what they must hold to.

python -m proving_ground.exercises.faults.storms OUT [--minutes 60] [--scenario building-clearing] [--seed 1]

Every storm leaves its report in OUT/SEED; those of an earlier run are played anew, unless --resume goes on with it.
Exit 1 if a goal is missed. `reliability_page` makes docs/reliability.md of their results.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from proving_ground.exercises.playing import Playing, play, prepare, write_outcome

LONGEST_DOWN_S: Final = 5.0
RIGHT_WITHIN_S: Final = 10.0
MOST_GROWTH_PCT_PER_H: Final = 1.0
_PLAYED: Final = "played.json"


@dataclass(frozen=True)
class Verdict:
    """What was asked, what was found, and whether that is enough; None where nothing was there to be judged."""

    goal: str
    found: str
    holds: bool | None


@dataclass(frozen=True)
class Conditions:
    """What all storms of a run have in common."""

    scenario: str
    speed: float
    version: str = version("bootprint-proving-ground")


def verdicts(results: Sequence[Mapping[str, Any]]) -> list[Verdict]:
    """The goals of a storm over all results (``result.json``)."""
    rows = [row for result in results for row in result["faults"]]
    downs = [row["down_s"] for row in rows if row["down_s"] is not None]
    too_long = sum(down > LONGEST_DOWN_S for down in downs)
    missing = sum(row["positions_missing"] for row in rows)
    right, honest = (_within(rows, name) for name in ("right_after_s", "honest_after_s"))
    growths = [result["faults_summary"]["memory_growth_worst_pct_per_h"] for result in results]
    grown = [growth for growth in growths if growth is not None]
    return [
        Verdict(
            f"no process down over {LONGEST_DOWN_S:g} s",
            f"{too_long} of {len(downs)}, {max(downs, default=0.0):.1f} s at worst",
            too_long == 0 if downs else None,
        ),
        Verdict(
            f"picture right within {RIGHT_WITHIN_S:g} s of each fault's end",
            f"{right} of {len(rows)} (honest: {honest})",
            right == len(rows) if rows else None,
        ),
        Verdict("no position lost", f"{missing} missing", missing == 0 if rows else None),
        Verdict(
            f"memory grows by less than {MOST_GROWTH_PCT_PER_H:g} % an hour",
            f"{max(grown):.2f} % an hour at worst"
            if grown
            else "no process lived for long enough (see soak)",
            max(grown) < MOST_GROWTH_PCT_PER_H if grown else None,
        ),
    ]


def _within(rows: Sequence[Mapping[str, Any]], name: str) -> int:
    return sum(row[name] is not None and row[name] <= RIGHT_WITHIN_S for row in rows)


def main(
    out: Annotated[Path, typer.Argument(help="Folder for a report of each storm.")],
    minutes: Annotated[float, typer.Option(help="Of exercise time, in all.")] = 60.0,
    scenario: Annotated[str, typer.Option(help="What is played each time.")] = "building-clearing",
    seed: Annotated[int, typer.Option(help="Of the first storm; then the next ones.")] = 1,
    speed: Annotated[float, typer.Option(help="Exercise time runs this many times as fast.")] = 1.0,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run that OUT is of.")] = False,
) -> None:
    """Play storms, tell the verdicts."""
    conditions = Conditions(scenario, speed)
    open_run(out, conditions, resume=resume)
    results: list[Mapping[str, Any]] = []
    while sum(result["duration_s"] for result in results) < 60.0 * minutes:
        results.append(_play(out, seed + len(results), conditions))
    found = verdicts(results)
    for verdict in found:
        sign = {True: "holds", False: "MISSED", None: "not judged"}[verdict.holds]
        typer.echo(f"{sign}: {verdict.goal}: {verdict.found}")
    raise typer.Exit(any(verdict.holds is False for verdict in found))


def open_run(out: Path, conditions: Conditions, *, resume: bool) -> None:
    """A folder without results for a new run; to resume one needs the conditions that it was begun with."""
    played = out / _PLAYED
    if resume:
        begun = json.loads(played.read_text(encoding="utf-8")) if played.exists() else None
        if begun != asdict(conditions):
            raise typer.BadParameter(f"{out} is of {begun}, not of {asdict(conditions)}: leave --resume out")
        return
    for result in out.glob("*/result.json"):
        result.unlink()
    out.mkdir(parents=True, exist_ok=True)
    played.write_text(json.dumps(asdict(conditions)), encoding="utf-8")


def _play(out: Path, seed: int, conditions: Conditions) -> Mapping[str, Any]:
    """One storm's result; it is played if this run has none of it."""
    path = out / str(seed) / "result.json"
    if not path.exists():
        how = Playing(path.parent, speed=conditions.speed, headless=True, storm=seed)
        write_outcome(play(prepare(conditions.scenario, seed, how), how), path.parent, None)
    result: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return result


if __name__ == "__main__":
    typer.run(main)
