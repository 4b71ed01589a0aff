"""`bootprint benchmark fusion`: one soldier's services as processes over a real router, and how late positions are.

Both boots at 200 Hz, a body unit, satellites, air pressure and a camera. A position is late by what it waits for by
design (batches to be full, the foot filter's look-ahead, messages that may be out of order) and by what processes,
bus and machine add. The same sensors played in event time tell the first: there nothing takes time, so a position
comes with the sample that completes what it waited for. What is more than that on the bus is the second.
"""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import typer

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.commands.options import Json
from bootprint.errors import BootprintError
from bootprint.messages import Position
from bootprint.stopping import Stop
from bootprint.zenoh_bus import open_bus
from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.processes.stage import Play, Stage
from proving_ground.exercises.processes.usage import UsageMeter
from proving_ground.performance.figures import Table
from proving_ground.performance.limits import Limit, conclude, limits_table

SCENARIO: Final = Path(__file__).parent / "scenarios" / "one-soldier.toml"
_SEED: Final = 1
_SETTLE_S: Final = 15.0
"""Of the exercise: standing, and a few steps, until filters have settled and caches are filled."""
_CHAIN: Final = ("sensor-gateway", "pdr-engine", "fusion")


@dataclass(frozen=True, slots=True)
class FusionFigures:
    """Host ms from a position's own time to the bus: in all, by design, and beyond that; shares of a core."""

    positions: int
    late_p50_ms: float
    late_p99_ms: float
    by_design_p50_ms: float
    by_design_p99_ms: float
    beyond_p50_ms: float
    beyond_p99_ms: float
    fusion_core_pct: float
    chain_core_pct: float


LIMITS: Final = (
    Limit("beyond_p99_ms", "from sensor to position beyond what is waited for by design, p99", 60.0, "ms"),
    Limit("fusion_core_pct", "of a core, fusion", 5.0, "%"),
)


def measure(seconds: float) -> FusionFigures:
    """So many seconds of walking."""
    from proving_ground.exercises.source import open_exercise

    exercise = open_exercise(str(SCENARIO), _SEED)
    lateness_ns, core_pct = _played(exercise, seconds)
    return figures(lateness_ns, waits_ns(exercise, _SETTLE_S + seconds), core_pct)


def figures(
    lateness_ns: Mapping[int, float], waits: Mapping[int, int], core_pct: Mapping[str, float]
) -> FusionFigures:
    """Of positions by their time (ns from the start) in both plays; BootprintError if they have none in common."""
    common = sorted(lateness_ns.keys() & waits.keys())
    if not common:
        raise BootprintError("no position came in time; the services' logs say why")
    late_ms = np.array([lateness_ns[time_ns] for time_ns in common]) / 1e6
    wait_ms = np.array([waits[time_ns] for time_ns in common]) / 1e6
    beyond_ms = late_ms - wait_ms
    return FusionFigures(
        positions=len(common),
        late_p50_ms=float(np.percentile(late_ms, 50)),
        late_p99_ms=float(np.percentile(late_ms, 99)),
        by_design_p50_ms=float(np.percentile(wait_ms, 50)),
        by_design_p99_ms=float(np.percentile(wait_ms, 99)),
        beyond_p50_ms=float(np.percentile(beyond_ms, 50)),
        beyond_p99_ms=float(np.percentile(beyond_ms, 99)),
        fusion_core_pct=core_pct["fusion"],
        chain_core_pct=sum(core_pct[service] for service in _CHAIN),
    )


def _played(exercise: Exercise, seconds: float) -> tuple[dict[int, float], dict[str, float]]:
    """As processes: each position's lateness, ns, by its time from the start, and shares of a core by service."""
    from proving_ground.performance.playing import walk, walk_until

    soldier = exercise.soldiers[0].id
    heard: dict[int, float] = {}
    with (
        tempfile.TemporaryDirectory() as folder,
        Stop() as stop,
        Stage(exercise, Play(Path(folder))) as stage,
    ):
        walk(stage, stop)
        with closing(open_bus(stage.endpoint(soldier))) as bus:
            bus.subscribe(exercise.identity(soldier).selector("position"), partial(_note, stage, heard))
            walk_until(stage, stop, _SETTLE_S)
            meter = UsageMeter(stage.processes.all_pids)
            walk_until(stage, stop, _SETTLE_S + seconds)
            usage = {str(row["process"]): float(row["cpu_pct"] or 0.0) for row in meter.rows()}
    settled = {time_ns: late_ns for time_ns, late_ns in heard.items() if time_ns > _SETTLE_S * NS_PER_S}
    return settled, {service: usage[f"{soldier}/{service}"] for service in _CHAIN}


def _note(stage: Stage, heard: dict[int, float], envelope: Envelope) -> None:
    """In the bus's thread."""
    late_s = stage.clock.host_seconds_since(envelope.message.time_ns)
    if isinstance(envelope.message, Position) and late_s is not None:
        heard[envelope.message.time_ns - stage.start_ns] = late_s * NS_PER_S


def waits_ns(exercise: Exercise, seconds: float) -> dict[int, int]:
    """In event time: how long after a position's time (ns from the start) what it waited for is due."""
    from fusion.engine import FusionCore
    from pdr_engine.foot import warm_up
    from proving_ground.evaluation.fusion.lines import heard_in

    warm_up()
    heard = heard_in(exercise, exercise.soldiers[0], seconds)
    core = FusionCore(heard.config, heard.identity, heard.origin)
    return {
        said.message.time_ns - heard.begins_ns: due_ns - said.message.time_ns
        for due_ns, envelope in heard.messages
        for said in core.handle(envelope)
        if isinstance(said.message, Position)
    }


def table(found: FusionFigures) -> Table:
    """As the performance report has it."""
    return {
        "from sensor to position": _latency(found.late_p50_ms, found.late_p99_ms),
        "of that by design": _latency(found.by_design_p50_ms, found.by_design_p99_ms),
        "beyond design": _latency(found.beyond_p50_ms, found.beyond_p99_ms),
        "fusion": {"cpu_mean_pct": found.fusion_core_pct},
        "gateway, pdr-engine and fusion": {"cpu_mean_pct": found.chain_core_pct},
    }


def _latency(median_ms: float, most_ms: float) -> dict[str, float | None]:
    return {"latency_p50_ms": median_ms, "latency_p99_ms": most_ms}


def fusion(
    seconds: Annotated[float, typer.Option(help="Of walking.", min=5.0, max=180.0)] = 40.0,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if a limit is missed.")] = False,
    json: Json = None,
) -> None:
    """Measure how late one soldier's positions are, and what they cost: real processes over a real router.

    Example: bootprint benchmark fusion --check
    """
    found = measure(seconds)
    keeps_limits = all(limit.holds(found) for limit in LIMITS)
    conclude(asdict(found), partial(show, found), keeps_limits=keeps_limits, json=json, check=check)


def show(found: FusionFigures) -> None:
    """The figures as a table, those with a limit beside it."""
    from rich.console import Console

    console = Console()
    console.print(limits_table(found, LIMITS, f"of {found.positions} positions"))
    for line in _lines(found):
        console.print(line, highlight=False)


def _lines(found: FusionFigures) -> Sequence[str]:
    return (
        f"beyond design, median: {found.beyond_p50_ms:.0f} ms",
        f"by design: {found.by_design_p50_ms:.0f} ms (median), {found.by_design_p99_ms:.0f} ms (p99)",
        f"in all: {found.late_p50_ms:.0f} ms (median), {found.late_p99_ms:.0f} ms (p99)",
        f"gateway, pdr-engine and fusion: {found.chain_core_pct:.1f} % of a core",
    )
