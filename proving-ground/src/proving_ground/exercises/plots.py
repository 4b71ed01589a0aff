"""The report's plots as inline SVG: map, error over time and distance, distributions, radio use."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bootprint.clock import NS_PER_S
from proving_ground.exercises.dead_reckoning import errors_m
from proving_ground.exercises.exercise import FloatArray
from proving_ground.exercises.result import Result
from proving_ground.exercises.score import Compared, true_floors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TRUTH, _REPORTS, _STEPS, _FUSED, _PICTURE = "#b3bcc5", "#e36209", "#a475f9", "#0b6bcb", "#e36209"
_FEW = 12  # soldiers whose lines can be told apart
_MOST_POINTS = 40_000  # in one plot, so that the page stays small
_BINS = 60
_WINDOW_S = 10.0


@dataclass(frozen=True)
class Plot:
    """A picture with its title and what to see in it."""

    title: str
    svg: str
    caption: str


def plots_of(result: Result) -> list[Plot]:
    """All plots that the result has data for."""
    if not result.compared:
        return []
    makers = (_map, _over_time, _over_distance, _distributions, _radio)
    return [plot for plot in (maker(result) for maker in makers) if plot is not None]


def _figure(columns: int = 1, width: float = 10.0, height: float = 3.8) -> "tuple[Figure, Sequence[Axes]]":
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update({"svg.hashsalt": "bootprint", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False)[0]
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _svg(figure: "Figure") -> str:
    """The figure as an SVG element; the same figure gives the same text."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    return svg[svg.index("<svg") :]


def _every(lines: int, points: int) -> int:
    """Every which point to draw."""
    return max(1, lines * points // _MOST_POINTS)


# -- map ----------------------------------------------------------------------------------------------------------


def _map(result: Result) -> Plot:
    """A panel for each storey that somebody was on."""
    exercise = result.played.exercise
    levels = _levels(result)
    panels = min(len(levels), 4)
    figure, axes = _figure(panels, width=10.0 if panels > 1 else 8.0, height=5.4 if panels < 3 else 4.2)
    for axis, level in zip(axes, levels, strict=False):
        for outline in exercise.plan.get(level, ()):
            axis.plot(outline[:, 0], outline[:, 1], color="#6e7781", linewidth=0.8, zorder=1)
        for compared in result.compared.values():
            _draw_way(axis, compared, level, result)
        title = f"floor {level}" if len(exercise.storeys_m) > 1 else ""
        axis.set(title=title, xlabel="east m", ylabel="north m")
        axis.set_aspect("equal", adjustable="datalim")
    _map_legend(axes[0])
    crowd = "" if len(result.compared) <= _FEW else " Reports are not drawn for so many."
    return Plot(
        "Map",
        _svg(figure),
        "Fused ways (blue) over true ones (grey); crosses are where the command post was told a soldier to be."
        + crowd,
    )


def _levels(result: Result) -> list[int]:
    exercise = result.played.exercise
    seen: set[int] = set()
    for compared in result.compared.values():
        floors = true_floors(compared.soldier.truth, compared.time_s, exercise)
        seen |= {int(floor) for floor in floors[np.isfinite(floors)]}
    return sorted(seen) or [0]


def _draw_way(axis: "Axes", compared: Compared, level: int, result: Result) -> None:
    """Truth and fused way while on this level (or between levels next to it)."""
    exercise = result.played.exercise
    step = _every(2 * len(result.compared), compared.time_s.size)
    time_s = compared.time_s[::step]
    truth = compared.truth_m[::step]
    here = np.ones(time_s.size, dtype=bool)
    if compared.soldier.truth.has_height and len(exercise.storeys_m) > 1:
        here = exercise.floors(truth[:, 2]) == level
    fused = compared.to_truth(compared.track.at(time_s)[:, :2])
    for line, colour, width in ((truth[:, :2], _TRUTH, 3.0), (fused, _FUSED, 1.0)):
        shown = np.where(here[:, None], line, np.nan)
        axis.plot(shown[:, 0], shown[:, 1], color=colour, linewidth=width, solid_capstyle="round", zorder=2)
    if here.any():
        first = fused[np.argmax(here)]
        axis.plot(*first, "o", color="#1a7f37", markersize=3.5, zorder=4)
        if len(result.compared) <= _FEW:
            _draw_reports(axis, compared, level, result)
            axis.annotate(compared.soldier.id, first, fontsize=8, xytext=(3, 3), textcoords="offset points")


def _draw_reports(axis: "Axes", compared: Compared, level: int, result: Result) -> None:
    post = result.played.exercise.command_post
    log = result.played.heard[post].reports.get(compared.soldier.id)
    if log is None or not len(log):
        return
    told = log.told(result.played.start_ns)
    here = np.isnan(told.floor) | (told.floor == level)
    places = compared.to_truth(told.place_m[here])
    axis.plot(places[:, 0], places[:, 1], "x", color=_REPORTS, markersize=3.5, markeredgewidth=0.8, zorder=3)


def _map_legend(axis: "Axes") -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=_TRUTH, linewidth=3.0, label="truth"),
        Line2D([], [], color=_FUSED, linewidth=1.2, label="fused"),
        Line2D([], [], color=_REPORTS, marker="x", linestyle="", label="told to the command post"),
        Line2D([], [], color="#1a7f37", marker="o", linestyle="", markersize=4, label="first seen here"),
    ]
    axis.legend(handles=handles, fontsize=8, loc="best", framealpha=0.85)


