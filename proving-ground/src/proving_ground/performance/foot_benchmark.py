"""`bootprint benchmark foot`: what the foot INS costs, measured beside the textbook's filter in the same run.

One core, one foot, one walk. Speed is processor time of the best of several turns, taken in turns with the
textbook's so that both meet the same machine; start and memory are those of a fresh process (`fresh_engine`).
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from bootprint.commands.options import Json
from bootprint.errors import BootprintError
from proving_ground.performance.cores import one_core
from proving_ground.performance.limits import Limit, conclude, limits_table
from sensor_gateway.recordings.run import FEET, ImuSeries

if TYPE_CHECKING:
    from pdr_engine.foot import FootNavigator

_BATCH = 10
_RECTANGLE_M = ((0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (30.0, 15.0, 0.0), (0.0, 15.0, 0.0), (0.0, 0.0, 0.0))
_PATIENCE_S = 120.0  # the first start of all compiles the kernel


@dataclass(frozen=True, slots=True)
class FootFigures:
    """What was measured: µs of processor time a sample, seconds from spawn to first message, MB resident."""

    samples: int
    states: int
    us_batches: float
    us_one_pass: float
    us_textbook: float
    times_textbook: float
    warm_start_s: float
    resident_mb: float


LIMITS = (
    Limit("us_batches", f"a sample, in batches of {_BATCH}", 1.5, "µs"),
    Limit("us_one_pass", "a sample, in one pass", 1.5, "µs"),
    Limit(
        "times_textbook", "faster than the textbook's filter, both in one pass", 70.0, "times", at_least=True
    ),
    Limit("warm_start_s", "from spawn to the first message, kernel in the cache", 1.5, "s"),
    Limit("resident_mb", "resident after the walk, both boots", 120.0, "MB"),
)


def foot(
    path: Annotated[
        Path | None, typer.Argument(help="A recorded run (default: a simulated walk).", metavar="[PATH]")
    ] = None,
    turns: Annotated[int, typer.Option(help="Best of this many turns.", min=1)] = 3,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if a limit is missed.")] = False,
    json: Json = None,
) -> None:
    """Measure the foot INS: µs a sample beside a textbook NumPy filter, start and memory of a fresh engine.

    Example: bootprint benchmark foot --check
    """
    figures = measure(walk_of(path), turns)
    keeps_limits = all(limit.holds(figures) for limit in LIMITS)
    conclude(asdict(figures), partial(show, figures), keeps_limits=keeps_limits, json=json, check=check)


def walk_of(path: Path | None) -> ImuSeries:
    """One foot of the recorded run, or of a simulated walk round a rectangle."""
    if path is None:
        from bootprint.config import Origin
        from proving_ground.simulation.walker import simulate_walk

        origin = Origin(latitude_deg=0.0, longitude_deg=0.0)
        return simulate_walk("benchmark", _RECTANGLE_M, origin, seed=1).imus[FEET[0]]
    from sensor_gateway.recordings import load_runs

    feet = [run.imus[place] for run in load_runs([path], "foot") for place in FEET if place in run.imus]
    return max(feet, key=lambda imu: len(imu.time_s))


def measure(imu: ImuSeries, turns: int) -> FootFigures:
    """All figures of one walk."""
    from pdr_engine.foot import warm_up
    from pdr_engine.foot.memory import STATES

    warm_up()
    with one_core():
        batches, one_pass, textbook = _best_seconds(imu, turns)
    start_s, resident_mb = measure_process(imu)
    us = 1e6 / len(imu.time_s)
    return FootFigures(
        samples=len(imu.time_s),
        states=STATES,
        us_batches=batches * us,
        us_one_pass=one_pass * us,
        us_textbook=textbook * us,
        times_textbook=textbook / one_pass,
        warm_start_s=start_s,
        resident_mb=resident_mb,
    )


def _best_seconds(imu: ImuSeries, turns: int) -> tuple[float, float, float]:
    """Least processor time over the walk: in batches, in one pass, and the textbook's."""
    from pdr_engine.foot import FootNavigator
    from proving_ground.evaluation.foot.textbook import textbook_track

    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    contenders: tuple[Callable[[], object], ...] = (
        lambda: navigate(FootNavigator(), imu, time_ns, _BATCH),
        lambda: navigate(FootNavigator(), imu, time_ns, len(time_ns)),
        lambda: textbook_track(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s),
    )
    seconds = [[_cpu_seconds(contender) for contender in contenders] for _ in range(turns)]
    batches, one_pass, textbook = (min(column) for column in zip(*seconds, strict=True))
    return batches, one_pass, textbook


def _cpu_seconds(work: Callable[[], object]) -> float:
    begin = time.thread_time()
    work()
    return time.thread_time() - begin


def navigate(
    navigator: "FootNavigator", imu: ImuSeries, time_ns: "np.typing.NDArray[np.int64]", batch: int
) -> None:
    """The whole walk through a navigator, in batches of this size."""
    for start in range(0, len(time_ns), batch):
        piece = slice(start, start + batch)
        navigator.process(time_ns[piece], imu.accel_m_s2[piece], imu.gyro_rad_s[piece])
    navigator.finish()


def measure_process(imu: ImuSeries) -> tuple[float, float]:
    """Seconds from spawn to the first message of a fresh engine, and its resident memory (MB) after the walk."""
    from proving_ground.performance import fresh_engine

    with tempfile.TemporaryDirectory() as folder:
        walk = Path(folder, "walk.npy")
        np.save(walk, np.column_stack([imu.time_s, imu.accel_m_s2, imu.gyro_rad_s]))
        begin = time.perf_counter()
        with _engine(fresh_engine.__name__, walk) as engine:
            _await(engine, fresh_engine.RESULT)
            start_s = time.perf_counter() - begin
            _await(engine, fresh_engine.DONE)
            return start_s, _resident_mb(engine.pid)


@contextmanager
def _engine(module: str, walk: Path) -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-m", module, str(walk)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as engine:
        try:
            yield engine
        finally:
            engine.communicate(timeout=_PATIENCE_S)


def _await(engine: "subprocess.Popen[str]", word: str) -> None:
    line = engine.stdout.readline().strip() if engine.stdout else ""
    if line != word:
        raise BootprintError(
            f"the engine's process said {line!r} instead of {word!r}; its errors stand above"
        )


def _resident_mb(pid: int) -> float:
    import psutil

    return float(psutil.Process(pid).memory_info().rss) / 1e6


def show(figures: FootFigures) -> None:
    """The figures as a table, each beside its limit."""
    from rich.console import Console

    console = Console()
    console.print(limits_table(figures, LIMITS, "of the foot INS"))
    console.print(
        f"{figures.states} states over {figures.samples} samples; "
        f"the textbook's 9 states in NumPy: {figures.us_textbook:.0f} µs a sample.",
        highlight=False,
    )
