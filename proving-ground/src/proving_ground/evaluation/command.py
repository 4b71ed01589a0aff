"""`bootprint evaluate`: recorded runs through the estimators, figures as a table, as JSON and as pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.commands.options import write_json
from bootprint.errors import ConfigError
from proving_ground.evaluation import smooth_command
from proving_ground.evaluation.alignment import Align
from sensor_gateway.recordings.run import Kind

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from proving_ground.evaluation.evaluate import Evaluated, Row, Task

_STDOUT = "-"
# Column: heading, digits after the point.
_TABLE: dict[str, tuple[str, int]] = {
    "duration_s": ("s", 0),
    "distance_m": ("m", 1),
    "rmse_m": ("RMSE m", 3),
    "p95_m": ("p95 m", 2),
    "final_m": ("end m", 2),
    "final_pct": ("end %", 2),
    "distance_error_pct": ("dist. %", 2),
    "height_final_m": ("height m", 2),
    "height_rmse_m": ("h. RMSE", 2),
    "floors_right_pct": ("floors %", 0),
    "heading_drift_deg_per_min": ("°/min", 2),
    "inside_95_pct": ("in 95 %", 0),
    "nees": ("NEES", 1),
    "us_per_sample": ("µs", 1),
    "strides": ("strides", 0),
    "strides_true": ("true", 0),
}

# From the most telling column to the one that a narrow terminal misses least.
_LESS_TELLING = (
    "rmse_m",
    "final_pct",
    "distance_m",
    "inside_95_pct",
    "final_m",
    "heading_drift_deg_per_min",
    "p95_m",
    "distance_error_pct",
    "height_final_m",
    "floors_right_pct",
    "us_per_sample",
    "nees",
    "duration_s",
    "strides",
    "strides_true",
    "height_rmse_m",
)
_NO_LIMIT = 10_000


def register(app: typer.Typer) -> None:
    """Add the command, and that of smoothed tracks."""
    app.command()(evaluate)
    smooth_command.register(app)


def evaluate(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Files, runs, or folders of runs.")],
    kind: Annotated[Kind | None, typer.Option(help="Sensors to use (default: the run's own).")] = None,
    method: Annotated[str | None, typer.Option(help="A method's name, or all.")] = None,
    align: Annotated[
        Align, typer.Option(help="Fit yaw and offset to all truth, or to its first 5 m.")
    ] = "best-fit",
    smoothed: Annotated[bool, typer.Option(help="Tracks of two feet as known afterwards.")] = False,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write a picture of every row.")] = None,
    json_file: Annotated[
        str | None, typer.Option("--json", metavar="FILE", help="Write the rows as JSON (- for stdout).")
    ] = None,
) -> None:
    """Score the estimators on recorded walks against their truth.

    PATH is a file, a run or a folder of runs, in any of the formats the project knows. Errors are in the plane,
    after a rigid fit of yaw and offset; NEES (2 when the covariance is honest) and the share inside the 95 %
    ellipse are over windows of ten seconds.
    """
    from rich.console import Console

    from proving_ground.evaluation.evaluate import methods_of, plan
    from sensor_gateway.recordings import load_runs

    tasks = plan(load_runs(paths, kind), kind, methods_of(method), smoothed=smoothed)
    _make_folder(plot)
    done = _compute(tasks, align, plot, Console(stderr=True))
    rows = [evaluated.row for evaluated in done]
    if json_file is not None:
        write_json(rows, json_file)
    if json_file != _STDOUT:
        show(rows, Console())


def _make_folder(folder: Path | None) -> None:
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"--plot {folder}: cannot be made: {error}") from error


def _compute(
    tasks: Sequence["Task"], align: Align, plot: Path | None, console: "Console"
) -> list["Evaluated"]:
    from rich.progress import track

    from proving_ground.evaluation.evaluate import evaluate_task

    done: list[Evaluated] = []
    for task in track(tasks, "evaluating", console=console, transient=True, disable=not console.is_terminal):
        done.append(evaluate_task(task, align))
        if plot is not None:
            from proving_ground.evaluation.plots import save_plot

            save_plot(done[-1], plot)
    return done


def show(rows: Sequence["Row"], console: "Console") -> None:
    """The table of rows and a line of summary per method.

    A terminal too narrow for all columns gets the most telling ones; a file or pipe gets them all.
    """
    from proving_ground.evaluation.evaluate import summaries

    if not console.is_terminal:
        console.width = _NO_LIMIT
    console.print(_table(rows, _fitting(rows, console)))
    for summary in summaries(rows):
        console.print(_summary_line(summary), highlight=False, soft_wrap=True)


def _fitting(rows: Sequence["Row"], console: "Console") -> list[str]:
    from rich.measure import Measurement

    wide = console.options.update(width=_NO_LIMIT, max_width=_NO_LIMIT)
    for count in range(len(_LESS_TELLING), 1, -1):
        columns = [column for column in _TABLE if column in _LESS_TELLING[:count]]
        if Measurement.get(console, wide, _table(rows, columns)).maximum <= console.width:
            return columns
    return [_LESS_TELLING[0]]


def _table(rows: Sequence["Row"], columns: Sequence[str]) -> "Table":
    from rich.table import Table

    table = Table(box=None, header_style="bold", row_styles=["", "dim"], pad_edge=False)
    for heading in ("run", "kind", "method"):
        table.add_column(heading, no_wrap=True)
    for column in columns:
        table.add_column(_TABLE[column][0], justify="right", no_wrap=True)
    for row in rows:
        figures = [_figure(row[column], _TABLE[column][1]) for column in columns]
        table.add_row(str(row["run"]), str(row["kind"]), str(row["method"]), *figures)
    return table


def _summary_line(summary: "Row") -> str:
    def figures(column: str, digits: int) -> str:
        return " / ".join(
            _figure(summary[f"{column}_{name}"], digits) for name in ("median", "mean", "worst")
        )

    return (
        f"[bold]{summary['method']}[/bold]  n {summary['n']}  (median / mean / worst)  "
        f"RMSE {figures('rmse_m', 3)} m   end {figures('final_m', 2)} m   end {figures('final_pct', 2)} %"
    )


def _figure(value: object, digits: int) -> str:
    return f"{value:.{digits}f}" if isinstance(value, int | float) else "–"
