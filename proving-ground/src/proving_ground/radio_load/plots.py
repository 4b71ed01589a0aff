"""Pictures of docs/radio-load.md: added error against bits a second with the floor, and error under loss."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from proving_ground.evaluation.plots import ERROR, ESTIMATE, MUTED, STYLE, TRUTH
from proving_ground.radio_load.formats import OURS
from proving_ground.radio_load.study import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DPI: Final = 130
_PANEL_IN: Final = (4.2, 3.9)
_LOSS_IN: Final = (5.6, 3.4)
_MARKERS: Final = "osv^Dp*h"


def save_curves(study: Study, path: Path) -> None:
    """A panel for each tracks: ours over its budgets, every other format a point, the floor a line."""
    plt = _pyplot()
    with plt.style.context(STYLE):
        width, height = _PANEL_IN
        figure, panels = plt.subplots(
            1,
            len(study.curves),
            figsize=(width * len(study.curves), height),
            layout="constrained",
            squeeze=False,
        )
        for axes, name in zip(panels[0], study.curves, strict=True):
            _draw_curve(axes, name, study)
        panels[0][0].set_ylabel("added error, 95th percentile, m")
        figure.legend(*panels[0][0].get_legend_handles_labels(), fontsize=8, loc="outside right upper")
        figure.savefig(path, dpi=_DPI)
        plt.close(figure)


def _draw_curve(axes: "Axes", name: str, study: Study) -> None:
    others = [row for row in study.formats[name] if row["format"] != OURS]
    for row, marker in zip(others, _MARKERS, strict=False):
        bits, error_m = row["bits_per_s"], row["added_error_p95_m"]
        axes.plot(bits, error_m, marker, color=TRUTH, markersize=5, label=row["format"])
    floor = [(bits, p95_m) for p95_m, bits in study.floor[name]]
    axes.plot(*zip(*floor, strict=True), "--", color=ERROR, label="information floor")
    points = [(row["bits_per_s"], row["added_error_p95_m"]) for row in study.curves[name]]
    axes.plot(*zip(*points, strict=True), "o-", color=ESTIMATE, label=OURS)
    axes.set(xscale="log", yscale="log", title=name, xlabel="bit/s for twelve soldiers")
    axes.grid(visible=True)


def save_loss(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """p95 against loss, with and without the receivers' reports."""
    plt = _pyplot()
    with plt.style.context(STYLE):
        figure, axes = plt.subplots(figsize=_LOSS_IN, layout="constrained")
        for feedback, colour in ((True, ESTIMATE), (False, ERROR)):
            chosen = [row for row in rows if row["feedback"] is feedback]
            label = f"{'with' if feedback else 'without'} receivers' reports, {chosen[0]['bitrate']} bit/s"
            losses = [100.0 * row["loss"] for row in chosen]
            axes.plot(losses, [row["added_error_p95_m"] for row in chosen], "o-", color=colour, label=label)
        axes.axhline(8.0, color=MUTED, linewidth=1.0)
        axes.set(xlabel="frames lost, %", ylabel="added error, 95th percentile, m", ylim=(0.0, None))
        axes.grid(visible=True)
        axes.legend()
        figure.savefig(path, dpi=_DPI)
        plt.close(figure)


def _pyplot() -> Any:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    return plt