# -- errors -------------------------------------------------------------------------------------------------------


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _over_time(result: Result) -> Plot:
    curves = [(each.time_s, _lengths(each.errors_m)) for each in result.compared.values()]
    figure, axes = _figure()
    _draw_errors(axes[0], curves, list(result.compared))
    picture = result.pictures[result.played.exercise.command_post]
    if picture.time_s.size:
        middle, _ = _binned(picture.time_s, picture.against_truth_m)
        axes[0].plot(*middle, color=_PICTURE, linewidth=1.6, label="picture at the command post, median")
    axes[0].set(xlabel="time s", ylabel="error m", ylim=(0, None))
    axes[0].legend(fontsize=8, ncols=3)
    return Plot("Error over time", _svg(figure), _error_caption(result, "second"))


def _over_distance(result: Result) -> Plot:
    curves = [(each.walked_m, _lengths(each.errors_m)) for each in result.compared.values()]
    figure, axes = _figure()
    _draw_errors(axes[0], curves, list(result.compared))
    axes[0].set(xlabel="way gone m", ylabel="error m", ylim=(0, None), xlim=(0, None))
    axes[0].legend(fontsize=8, ncols=3)
    return Plot("Error against distance", _svg(figure), _error_caption(result, "metre"))


def _error_caption(result: Result, unit: str) -> str:
    if len(result.compared) <= _FEW:
        return "Horizontal error of the fused position of each soldier."
    return (
        f"Horizontal error of the fused positions: median and 95th percentile of all soldiers by the {unit}."
    )


def _draw_errors(axis: "Axes", curves: list[tuple[FloatArray, FloatArray]], names: list[str]) -> None:
    if len(curves) <= _FEW:
        step = _every(len(curves), max(curve[0].size for curve in curves))
        for (along, error), name in zip(curves, names, strict=True):
            axis.plot(along[::step], error[::step], linewidth=1.0, label=name)
        return
    middle, high = _binned(*(np.concatenate(columns) for columns in zip(*curves, strict=True)))
    axis.fill_between(middle[0], 0.0, high[1], color=_FUSED, alpha=0.15, linewidth=0, label="95 % below")
    axis.plot(*middle, color=_FUSED, linewidth=1.6, label="fused, median")


