"""Services as real processes, so many soldiers of them: what each costs while they walk, and its start."""

import time
from contextlib import closing
from pathlib import Path
from typing import Final

import psutil

from bootprint.errors import BootprintError
from bootprint.stopping import Stop
from proving_ground.exercises.processes.stage import Play, Stage
from proving_ground.exercises.processes.usage import UsageMeter, by_service
from proving_ground.performance.figures import Table
from proving_ground.performance.latencies import SAID_BY, Latencies
from proving_ground.performance.walking_squads import walking_squads

_SETTLE_S: Final = 10.0
"""Of walking, until filters have settled and caches are filled."""
_HEARD: Final = 4
"""Computers whose latencies are measured: to listen to all would be a load of its own."""
_SPARE_S: Final = 30.0
_PATIENCE_S: Final = 60.0
_LOOK_S: Final = 0.005


def cost_of(soldiers: int, seconds: float, folder: Path) -> Table:
    """Processor, memory and latency by service over so many seconds of walking."""
    exercise = walking_squads(soldiers, seconds + _SETTLE_S)
    with Stop() as stop, Stage(exercise, Play(folder)) as stage:
        walk(stage, stop)
        heard = [(exercise.identity(one.id), stage.endpoint(one.id)) for one in exercise.soldiers[:_HEARD]]
        with closing(Latencies(stage.clock, heard)) as latencies:
            walk_until(stage, stop, _SETTLE_S)
            meter = UsageMeter(stage.processes.all_pids)
            latencies.begin()
            walk_until(stage, stop, _SETTLE_S + seconds)
            rows = by_service(meter.rows())
        return {str(row["service"]): _cells(row, latencies) for row in rows}


def _cells(row: dict[str, object], latencies: Latencies) -> dict[str, float | None]:
    median_ms, most_ms = latencies.percentiles_ms(str(row["service"]))
    costs = {name: float(str(row[name])) for name in ("processes", "cpu_mean_pct", "memory_mean_mb")}
    return costs | {"latency_p50_ms": median_ms, "latency_p99_ms": most_ms}


def starts(folder: Path, turns: int) -> Table:
    """Each service of a soldier who walks, killed and started again: until its first word, and processor time."""
    exercise = walking_squads(1, _SPARE_S + turns * len(SAID_BY) * 4.0)
    with Stop() as stop, Stage(exercise, Play(folder)) as stage:
        walk(stage, stop)
        walk_until(stage, stop, _SETTLE_S)
        soldier = exercise.soldiers[0].id
        found = {service: [_restart(stage, soldier, service) for _ in range(turns)] for service in SAID_BY}
    return {service: _medians(each) for service, each in found.items()}


def _restart(stage: Stage, soldier: str, service: str) -> tuple[float, float, float]:
    """Seconds until it speaks, its processor seconds by then, and its resident MB."""
    name = f"{soldier}/{service}"
    stage.processes.kill(name)
    began_s = time.monotonic()
    stage.spawn(soldier, service)
    process = psutil.Process(stage.processes.pids[name])
    while service not in stage.observers.alive(soldier):
        stage.processes.check()
        if time.monotonic() - began_s > _PATIENCE_S:
            raise BootprintError(f"{service} did not speak within {_PATIENCE_S:g} s of its start")
        time.sleep(_LOOK_S)
    used = process.cpu_times()
    return time.monotonic() - began_s, used.user + used.system, process.memory_info().rss / 1e6


def _medians(turns: list[tuple[float, float, float]]) -> dict[str, float | None]:
    names = ("start_s", "start_cpu_s", "resident_mb")
    return {
        name: sorted(values)[len(values) // 2]
        for name, values in zip(names, zip(*turns, strict=True), strict=True)
    }


def walk(stage: Stage, stop: Stop) -> None:
    """Start everything, and the walks."""
    stage.wait_ready(stop)
    stage.start_walks(stop)


def walk_until(stage: Stage, stop: Stop, elapsed_s: float) -> None:
    """Wait for that moment of the exercise; an error if a process ends, or somebody wants to."""
    while stage.elapsed_s < elapsed_s:
        stage.processes.check()
        if stop.wait(0.1):
            raise BootprintError("stopped before all was measured; nothing is written")
