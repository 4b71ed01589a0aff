"""Pictures of docs/foot-ins.md: tracks from above, and how many runs stay below which error."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from proving_ground.evaluation.evaluate import Evaluated
from proving_ground.evaluation.plots import ESTIMATE, STYLE, TRUTH, draw_map

_DPI = 80
_TRACK_IN = 3.6
_SHARES_IN = (8.0, 3.2)
_SHADES = {"shoe": "#2e6f95", "gyro": "#8a9a3b", "differential": "#c98a2b", "ared": "#7d5ba6"}


def save_tracks(runs: Sequence[Evaluated], path: Path) -> None:
    """These runs side by side, two in a row."""
    pyplot = _pyplot()
    rows = -(-len(runs) // 2)
    with pyplot.style.context(STYLE):
        figure, axes = pyplot.subplots(
            rows, 2, figsize=(2.4 * _TRACK_IN, rows * _TRACK_IN), layout="constrained", squeeze=False
        )
        for place, evaluated in zip(axes.flat, runs, strict=False):
            draw_map(place, evaluated)
            place.set_title(f"{evaluated.task.name}: RMSE {evaluated.row['rmse_m']:.2f} m", fontsize=9)
        _save(figure, path)


def save_shares(errors_m: Mapping[str, Mapping[str, Sequence[float]]], default: str, path: Path) -> None:
    """One panel a data set, one curve a method: the share of runs whose RMSE is below x."""
    pyplot = _pyplot()
    with pyplot.style.context(STYLE):
        figure, panels = pyplot.subplots(
            1, len(errors_m), figsize=_SHARES_IN, layout="constrained", squeeze=False
        )
        for axes, (name, methods) in zip(panels.flat, errors_m.items(), strict=True):
            for method, values in methods.items():
                mine = method == default
                ordered = np.sort(values)
                share = 100.0 * np.arange(1, len(ordered) + 1) / len(ordered)
                colour = ESTIMATE if mine else _SHADES.get(method, TRUTH)
                axes.step(
                    ordered, share, where="post", label=method, color=colour, linewidth=2.2 if mine else 1.2
                )
            axes.set(xscale="log", xlabel="RMSE, m", ylabel="runs below, %", title=name, ylim=(0.0, 103.0))
            axes.grid(visible=True)
        panels.flat[0].legend(loc="upper left")
        _save(figure, path)


def _pyplot() -> Any:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    return pyplot


def _save(figure: Any, path: Path) -> None:
    """Without the writer's version in it, so that the same picture has the same bytes."""
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})
    _pyplot().close(figure)
