"""The page docs/figures.md: what `bootprint evaluate` finds on the recorded data, as Markdown.

python -m proving_ground.evaluation.figures DATA > docs/figures.md
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from bootprint import logs
from proving_ground.evaluation.evaluate import ALL, Row, evaluate_task, methods_of, plan, summaries
from sensor_gateway.recordings import load_runs

_SETS = ("pyshoe-vicon", "foot-gcp", "xio-gait", "gaitmap-example", "dualfoot-fgo")
_COLUMNS = (
    ("rmse_m", "RMSE m", "{:.3f}"),
    ("final_pct", "end %", "{:.2f}"),
    ("distance_error_pct", "distance %", "{:+.2f}"),
    ("height_final_m", "height m", "{:+.2f}"),
    ("heading_drift_deg_per_min", "drift °/min", "{:+.2f}"),
    ("inside_95_pct", "in 95 %", "{:.0f}"),
    ("us_per_sample", "µs a sample", "{:.1f}"),
)
_HEAD = """# Figures on the recorded data

Made by `make figures` (`bootprint evaluate` on each set); errors are horizontal, after a rigid fit of yaw and
offset. The data sets are public recordings under the MIT licence: pyshoe-vicon by Wagstaff, Peretroukhin and Kelly
(University of Toronto), foot-gcp by M. T. Koroglu, xio-gait by x-io Technologies, gaitmap-example by MaD Lab (FAU),
dualfoot-fgo by Hu and Hu. Published by others on the same kinds of data: one fixed threshold 0.33 m (vicon) and
3.3 m (gcp) mean RMSE, a trained LSTM detector 0.108 m and 1.91 m.
"""


def main(data: Path) -> None:
    """Print the page for the sets that are in ``data``."""
    logs.configure("error")
    out = sys.stdout.write
    out(_HEAD)
    for name in _SETS:
        if (data / name).is_dir():
            out(f"\n## {name}\n\n")
            out(_methods_table(data / name) if name in _SETS[:2] else "")
            out(_runs_table(_rows(data / name, None)))


def _rows(path: Path, method: str | None) -> list[Row]:
    return [evaluate_task(task, "best-fit").row for task in plan(load_runs([path]), None, methods_of(method))]


def _methods_table(path: Path) -> str:
    """RMSE by method: median, mean and worst over the set's runs."""
    lines = ["| method | n | median m | mean m | worst m |", "|---|---|---|---|---|"]
    for row in summaries(_rows(path, ALL)):
        figures = " | ".join(_cell(row[f"rmse_m_{name}"], "{:.3f}") for name in ("median", "mean", "worst"))
        lines.append(f"| {row['method']} | {row['n']} | {figures} |")
    return "\n".join(lines) + "\n\n"


def _runs_table(rows: Sequence[Row]) -> str:
    titles = " | ".join(title for _, title, _ in _COLUMNS)
    lines = [f"| run | {titles} |", "|---|" + "---|" * len(_COLUMNS)]
    for row in rows:
        cells = " | ".join(_cell(row[name], form) for name, _, form in _COLUMNS)
        lines.append(f"| {row['run']} | {cells} |")
    return "\n".join(lines) + "\n"


def _cell(value: float | int | str | None, form: str) -> str:
    return "–" if value is None else form.format(value)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
