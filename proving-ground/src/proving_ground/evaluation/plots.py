"""Pictures of evaluated runs: the track over the truth, error and, where both know it, height over time.

One PNG a row.
"""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proving_ground.evaluation.alignment import FloatArray, is_dense
from proving_ground.evaluation.evaluate import Evaluated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TRUTH, ESTIMATE, ERROR, MUTED = "#5b6770", "#d1495b", "#2e6f95", "#c8ced3"
_FIGURE_IN, _DPI = (11.0, 5.2), 130
STYLE: dict[str, Any] = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": TRUTH,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "xtick.color": TRUTH,
    "ytick.color": TRUTH,
    "font.size": 9,
    "grid.color": "#e6e9eb",
    "legend.frameon": False,
}


def save_plot(evaluated: Evaluated, folder: Path) -> Path:
    """Write the picture of one row into ``folder``; returns its path."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    path = folder / f"{_file_name(evaluated)}.png"
    places = "me;mh" if knows_height(evaluated) else "me"  # map, error, height
    with plt.style.context(STYLE):
        figure, axes = plt.subplot_mosaic(
            places, figsize=_FIGURE_IN, layout="constrained", width_ratios=(1.25, 1.0)
        )
        draw_map(axes["m"], evaluated)
        draw_error(axes["e"], evaluated)
        if "h" in axes:
            draw_height(axes["h"], evaluated)
        figure.savefig(path, dpi=_DPI)
        plt.close(figure)
    return path


def _file_name(evaluated: Evaluated) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", f"{evaluated.task.name}-{evaluated.task.method}")


def draw_map(axes: "Axes", evaluated: Evaluated) -> None:
    """The estimate, fitted to the truth, from above; a circle marks the start, a square the end."""
    track = evaluated.estimate.track.position_m
    fit, compared = evaluated.scored.fit, evaluated.scored.compared
    estimate = track[:, :2] if fit is None else fit.apply(track)
    if compared is not None:
        _draw_truth(axes, evaluated)
        _mark_ends(axes, compared.truth_m[:, :2], TRUTH)
    axes.plot(*estimate.T, color=ESTIMATE, linewidth=1.3, label="estimate", zorder=3)
    _mark_ends(axes, estimate, ESTIMATE)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="m", ylabel="m", title=evaluated.task.name)
    axes.grid(visible=True)
    axes.legend(loc="best")


def _draw_truth(axes: "Axes", evaluated: Evaluated) -> None:
    truth = evaluated.task.run.truth_of(evaluated.task.place)
    if truth is None:
        return
    line: dict[str, Any] = {"color": TRUTH, "label": "truth"}
    if is_dense(truth):
        line |= {"linewidth": 2.6, "alpha": 0.45}
    else:
        line |= {"linewidth": 0.8, "marker": "+", "markersize": 5, "alpha": 0.8}
    axes.plot(*truth.position_m[:, :2].T, zorder=2, **line)


def _mark_ends(axes: "Axes", position_m: FloatArray, colour: str) -> None:
    for point, marker in ((position_m[0], "o"), (position_m[-1], "s")):
        axes.plot(*point, marker, color=colour, markersize=7, markeredgecolor="white", zorder=4)


def draw_error(axes: "Axes", evaluated: Evaluated) -> None:
    """The error in the plane over time, with the run's RMSE as a line."""
    axes.set(xlabel="s", ylabel="error, m", title=_headline(evaluated))
    axes.grid(visible=True)
    compared, errors = evaluated.scored.compared, evaluated.scored.errors_m
    if compared is None:
        axes.text(0.5, 0.5, "no truth", ha="center", va="center", transform=axes.transAxes, color=TRUTH)
        return
    sparse = len(errors) < 200
    axes.fill_between(compared.time_s, errors, color=ERROR, alpha=0.12, linewidth=0)
    axes.plot(compared.time_s, errors, color=ERROR, linewidth=1.2, marker="." if sparse else None)
    if evaluated.scored.score.rmse_m is not None:
        axes.axhline(
            evaluated.scored.score.rmse_m, color=ESTIMATE, linewidth=0.9, linestyle="--", label="RMSE"
        )
        axes.legend(loc="upper left")
    axes.set_ylim(bottom=0.0, top=max(1.15 * float(np.max(errors)), 0.05))


def knows_height(evaluated: Evaluated) -> bool:
    """Whether there are heights to compare."""
    return evaluated.scored.score.height_rmse_m is not None


def draw_height(axes: "Axes", evaluated: Evaluated) -> None:
    """Heights of estimate and truth over time, from the first point compared."""
    compared = evaluated.scored.compared
    if compared is None:
        return
    truth, estimate = compared.truth_m[:, 2], compared.estimate_m[:, 2]
    first = int(np.flatnonzero(np.isfinite(truth + estimate))[0])
    axes.plot(compared.time_s, truth - truth[first], color=TRUTH, linewidth=2.6, alpha=0.45, label="truth")
    axes.plot(compared.time_s, estimate - estimate[first], color=ESTIMATE, linewidth=1.2, label="estimate")
    axes.set(xlabel="s", ylabel="height, m")
    axes.grid(visible=True)
    axes.legend(loc="best")


def _headline(evaluated: Evaluated) -> str:
    score = evaluated.scored.score
    parts = [evaluated.task.method]
    if score.rmse_m is not None:
        parts.append(f"RMSE {score.rmse_m:.2f} m")
    if score.final_m is not None:
        of = f" ({score.final_pct:.1f} %)" if score.final_pct is not None else ""
        parts.append(f"end {score.final_m:.2f} m{of}")
    return "   ".join(parts)
