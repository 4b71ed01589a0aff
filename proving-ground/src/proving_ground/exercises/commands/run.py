"""`bootprint exercise run|compare|sweep`: play a scenario, compare two results, repeat with other seeds."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bootprint.commands.options import Json, write_json
from bootprint.errors import ConfigError
from proving_ground.exercises.demo import EXIT_INTERRUPTED, Page, check_options, page_port

if TYPE_CHECKING:
    from rich.table import Table

_FILE_WIDTH = 170
Scenario = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A name of `bootprint exercise list`, or a .toml file.")
]
Workers = Annotated[
    int, typer.Option(min=0, help="Local processes to use (default: one a processor).", show_default=False)
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="A parameter: net.loss, net.profile, net.latency_s, hub.threshold_m, fusion.…, pdr.… May be repeated.",
    ),
]


def add_to(app: typer.Typer) -> None:
    """Add the commands about running to ``bootprint exercise``."""
    app.command()(run)
    app.command()(compare)
    app.command()(sweep)


def run(
    scenario: Scenario,
    report: Annotated[Path, typer.Option(help="Folder for result.json, report.html and logs.")],
    mode: Annotated[
        Literal["processes", "inprocess"],
        typer.Option(help="Real services in real time, or the same cores in event time, as fast as it goes."),
    ] = "processes",
    speed: Annotated[
        float, typer.Option(help="Exercise time runs this many times as fast (processes).")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="Draws persons, sensors' errors and radio losses.")] = 1,
    duration: Annotated[
        float | None,
        typer.Option(help="End after this many seconds of exercise time (default: when the tasks do)."),
    ] = None,
    parameters: Set = None,
    serial: Annotated[
        Literal["pty"] | None,
        typer.Option(
            help="Sensors as MAVLink bytes on pseudo-terminals, which gateways read as serial ports."
        ),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="OUT.mcap", help="Record every message of every computer, and the truth."),
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="No live table; a line now and then.")] = False,
    page: Page = None,
    workers: Workers = 0,
    storm: Annotated[
        int | None, typer.Option(metavar="SEED", help="Faults of every kind at random, one after the other.")
    ] = None,
    json_out: Json = None,
) -> None:
    """Play a scenario and score it at every hop.

    The same scenario, seed and --mode inprocess give the same result.json, byte for byte.

    Example: bootprint exercise run building-clearing --mode inprocess --report out/clearing
    """
    check_options(speed, None, duration)
    _check_mode(mode, speed, serial)
    from proving_ground.exercises.playing import Playing, check_outputs, play, prepare, write_outcome
    from proving_ground.exercises.settings import check_settings, with_settings
    from proving_ground.exercises.sweep import parse_values

    check_outputs(report, None if json_out == "-" else json_out, record)
    settings = dict(_single(*parse_values(text)) for text in parameters or ())
    check_settings(settings)
    how = Playing(
        report,
        mode=mode,
        speed=speed,
        duration_s=duration,
        headless=headless,
        serial=serial is not None,
        record=record,
        workers=workers,
        storm=storm,
        page_port=page_port(page, headless=headless),
    )
    outcome = play(with_settings(prepare(scenario, seed, how), settings), how)
    write_outcome(outcome, report, json_out)
    if outcome.stopped:
        raise typer.Exit(EXIT_INTERRUPTED)


def _check_mode(mode: str, speed: float, serial: str | None) -> None:
    if mode == "inprocess" and serial is not None:
        raise ConfigError("--serial pty: needs --mode processes: in one process there is no line to read")
    if mode == "inprocess" and speed != 1.0:
        raise ConfigError("--speed: only for --mode processes; inprocess goes as fast as it can")
    if serial is not None and speed != 1.0:
        raise ConfigError("--serial pty: sensors on a line are live, so --speed must be 1")


def _single(key: str, values: list[Any]) -> tuple[str, Any]:
    if len(values) != 1:
        raise ConfigError(f"--set {key}: one value to run with; for several use `bootprint exercise sweep`")
    return key, values[0]


def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="A result.json, or the folder of its report.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="The other one: better or worse than A?")],
    json_out: Json = None,
) -> None:
    """Compare two results of the same people and mark what got worse beyond noise.

    Example: bootprint exercise compare out/before out/after
    """
    from proving_ground.exercises.scoring.comparison import compare_results, read_result

    rows = compare_results(read_result(first), read_result(second))
    if not rows:
        raise ConfigError(f"{first} and {second} have no soldier, receiver or net in common")
    if json_out is not None:
        write_json(rows, json_out)
    if json_out != "-":
        _print(_comparison_table(rows))


def _comparison_table(rows: list[dict[str, Any]]) -> "Table":
    from rich.table import Table

    from proving_ground.exercises.reporting.tables import cell

    table = Table(title="mean of A and B, mean difference B - A with its 95 % interval", title_justify="left")
    for name in ("figure", "n", "A", "B", "difference", "±", ""):
        table.add_column(name, justify="left" if name in ("figure", "") else "right")
    styles = {"worse": "bold red", "better": "green"}
    for row in rows:
        shown = (cell(row[name]) for name in ("n", "first", "second", "difference", "half_width_95"))
        verdict = row["verdict"]
        table.add_row(row["figure"], *shown, "" if verdict == "same" else verdict, style=styles.get(verdict))
    return table


def sweep(
    scenario: Scenario,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds, from 1 on.")] = 5,
    parameters: Set = None,
    workers: Workers = 0,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler, e.g. tcp://10.0.0.5:8786.")
    ] = None,
    json_out: Json = None,
) -> None:
    """Repeat a scenario in event time with many seeds and all combinations of parameters.

    Figures of soldiers and of everyone's pictures are medians of a run; means over seeds have 95 % intervals.

    Example: bootprint exercise sweep building-clearing --seeds 10 --set net.loss=0,0.1,0.3
    """
    from proving_ground.exercises.settings import check_settings
    from proving_ground.exercises.source import check_scenario
    from proving_ground.exercises.sweep import combinations, parse_values, play_seed, swept

    grid = combinations(dict(parse_values(text) for text in parameters or ()))
    check_scenario(scenario)
    for settings in grid:
        check_settings(settings)
    rows = swept(scenario, seeds, grid, workers, dask, play_seed)
    if json_out is not None:
        write_json(rows, json_out)
    if json_out != "-":
        _print(_sweep_table(rows, list(grid[0])))


def _sweep_table(rows: list[dict[str, Any]], parameters: list[str]) -> "Table":
    """A row a combination would be too wide: a row a figure, a column a combination."""
    from rich.table import Table

    from proving_ground.exercises.reporting.tables import cell

    columns = list(dict.fromkeys(tuple(row[name] for name in parameters) for row in rows))
    table = Table(title="mean over seeds ± half the 95 % interval", title_justify="left")
    table.add_column("figure")
    for values in columns:
        pairs = zip(parameters, values, strict=True)
        table.add_column("\n".join(f"{name} {value}" for name, value in pairs) or "mean", justify="right")
    shown = {(row["figure"], tuple(row[name] for name in parameters)): row for row in rows}
    for figure in dict.fromkeys(row["figure"] for row in rows):
        cells = [shown.get((figure, values)) for values in columns]
        table.add_row(
            figure,
            *("–" if row is None else f"{cell(row['mean'])} ± {cell(row['half_width_95'])}" for row in cells),
        )
    return table


def _print(table: "Table") -> None:
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console.width = _FILE_WIDTH  # a file or a pipe has no columns to save
    console.print(table)
