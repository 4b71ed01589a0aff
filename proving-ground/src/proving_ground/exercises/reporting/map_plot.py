"""The report's map: who went where, on each storey, and what the command post was told of it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from proving_ground.exercises.reporting.plotting import (
    FEW,
    TRUTH,
    Plot,
    colours_of,
    every,
    new_figure,
    svg_of,
)
from proving_ground.exercises.scoring.result import Result
from proving_ground.exercises.scoring.score import Compared, true_floors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS, _COLUMNS = 4, 2
_WALL = "#6e7781"


def draw_map(result: Result) -> Plot:
    """A panel for each storey that somebody was on; few soldiers have a colour each, of many each unit has."""
    levels = _levels(result)[:_PANELS]
    rows = -(-len(levels) // _COLUMNS)
    figure, axes = new_figure(min(len(levels), _COLUMNS), rows, height=5.6 if rows == 1 else 4.0 * rows)
    colours = _colours(result)
    for axis, level in zip(axes, levels, strict=False):
        _draw_storey(axis, result, level, colours)
    for axis in axes[len(levels) :]:
        axis.remove()
    _add_legend(figure, colours, reports=_are_few(result))
    return Plot("Map", svg_of(figure), _caption(result))


def _are_few(result: Result) -> bool:
    return len(result.compared) <= FEW


def _name(compared: Compared, result: Result) -> str:
    """What a soldier's line is called: by himself among few, by his unit among many."""
    return compared.soldier.id if _are_few(result) else compared.soldier.unit


def _colours(result: Result) -> dict[str, str]:
    return colours_of(_name(compared, result) for compared in result.compared.values())


def _caption(result: Result) -> str:
    if _are_few(result):
        return (
            "Fused ways over true ones (grey), from the dots on; crosses are where the command post was told a "
            "soldier to be."
        )
    return "Fused ways by unit over true ones (grey), from the dots on."


def _levels(result: Result) -> list[int]:
    exercise = result.played.exercise
    seen: set[int] = set()
    for compared in result.compared.values():
        floors = true_floors(compared.soldier.truth, compared.time_s, exercise)
        seen |= {int(floor) for floor in floors[np.isfinite(floors)]}
    return sorted(seen) or [0]


def _draw_storey(axis: "Axes", result: Result, level: int, colours: Mapping[str, str]) -> None:
    exercise = result.played.exercise
    for outline in exercise.plan.get(level, ()):
        axis.plot(outline[:, 0], outline[:, 1], color=_WALL, linewidth=0.8, zorder=2)
    for compared in result.compared.values():
        _draw_way(axis, compared, level, result, colours[_name(compared, result)])
    title = f"floor {level}" if len(exercise.storeys_m) > 1 else ""
    axis.set(title=title, xlabel="east (m)", ylabel="north (m)")
    axis.set_aspect("equal", adjustable="box", anchor="N")


def _draw_way(axis: "Axes", compared: Compared, level: int, result: Result, colour: str) -> None:
    """Truth and fused way while on this level (or between levels next to it)."""
    exercise = result.played.exercise
    step = every(2 * len(result.compared), compared.time_s.size)
    time_s = compared.time_s[::step]
    truth = compared.truth_m[::step]
    here = np.ones(time_s.size, dtype=bool)
    if compared.soldier.truth.has_height and len(exercise.storeys_m) > 1:
        here = exercise.floors(truth[:, 2]) == level
    fused = compared.to_truth(compared.track.at(time_s)[:, :2])
    few = _are_few(result)
    for line, paint, width, order in ((truth[:, :2], TRUTH, 3.0, 1), (fused, colour, 1.0 if few else 0.7, 3)):
        shown = np.where(here[:, None], line, np.nan)
        axis.plot(
            shown[:, 0], shown[:, 1], color=paint, linewidth=width, solid_capstyle="round", zorder=order
        )
    if here.size and here[0]:
        axis.plot(*fused[0], "o", color=colour, markersize=4.0 if few else 2.5, zorder=5)
    if few:
        _draw_reports(axis, compared, level, result, colour)


def _draw_reports(axis: "Axes", compared: Compared, level: int, result: Result, colour: str) -> None:
    post = result.played.exercise.command_post
    log = result.played.heard[post].reports.get(compared.soldier.id)
    if log is None or not len(log):
        return
    told = log.told(result.played.start_ns)
    here = np.isnan(told.floor) | (told.floor == level)
    places = compared.to_truth(told.place_m[here])
    axis.plot(places[:, 0], places[:, 1], "x", color=colour, markersize=3.5, markeredgewidth=0.8, zorder=4)


def _add_legend(figure: "Figure", colours: Mapping[str, str], *, reports: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=TRUTH, linewidth=3.0, label="truth")]
    handles += [Line2D([], [], color=colour, linewidth=1.5, label=name) for name, colour in colours.items()]
    if reports:
        told = "told to the command post"
        handles.append(Line2D([], [], color=_WALL, marker="x", linestyle="", markersize=4, label=told))
    figure.legend(handles=handles, fontsize=8, loc="outside lower center", ncols=7, frameon=False)
