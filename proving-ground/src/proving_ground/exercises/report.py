"""What people read after an exercise: a score table on the terminal, ``result.json`` and ``report.html``."""

import base64
import html
import io
import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from proving_ground.exercises.exercise import Exercise
from proving_ground.exercises.result import Result

_TABLES = (
    ("soldiers", "Positions at the soldiers, against truth"),
    ("pictures", "Pictures at the receivers"),
    ("links", "Radio links, link headers included"),
)
_UNITS = {"_bits_per_s": "bit/s", "bits_per_s": "bit/s", "_m": "m", "_s": "s", "_pct": "%", "_ms": "ms"}
_FILE_WIDTH = 160
_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem}
body{color:#1b1f23;background:#fff}
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.25rem .8rem;border-bottom:1px solid #d0d7de}
th{text-align:left;font-weight:600}td{text-align:right;font-variant-numeric:tabular-nums}
td:first-child{text-align:left}
img{max-width:100%}
"""


def print_scores(result: Result) -> None:
    """The score tables on standard output."""
    console = Console()
    if not console.is_terminal:
        console.width = _FILE_WIDTH  # a file or a pipe has no columns to save
    for key, title in _TABLES:
        rows = result.figures[key]
        table = Table(title=title, title_justify="left")
        for column in rows[0] if rows else ():
            table.add_column(_title(column), justify="left" if column == next(iter(rows[0])) else "right")
        for row in rows:
            table.add_row(*(_cell(value) for value in row.values()))
        console.print(table)
    console.print(f"latency sensor to track, p99: {_cell(result.figures['latency_p99_ms'])} ms")


def write_report(folder: Path, exercise: Exercise, result: Result) -> None:
    """Write ``result.json`` and ``report.html`` into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "result.json").write_text(json.dumps(result.figures, indent=2) + "\n", encoding="utf-8")
    (folder / "report.html").write_text(_page(exercise, result), encoding="utf-8")


def _title(column: str) -> str:
    """A column's name for people: the unit after its words, which may break between lines."""
    for suffix, unit in _UNITS.items():
        if column.endswith(suffix):
            return f"{column.removesuffix(suffix).replace('_', ' ')} {unit}"
    return column.replace("_", " ")


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _page(exercise: Exercise, result: Result) -> str:
    sources = sorted({soldier.run.source for soldier in exercise.soldiers if soldier.run.source})
    tables = "".join(f"<h2>{title}</h2>{_html_table(result.figures[key])}" for key, title in _TABLES)
    return (
        "<!doctype html><html lang=en><meta charset=utf-8><title>bootprint: exercise report</title>"
        f"<style>{_STYLE}</style><h1>Exercise report: {html.escape(result.figures['exercise'])}</h1>"
        f"<p>{result.figures['duration_s']:.0f} s of exercise time at {result.figures['speed']:g}x, "
        f"{result.figures['processes']} processes. Walks: {html.escape('; '.join(sources))}.</p>"
        f"{_map(result)}{tables}"
        f"<p>Latency sensor to track, 99th percentile: {_cell(result.figures['latency_p99_ms'])} ms.</p></html>\n"
    )


def _html_table(rows: list[dict[str, Any]]) -> str:
    if not rows:
        return "<p>None.</p>"
    head = "".join(f"<th>{html.escape(_title(column))}</th>" for column in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(_cell(v))}</td>" for v in row.values()) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _map(result: Result) -> str:
    """Fused tracks over truth, one panel a soldier, as an embedded picture."""
    if not result.compared:
        return "<p>No position was heard.</p>"
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        1, len(result.compared), figsize=(4.2 * len(result.compared), 4.4), squeeze=False
    )
    for axis, (name, compared) in zip(axes[0], result.compared.items(), strict=True):
        truth, fused = compared.soldier.truth.position_m, compared.to_truth(compared.track.enu_m[:, :2])
        axis.plot(truth[:, 0], truth[:, 1], color="#9aa4ae", linewidth=3, label="truth")
        axis.plot(fused[:, 0], fused[:, 1], color="#0b6bcb", linewidth=1.2, label="fused")
        told = compared.to_truth(result.reports_m[name])
        axis.plot(
            told[:, 0], told[:, 1], "x", color="#e36209", markersize=5, label="told to the command post"
        )
        axis.plot(*fused[0], "o", color="#1a7f37", label="start")
        axis.plot(*fused[-1], "s", color="#cf222e", label="end")
        axis.set(
            title=f"{compared.soldier.callsign} ({name}): {compared.soldier.run.name}", xlabel="m", ylabel="m"
        )
        axis.set_aspect("equal", adjustable="datalim")
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    plt.close(figure)
    encoded = base64.b64encode(picture.getvalue()).decode("ascii")
    return f'<p><img alt="Fused tracks over truth" src="data:image/png;base64,{encoded}"></p>'
