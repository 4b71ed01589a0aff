"""`bootprint demo`: four soldiers, six computers, eighteen processes, two radio nets, one picture; then a score."""

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bootprint.commands.options import write_json
from bootprint.errors import ConfigError
from bootprint.stopping import Stop

if TYPE_CHECKING:
    from proving_ground.exercises.stage import Stage

_SETTLE_S = 4.0  # event seconds after the last walk, for the last reports to arrive
_LINE_EVERY_S = 5.0  # host seconds between lines of a headless demo
_REFRESH_S = 0.5
_EXIT_INTERRUPTED = 130


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(demo)


def demo(
    data: Annotated[
        Path | None,
        typer.Option(help="Folder of recorded foot walks (foot-gcp); without it walks are simulated."),
    ] = None,
    headless: Annotated[bool, typer.Option(help="No live table; one line every few seconds.")] = False,
    duration: Annotated[
        float | None,
        typer.Option(help="End after this many seconds of exercise time (default: when the walks do)."),
    ] = None,
    speed: Annotated[float, typer.Option(help="Exercise time runs this many times as fast.")] = 1.0,
    loss: Annotated[
        float, typer.Option(help="Share of radio frames that each receiver misses, 0 to 0.9.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the simulated walks.")] = 1,
    report: Annotated[
        Path, typer.Option(help="Folder for result.json, report.html and the processes' logs.")
    ] = Path("out/demo"),
    json_out: Annotated[
        str | None, typer.Option("--json", help="Write the result here too; - for standard output.")
    ] = None,
) -> None:
    """Show the whole system at work: sensors to boots to fusion to radio to the command post's picture.

    Starts a zenoh router for each of six computers and, as processes of their own, gateway, PDR engine, fusion
    and hub for four soldiers, a squad leader's hub and a command post's hub. The computers are joined only by two
    emulated radio nets. Ends with scores against truth.

    Example: bootprint demo --data recordings --speed 5
    """
    _check(speed, loss, duration)
    _check_outputs(report, json_out)
    from proving_ground.exercises.exercise import recorded_exercise, simulated_exercise
    from proving_ground.exercises.processes import ProcessError
    from proving_ground.exercises.report import print_scores, write_report
    from proving_ground.exercises.result import result_of
    from proving_ground.exercises.stage import Play, Stage

    exercise = recorded_exercise(data) if data else simulated_exercise(report / "walks", seed)
    length_s = exercise.duration_s + _SETTLE_S if duration is None else duration
    fault: ProcessError | None = None
    with Stop() as stop, Stage(exercise, Play(report, speed, loss)) as stage:
        try:
            Runner(stage, length_s, stop, headless=headless).run()
        except ProcessError as error:  # what was played until then is scored all the same
            fault = error
        result = result_of(stage)
    write_report(report, exercise, result)
    if json_out != "-":
        print_scores(result)
    if json_out is not None:
        write_json(result.figures, json_out)
    if fault is not None:
        raise fault
    if stop.is_set():
        raise typer.Exit(_EXIT_INTERRUPTED)


def _check_outputs(report: Path, json_out: str | None) -> None:
    """ConfigError now, rather than after the whole exercise, if its results cannot be written."""
    targets = [report / "result.json", *([Path(json_out)] if json_out not in (None, "-") else [])]
    try:
        report.mkdir(parents=True, exist_ok=True)
        for target in targets:
            with target.open("a", encoding="utf-8"):
                pass
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot be written: {error.strerror}") from error


def _check(speed: float, loss: float, duration: float | None) -> None:
    if not (math.isfinite(speed) and 0 < speed <= 100):
        raise ConfigError(f"--speed {speed:g} must be above 0 and at most 100")
    if not 0.0 <= loss <= 0.9:
        raise ConfigError(f"--loss {loss:g} must be a share from 0 to 0.9, e.g. 0.1 for one frame in ten")
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration {duration:g} must be a positive number of seconds")


@dataclass
class Runner:
    """Plays a stage to its end, showing it."""

    stage: "Stage"
    length_s: float
    stop: Stop
    headless: bool

    def run(self) -> None:
        """Until the exercise has lasted its length or a signal came."""
        from rich.console import Console

        console = Console(stderr=True)
        with console.status(f"starting {len(self.stage.processes.pids)} processes …"):
            self.stage.wait_ready(self.stop)
        if self.stop.is_set():
            return
        self.stage.start_walks(self.stop)
        console.print(f"{len(self.stage.processes.pids)} processes run, walks begin")
        if self.headless or not console.is_terminal:
            self._lines(console)
        else:
            self._live(console)

    def _going(self) -> bool:
        self.stage.processes.check()
        return self.stage.elapsed_s < self.length_s and not self.stop.is_set()

    def _lines(self, console: Any) -> None:
        from proving_ground.exercises.live import LiveView

        view = LiveView(self.stage, self.length_s)
        next_line = time.monotonic()
        while self._going():
            if time.monotonic() >= next_line:
                next_line += _LINE_EVERY_S
                console.print(view.line(), highlight=False, soft_wrap=True)
            self.stop.wait(0.1)

    def _live(self, console: Any) -> None:
        from rich.live import Live

        from proving_ground.exercises.live import LiveView

        view = LiveView(self.stage, self.length_s)
        with Live(view.render(), console=console, refresh_per_second=4, screen=False) as live:
            while self._going():
                live.update(view.render())
                self.stop.wait(_REFRESH_S)
