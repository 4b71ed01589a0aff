"""`bootprint demo`: an exercise as real processes, live: soldiers, radio nets, one picture; then a score."""

import math
from pathlib import Path
from typing import Annotated

import typer

from bootprint.errors import ConfigError

EXIT_INTERRUPTED = 130
_SCENARIO = "building-clearing"
_PAGE_PORT = 8080


Page = Annotated[
    int | None,
    typer.Option(
        "--page",
        metavar="PORT",
        min=0,
        max=65535,
        help="Serve the command post's map there, 0 for any free port (default: 8080 or any, headless none).",
    ),
]


def page_port(asked: int | None, *, headless: bool) -> int | None:
    """Where the page is wanted: as asked, else at the usual port unless nobody looks."""
    return _PAGE_PORT if asked is None and not headless else asked


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
        float | None,
        typer.Option(
            help="Share of radio frames that each receiver misses, 0 to 0.9 (default: the nets' own)."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the simulated walks.")] = 1,
    page: Page = None,
    report: Annotated[
        Path, typer.Option(help="Folder for result.json, report.html and the processes' logs.")
    ] = Path("out/demo"),
    json_out: Annotated[
        str | None, typer.Option("--json", help="Write the result here too; - for standard output.")
    ] = None,
) -> None:
    """Show the whole system at work: sensors to boots to fusion to radio to the command post's picture.

    Starts a zenoh router for each computer and, as processes of their own, gateway, PDR engine, fusion and hub for
    every soldier, and a hub for every post. The computers are joined only by emulated radio nets. Ends with scores
    against truth.

    Example: bootprint demo --data recordings --speed 5
    """
    check_options(speed, loss, duration)
    from proving_ground.exercises.playing import Playing, check_outputs, play, prepare, write_outcome
    from proving_ground.exercises.settings import with_loss
    from proving_ground.exercises.squad import recorded_squad

    check_outputs(report, json_out)
    how = Playing(
        report,
        speed=speed,
        duration_s=duration,
        headless=headless,
        page_port=page_port(page, headless=headless),
    )
    exercise = prepare(_SCENARIO, seed, how) if data is None else recorded_squad(data)
    outcome = play(with_loss(exercise, loss), how)
    write_outcome(outcome, report, json_out)
    if outcome.stopped:
        raise typer.Exit(EXIT_INTERRUPTED)


def check_options(speed: float, loss: float | None, duration: float | None) -> None:
    """ConfigError for numbers that make no exercise."""
    if not (math.isfinite(speed) and 0 < speed <= 100):
        raise ConfigError(f"--speed {speed:g} must be above 0 and at most 100")
    if loss is not None and not 0.0 <= loss <= 0.9:
        raise ConfigError(f"--loss {loss:g} must be a share from 0 to 0.9, e.g. 0.1 for one frame in ten")
    if duration is not None and not duration > 0:
        raise ConfigError(f"--duration {duration:g} must be a positive number of seconds")
