"""`bootprint benchmark warnings`: how soon a hub warns of a friendly in danger, after it has truly come about.

A danger counts that lasts five seconds, from when it began; one that was warned of before it began was warned of in
no time. What nobody would be in time for, a line that swings across somebody for a moment, does not count.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final

import numpy as np
import typer

from bootprint.awareness import Reason
from bootprint.commands.options import Json
from proving_ground.performance.limits import conclude
from proving_ground.radio_trials.warning_play import (
    REASONS,
    STEPS_PER_S,
    BoolArray,
    FloatArray,
    Outcome,
    Radio,
    play_warnings,
)

WITHIN_S: Final = 5.0
LEAST_WITHIN_PCT: Final = 95.0
_SETTLED_S: Final = 60.0
"""Before it the hubs do not yet know of all."""
_SOLDIERS: Final = 12


@dataclass(frozen=True, slots=True)
class DelayRow:
    """One reason: dangers that lasted, how soon they were warned of, and shares of all pairs' time."""

    scenario: str
    reason: Reason
    dangers: int
    delay_p50_s: float | None
    delay_p95_s: float | None
    delay_max_s: float | None
    within_5_s_pct: float | None
    missed: int
    true_pct: float
    warned_needlessly_pct: float


def rows_of(scenario: str, outcome: Outcome) -> list[DelayRow]:
    """A row for each reason."""
    return [_row(scenario, reason, outcome.true[reason], outcome.warned[reason]) for reason in REASONS]


def _row(scenario: str, reason: Reason, true: BoolArray, warned: BoolArray) -> DelayRow:
    delays_s = np.array(list(delays(true, warned)))
    told = delays_s[np.isfinite(delays_s)]
    pairs = ~np.eye(true.shape[1], dtype=bool)

    def percentile(share: float) -> float | None:
        return float(np.percentile(told, share)) if told.size else None

    return DelayRow(
        scenario=scenario,
        reason=reason,
        dangers=int(delays_s.size),
        delay_p50_s=percentile(50.0),
        delay_p95_s=percentile(95.0),
        delay_max_s=percentile(100.0),
        within_5_s_pct=100.0 * float(np.mean(delays_s <= WITHIN_S)) if delays_s.size else None,
        missed=int(delays_s.size - told.size),
        true_pct=100.0 * float(true[:, pairs].mean()),
        warned_needlessly_pct=100.0 * float((warned & ~true)[:, pairs].mean()),
    )


def delays(true: BoolArray, warned: BoolArray) -> Iterator[float]:
    """Seconds from the begin of each danger (T, n, n) to its warning; infinite if none came while it lasted."""
    least, settled = round(WITHIN_S * STEPS_PER_S), round(_SETTLED_S * STEPS_PER_S)
    for before, us, friendly in np.argwhere(true[1:] & ~true[:-1]):
        step = before + 1
        lasting = true[step:, us, friendly]
        ended = np.flatnonzero(~lasting)
        length = int(ended[0]) if ended.size else len(lasting)
        if step >= settled and length >= least:
            told = np.flatnonzero(warned[step : step + length, us, friendly])
            yield float(told[0]) / STEPS_PER_S if told.size else np.inf


def squad_walks(scenario: str, seed: int, duration_s: float) -> FloatArray:
    """Ways (n, T, 3) m of a scenario's people, twelve at most."""
    from proving_ground.people import move
    from proving_ground.scenario.loading import load_scenario, play

    loaded = load_scenario(scenario)
    played = play(loaded, seed)
    walks = [
        move(
            played.persons[soldier.id], played.timetables[soldier.id].itinerary, seed * 1000 + soldier.number
        )
        .truth(1.0 / STEPS_PER_S)
        .position_m
        for soldier in loaded.cast.soldiers[:_SOLDIERS]
    ]
    length = min(*(len(walk) for walk in walks), round(duration_s * STEPS_PER_S))
    return np.stack([walk[:length] for walk in walks])


def warnings(
    scenario: Annotated[
        list[str] | None, typer.Option(help="Library scenarios (default: building-clearing, platoon-raid).")
    ] = None,
    bitrate: Annotated[int, typer.Option(help="The net's rate, bit/s, all hubs together.", min=75)] = 1200,
    loss: Annotated[float, typer.Option(help="Share of frames lost.", min=0.0, max=1.0)] = 0.0,
    header_bytes: Annotated[int, typer.Option(help="The link's own bytes for each frame.", min=0)] = 0,
    seconds: Annotated[float, typer.Option(help="Seconds of event time.", min=70.0)] = 300.0,
    seed: Annotated[int, typer.Option(help="Of people, weapons and losses.")] = 1,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if too few are warned within 5 s.")] = False,
    json: Json = None,
) -> None:
    """Measure how soon hubs warn of friendlies who are near, or in the line of a weapon.

    Example: bootprint benchmark warnings --bitrate 1200 --loss 0.1
    """
    radio = Radio(bitrate, loss, header_bytes)
    rows = [
        row
        for name in scenario or ["building-clearing", "platoon-raid"]
        for row in rows_of(name, play_warnings(squad_walks(name, seed, seconds), radio, seed))
    ]
    keeps_limits = not any((row.within_5_s_pct or 0.0) < LEAST_WITHIN_PCT for row in rows)
    conclude(rows, partial(show, rows), keeps_limits=keeps_limits, json=json, check=check)


def show(rows: list[DelayRow]) -> None:
    """The rows as a table."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    headings = ("dangers", "p50 s", "p95 s", "max s", "in 5 s %", "missed", "true %", "idle %")
    for index, heading in enumerate(("scenario", "reason", *headings)):
        table.add_column(heading, justify="left" if index < 2 else "right", no_wrap=True)
    for row in rows:
        values = (
            row.dangers,
            row.delay_p50_s,
            row.delay_p95_s,
            row.delay_max_s,
            row.within_5_s_pct,
            row.missed,
            row.true_pct,
            row.warned_needlessly_pct,
        )
        table.add_row(row.scenario, row.reason, *map(_cell, values))
    Console().print(table)


def _cell(value: float | None) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.1f}"
