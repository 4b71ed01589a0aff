"""Plays an exercise to its end, either way, and shows how it goes: what `demo` and `exercise run` share."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bootprint.errors import ConfigError
from bootprint.stopping import Stop

if TYPE_CHECKING:
    from rich.console import Console

    from bootprint.processes import ProcessError
    from proving_ground.exercises.exercise import Exercise
    from proving_ground.exercises.processes.stage import Play, Stage
    from proving_ground.exercises.processes.usage import UsageMeter
    from proving_ground.exercises.scoring.result import Result

Mode = Literal["processes", "inprocess"]
_LINE_EVERY_S = 5.0  # host seconds between lines where there is no terminal
_REFRESH_S = 0.5


@dataclass(frozen=True)
class Playing:
    """How an exercise is to be played and shown; ``duration_s`` None is until the last walk has ended.

    ``storm``: the seed of faults of every kind at random.
    ``page_port``: where the command post's page is wanted, 0 for anywhere; None is for no page.
    """

    report: Path
    mode: Mode = "processes"
    speed: float = 1.0
    duration_s: float | None = None
    headless: bool = False
    serial: bool = False
    record: Path | None = None
    workers: int = 0
    storm: int | None = None
    page_port: int | None = None

    @property
    def local_workers(self) -> int:
        """Processes for soldiers' lines: as asked, or one a processor."""
        return self.workers or os.cpu_count() or 1


@dataclass(frozen=True)
class Outcome:
    """The result, and what ended the exercise before its time, if anything did."""

    result: "Result"
    fault: "ProcessError | None" = None
    stopped: bool = False


def play(exercise: "Exercise", how: Playing) -> Outcome:
    """Play it; ConfigError or StageError if it cannot begin."""
    return _in_process(exercise, how) if how.mode == "inprocess" else _in_processes(exercise, how)


def prepare(scenario: str, seed: int, how: Playing) -> "Exercise":
    """The exercise of a scenario and a seed, built on the local processors; ConfigError if it is wrong."""
    from proving_ground.exercises.faults.storm import with_storm
    from proving_ground.exercises.processes.capacity import check_memory
    from proving_ground.exercises.processes.run_files import with_files, without_samples
    from proving_ground.exercises.source import open_exercise, soldier_count

    if how.mode == "processes":
        check_memory(soldier_count(scenario))
    with progress_bars() as show:
        exercise = open_exercise(
            scenario, seed, workers=how.local_workers, on_progress=lambda share: show("sensors", share)
        )
    if how.storm is not None:
        exercise = with_storm(exercise, how.storm, how.duration_s)
    if how.mode == "inprocess":
        return exercise
    staged = with_files(exercise, how.report)
    return staged if how.serial else without_samples(staged)


def write_outcome(outcome: Outcome, report: Path, json_out: str | None) -> None:
    """``result.json``, ``report.html``, ``--json``, and tables for people; then the error that ended it, if any."""
    from bootprint.commands.options import write_json
    from proving_ground.exercises.reporting.report import write_report
    from proving_ground.exercises.reporting.tables import print_scores

    write_report(report, outcome.result)
    if json_out != "-":
        print_scores(outcome.result)
    if json_out is not None:
        write_json(outcome.result.figures, json_out)
    if outcome.fault is not None:
        raise outcome.fault


def check_outputs(report: Path, *targets: str | Path | None) -> None:
    """ConfigError now, rather than after the whole exercise, if its results cannot be written."""
    files = [Path(target) for target in targets if target not in (None, "-")]
    try:
        report.mkdir(parents=True, exist_ok=True)
        for file in (report / "result.json", *files):
            with file.open("a", encoding="utf-8"):
                pass
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot be written: {error.strerror}") from error


# -- in one process -----------------------------------------------------------------------------------------------


def _in_process(exercise: "Exercise", how: Playing) -> Outcome:
    from proving_ground.exercises.event_time.inprocess_play import play_in_process
    from proving_ground.exercises.scoring.result import result_of

    with progress_bars() as show:
        played = play_in_process(
            exercise,
            workers=how.local_workers,
            duration_s=how.duration_s,
            record=how.record,
            on_progress=show,
        )
    return Outcome(result_of(played, {"mode": "inprocess"}))


