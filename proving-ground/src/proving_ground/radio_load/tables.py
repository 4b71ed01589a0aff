"""The rows of a load test as a table for people."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from proving_ground.exercises.reporting.tables import cell, heading

_COLUMNS: Final = (
    "format",
    "bits_per_s",
    "bytes_per_report",
    "added_error_p50_m",
    "added_error_p95_m",
    "added_error_p99_m",
    "age_p95_s",
    "budget_exceeded",
    "missing_pct",
    "squeezed_error_p95_m",
)
_FILE_WIDTH: Final = 170


def contest_table(rows: Sequence[Mapping[str, Any]], title: str) -> Table:
    """A row for each format; what breaks the budget stands out."""
    table = Table(title=title, title_justify="left")
    for column in _COLUMNS:
        table.add_column(heading(column), justify="left" if column == "format" else "right")
    for row in rows:
        cells = (_yes_no(row[name]) if name == "budget_exceeded" else cell(row[name]) for name in _COLUMNS)
        table.add_row(*cells)
    return table


def _yes_no(value: bool) -> str:
    return "[bold red]yes[/]" if value else "no"


def sweep_table(rows: Sequence[Mapping[str, Any]], parameters: Sequence[str]) -> Table:
    """A row for each combination of parameters, a column for each figure: mean ± half the 95 % interval."""
    figures = list(dict.fromkeys(row["figure"] for row in rows))
    table = Table(title="mean over seeds ± half the 95 % interval", title_justify="left")
    for name in (*parameters, *figures):
        table.add_column(heading(name), justify="right")
    found: dict[tuple[Any, ...], dict[str, str]] = {}
    for row in rows:
        key = tuple(row[name] for name in parameters)
        half = row["half_width_95"]
        shown = cell(row["mean"]) if half is None else f"{cell(row['mean'])} ± {cell(half)}"
        found.setdefault(key, {})[row["figure"]] = shown
    for key, cells in found.items():
        table.add_row(*(str(value) for value in key), *(cells.get(name, "–") for name in figures))
    return table


def print_table(table: Table) -> None:
    """On standard output; a file or a pipe has no columns to save."""
    console = Console()
    if not console.is_terminal:
        console.width = _FILE_WIDTH
    console.print(table)