def _binned(
    along: FloatArray, values: FloatArray
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Median and 95th percentile of values in equal bins along an axis, as (middles, figure) each."""
    edges = np.linspace(along.min(), along.max() + 1e-9, _BINS + 1)
    bins = np.digitize(along, edges) - 1
    used = [index for index in range(_BINS) if (bins == index).any()]
    middles = 0.5 * (edges[:-1] + edges[1:])[used]
    median = np.array([np.median(values[bins == index]) for index in used])
    high = np.array([np.percentile(values[bins == index], 95) for index in used])
    return (middles, median), (middles, high)


def _distributions(result: Result) -> Plot:
    played = result.played
    stepped = [
        found[1]
        for soldier in played.exercise.soldiers
        for steps in played.heard[soldier.id].steps.values()
        if (found := errors_m(steps, soldier.truth, played.start_ns)) is not None
    ]
    fused = [_lengths(each.errors_m) for each in result.compared.values()]
    picture = result.pictures[played.exercise.command_post]
    figure, axes = _figure(2)
    for errors, colour, label in (
        (stepped, _STEPS, "foot steps alone (fitted)"),
        (fused, _FUSED, "fused"),
        ([picture.against_truth_m], _PICTURE, "picture at the command post"),
    ):
        _draw_cdf(axes[0], np.concatenate(errors or [np.empty(0)]), colour, label)
    _draw_cdf(axes[1], picture.age_s, _PICTURE, "age of what the command post knows")
    axes[0].set(xlabel="error m", ylabel="share of the time %", ylim=(0, 100), xlim=(0, None))
    axes[1].set(xlabel="age s", ylabel="share of the time %", ylim=(0, 100), xlim=(0, None))
    for axis in axes:
        axis.legend(fontsize=8, loc="lower right")
    return Plot(
        "How often how wrong",
        _svg(figure),
        "Distributions over all soldiers and times, hop by hop; dashes at 95 %.",
    )


def _draw_cdf(axis: "Axes", values: FloatArray, colour: str, label: str) -> None:
    if not values.size:
        return
    shares = np.linspace(0.0, 100.0, 401)
    axis.plot(np.percentile(values, shares), shares, color=colour, linewidth=1.6, label=label)
    axis.axhline(95.0, color="#57606a", linewidth=0.6, linestyle="--")


# -- radio --------------------------------------------------------------------------------------------------------


def _radio(result: Result) -> Plot | None:
    """Traffic over time, and each net's use of its rate; of many nets the busiest."""
    nets = result.played.exercise.nets
    if not nets:
        return None
    used = {str(row["net"]): float(row["bits_per_s"]) for row in result.figures["nets"]}
    busiest = sorted(nets, key=lambda net: -used[net.profile.name] / net.profile.rate_bits_per_s)[:_FEW]
    figure, axes = _figure(2)
    for net in busiest:
        seconds, bits = _traffic(result, net.profile.name, net.members)
        axes[0].plot(seconds, bits, linewidth=1.1, label=net.profile.name)
        for begin_s, end_s in net.outages_s:
            axes[0].axvspan(begin_s, end_s, color="#cf222e", alpha=0.1, linewidth=0)
    axes[0].set(xlabel="time s", ylabel="bit/s on the air", ylim=(0, None))
    axes[0].legend(fontsize=8, ncols=2)
    _draw_use(axes[1], [(net.profile.name, net.profile.rate_bits_per_s) for net in busiest], used)
    more = f" The busiest {_FEW} of {len(nets)} nets." if len(nets) > _FEW else ""
    caption = f"Bits on the air with the links' headers, averaged over {_WINDOW_S:g} s; outages in red."
    return Plot("Radio use", _svg(figure), caption + more)


def _draw_use(axis: "Axes", rates: Sequence[tuple[str, float]], used: Mapping[str, float]) -> None:
    names = [name for name, _ in rates]
    axis.barh(names, [rate for _, rate in rates], color="#eaeef2", label="the net's rate")
    axis.barh(names, [used[name] for name in names], color=_FUSED, height=0.5, label="used, average")
    axis.invert_yaxis()
    axis.set(xlabel="bit/s")
    axis.legend(fontsize=8)


def _traffic(result: Result, net: str, members: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Seconds (n,) and bits per second (n,) of all members on a net over the window before."""
    played = result.played
    seconds = np.arange(0.0, played.duration_s, 2.0)
    bits = np.zeros_like(seconds)
    for member in members:
        sent = np.array(played.heard[member].sent.get(net, []), dtype=np.int64).reshape(-1, 2)
        if len(sent):
            at_s = (sent[:, 0] - played.start_ns) / NS_PER_S
            total = 8.0 * (
                np.interp(seconds, at_s, sent[:, 1]) - np.interp(seconds - _WINDOW_S, at_s, sent[:, 1])
            )
            bits += total / _WINDOW_S
    return seconds, bits