@contextmanager
def progress_bars() -> Iterator[Callable[[str, float], None]]:
    """Bars on standard error, one for each thing that is told of with the share that is done."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>10}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    tasks: dict[str, TaskID] = {}
    with Progress(*columns, TimeElapsedColumn(), console=Console(stderr=True)) as progress:

        def show(what: str, share: float) -> None:
            if what not in tasks:
                tasks[what] = progress.add_task(what, total=1.0)
            progress.update(tasks[what], completed=share)

        yield show


# -- as real processes --------------------------------------------------------------------------------------------


def _in_processes(exercise: "Exercise", how: Playing) -> Outcome:
    from bootprint.processes import ProcessError
    from proving_ground.exercises.event_time.inprocess_play import SETTLE_S
    from proving_ground.exercises.processes.stage import Stage

    length_s = exercise.duration_s + SETTLE_S if how.duration_s is None else how.duration_s
    fault: ProcessError | None = None
    with Stop() as stop, Stage(exercise, _play_of(how)) as stage:
        runner = Runner(stage, length_s, stop, headless=how.headless)
        try:
            runner.run()
        except ProcessError as error:  # what was played until then is scored all the same
            fault = error
        result = runner.result()
    return Outcome(result, fault, stopped=stop.is_set())


def _play_of(how: Playing) -> "Play":
    from proving_ground.exercises.processes.stage import Play

    return Play(how.report, how.speed, how.serial, how.record, how.page_port)


class Runner:
    """Plays a stage to its end, showing it."""

    def __init__(self, stage: "Stage", length_s: float, stop: Stop, *, headless: bool) -> None:
        self._stage = stage
        self._length_s = length_s
        self._stop = stop
        self._headless = headless
        self._meter: UsageMeter | None = None  # from the walks' beginning on
        self._usage: list[dict[str, Any]] = []

    def run(self) -> None:
        """Until the exercise has lasted its length or a signal came."""
        from rich.console import Console

        console = Console(stderr=True)
        with progress_bars() as show:
            started = _share_of_processes(show)
            self._stage.wait_ready(self._stop, started)
            if not self._stop.is_set():
                self._stage.start_walks(self._stop, started)
        if self._stop.is_set():
            return
        console.print(f"{len(self._stage.processes.pids)} processes run, walks begin")
        if self._stage.page_address is not None:
            console.print(f"[bold]the command post's map: {self._stage.page_address}[/bold]")
        try:
            if self._headless or not console.is_terminal:
                self._lines(console)
            else:
                self._live(console)
        finally:
            self._usage = [dict(row) for row in self._meter.rows()] if self._meter else []

    def result(self) -> "Result":
        """The score of what was played."""
        from proving_ground.exercises.scoring.heard import latencies_ms
        from proving_ground.exercises.scoring.result import Played, result_of

        stage = self._stage
        duration_s = max(stage.elapsed_s, 1e-9) if stage.start_ns else 1e-9
        stage.end()
        heard = stage.observers.heard()
        nets = {name: net.counts for name, net in stage.nets.items()}
        extra = {
            "mode": "processes",
            "speed": stage.speed,
            "processes": len(stage.processes.pids),
            **latencies_ms(list(heard.values()), stage.start_ns),
            "usage": self._usage,
        }
        played = Played(stage.exercise, stage.start_ns, duration_s, heard, nets, tuple(stage.outages))
        return result_of(played, extra)

    def _going(self) -> bool:
        from proving_ground.exercises.processes.usage import UsageMeter

        if self._meter is None and self._stage.elapsed_s >= 0.0:
            self._meter = UsageMeter(self._stage.processes.all_pids)
        self._stage.play_faults()
        self._stage.processes.check()
        return self._stage.elapsed_s < self._length_s and not self._stop.is_set()

    def _lines(self, console: "Console") -> None:
        from proving_ground.exercises.reporting.live import LiveView

        view = LiveView(self._stage, self._length_s)
        next_line = time.monotonic()
        while self._going():
            if time.monotonic() >= next_line:
                next_line += _LINE_EVERY_S
                console.print(view.line(), highlight=False, soft_wrap=True)
            self._stop.wait(0.1)

    def _live(self, console: "Console") -> None:
        from rich.live import Live

        from proving_ground.exercises.reporting.live import LiveView

        view = LiveView(self._stage, self._length_s)
        with Live(view.render(), console=console, refresh_per_second=4, screen=False) as live:
            while self._going():
                live.update(view.render())
                self._stop.wait(_REFRESH_S)


def _share_of_processes(show: Callable[[str, float], None]) -> Callable[[int, int], None]:
    def started(running: int, of: int) -> None:
        show("processes", running / of)

    return started
