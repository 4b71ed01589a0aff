"""Score tables: which figures in which order, in words and units that people read; on a terminal and as HTML."""

import html
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from proving_ground.exercises.processes.usage import by_service
from proving_ground.exercises.scoring.result import Result

TABLES = (
    ("soldiers", "Positions at the soldiers, against truth"),
    ("pictures", "Pictures at the receivers, of everybody else"),
    ("nets", "Radio nets, link headers included"),
    ("links", "What each computer put on its links"),
)
_UNITS = {
    "_bits_per_s": "bit/s",
    "bits_per_s": "bit/s",
    "_m": "m",
    "_s": "s",
    "_pct": "%",
    "_ms": "ms",
    "_mb": "MB",
}
_FILE_WIDTH = 170
_SHORT_ROWS = 20  # a longer table gives way to a summary on the terminal


def print_scores(result: Result) -> None:
    """The score tables on standard output; of a crowd their medians and worst."""
    console = _console()
    for key, title in TABLES:
        rows = result.figures[key]
        if len(rows) > _SHORT_ROWS:
            rows, title = summary(rows), f"{title}: {len(rows)} rows, in short"
        console.print(_terminal_table(rows, title))
    if "faults" in result.figures:
        console.print(_terminal_table(result.figures["faults"], "Faults, and what became of them"))
        console.print(_terminal_table([result.figures["faults_summary"]], "All faults"))
    if "usage" in result.figures:
        console.print(_terminal_table(by_service(result.figures["usage"]), "Processes"))
        settled, starting = (cell(result.figures[f"latency_{name}_ms"]) for name in ("p99", "start_p99"))
        console.print(
            f"latency sensor to track, p99: {settled} ms; in the first ten seconds {starting} ms",
            highlight=False,
        )


def print_rows(rows: Sequence[Mapping[str, Any]], title: str) -> None:
    """One table on standard output."""
    _console().print(_terminal_table(rows, title))


def _console() -> Console:
    console = Console()
    if not console.is_terminal:
        console.width = _FILE_WIDTH  # a file or a pipe has no columns to save
    return console


def _terminal_table(rows: Sequence[Mapping[str, Any]], title: str) -> Table:
    table = Table(title=title, title_justify="left")
    rows = known(rows)
    for column in rows[0] if rows else ():
        table.add_column(heading(column), justify="left" if column == next(iter(rows[0])) else "right")
    for row in rows:
        table.add_row(*(cell(value) for value in row.values()))
    return table


def summary(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Median, least and greatest of every column of numbers."""
    name, *columns = rows[0]
    kinds: dict[str, Callable[[Sequence[float]], Any]] = {"median": np.median, "least": min, "greatest": max}
    found: list[dict[str, Any]] = []
    for kind, figure in kinds.items():
        found.append({name: kind})
        for column in columns:
            values = [row[column] for row in rows if row[column] is not None]
            found[-1][column] = float(figure(values)) if values else None
    return found


def known(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The rows without the columns of which nobody knows anything, as floors where there are none."""
    kept = [column for column in (rows[0] if rows else ()) if any(row[column] is not None for row in rows)]
    return [{column: row[column] for column in kept} for row in rows]


def heading(column: str) -> str:
    """A column's name for people: the unit after its words, which may break between lines."""
    for suffix, unit in _UNITS.items():
        if column.endswith(suffix):
            return f"{column.removesuffix(suffix).replace('_', ' ')} {unit}".strip()
    return column.replace("_", " ")


def cell(value: Any) -> str:
    """A figure with two decimals, large ones with none; a dash if it is unknown."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.2f}"
    return str(value)


def html_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """The same as HTML."""
    if not rows:
        return "<p>None.</p>"
    rows = known(rows)
    head = "".join(f"<th>{html.escape(heading(column))}</th>" for column in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell(v))}</td>" for v in row.values()) + "</tr>" for row in rows
    )
    return f"<div class=wide><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
