"""The report's plots as inline SVG: map, error over time and distance, distributions, radio use."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bootprint.clock import NS_PER_S
from proving_ground.exercises.exercise import FloatArray
from proving_ground.exercises.reporting.map_plot import draw_map
from proving_ground.exercises.reporting.plotting import (
    FEW,
    FUSED,
    PICTURE,
    STEPS,
    Plot,
    colours_of,
    every,
    new_figure,
    svg_of,
)
from proving_ground.exercises.scoring.dead_reckoning import errors_m
from proving_ground.exercises.scoring.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BINS = 60
_WINDOW_S = 10.0


def plots_of(result: Result) -> list[Plot]:
    """All plots that the result has data for."""
    if not result.compared:
        return []
    makers = (draw_map, _over_time, _over_distance, _distributions, _radio)
    return [plot for plot in (maker(result) for maker in makers) if plot is not None]


# -- errors -------------------------------------------------------------------------------------------------------


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _over_time(result: Result) -> Plot:
    curves = [(each.time_s, _lengths(each.errors_m)) for each in result.compared.values()]
    figure, axes = new_figure()
    _draw_errors(axes[0], curves, list(result.compared))
    picture = result.pictures[result.played.exercise.command_post]
    if picture.time_s.size:
        middle, _ = _binned(picture.time_s, picture.against_truth_m)
        label = "picture at the command post, median"
        axes[0].plot(*middle, color=PICTURE, linewidth=1.4, linestyle="--", label=label)
    axes[0].set(xlabel="time (s)", ylabel="error (m)", ylim=(0, None))
    _add_legend(figure)
    return Plot("Error over time", svg_of(figure), _error_caption(result, "second"))


def _over_distance(result: Result) -> Plot:
    curves = [(each.walked_m, _lengths(each.errors_m)) for each in result.compared.values()]
    figure, axes = new_figure()
    _draw_errors(axes[0], curves, list(result.compared))
    axes[0].set(xlabel="way gone (m)", ylabel="error (m)", ylim=(0, None), xlim=(0, None))
    _add_legend(figure)
    return Plot("Error against distance", svg_of(figure), _error_caption(result, "metre"))


def _add_legend(figure: "Figure") -> None:
    """Below the axes, where it hides nothing."""
    figure.legend(fontsize=8, loc="outside lower center", ncols=9, frameon=False)


def _error_caption(result: Result, unit: str) -> str:
    if len(result.compared) <= FEW:
        return "Horizontal error of the fused position of each soldier."
    return (
        f"Horizontal error of the fused positions: median and 95th percentile of all soldiers by the {unit}."
    )


def _draw_errors(axis: "Axes", curves: list[tuple[FloatArray, FloatArray]], names: list[str]) -> None:
    if len(curves) <= FEW:
        step = every(len(curves), max(curve[0].size for curve in curves))
        colours = colours_of(names)
        for (along, error), name in zip(curves, names, strict=True):
            axis.plot(along[::step], error[::step], linewidth=1.0, label=name, color=colours[name])
        return
    middle, high = _binned(*(np.concatenate(columns) for columns in zip(*curves, strict=True)))
    axis.fill_between(middle[0], 0.0, high[1], color=FUSED, alpha=0.15, linewidth=0, label="95 % below")
    axis.plot(*middle, color=FUSED, linewidth=1.6, label="fused, median")


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
    figure, axes = new_figure(2)
    most_m = 0.0
    for errors, colour, label in (
        (stepped, STEPS, "foot steps alone (fitted)"),
        (fused, FUSED, "fused"),
        ([picture.against_truth_m], PICTURE, "picture at the command post"),
    ):
        values = np.concatenate(errors or [np.empty(0)])
        most_m = max(most_m, float(np.percentile(values, 99))) if values.size else most_m
        _draw_cdf(axes[0], values, colour, label)
    _draw_cdf(axes[1], picture.age_s, PICTURE, "age of what the command post knows")
    axes[0].set(
        xlabel="error (m)", ylabel="share of the time (%)", ylim=(0, 100), xlim=(0, 1.2 * most_m or None)
    )
    axes[1].set(xlabel="age (s)", ylabel="share of the time (%)", ylim=(0, 100), xlim=(0, None))
    for axis in axes:
        axis.legend(fontsize=8, loc="lower right")
    return Plot(
        "How often how wrong",
        svg_of(figure),
        "Distributions over all soldiers and times, hop by hop, without the worst hundredth; dashes at 95 %.",
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
    busiest = sorted(nets, key=lambda net: -used[net.profile.name] / net.profile.rate_bits_per_s)[:FEW]
    figure, axes = new_figure(2)
    for net in busiest:
        seconds, bits = _traffic(result, net.profile.name, net.members)
        axes[0].plot(seconds, bits, linewidth=1.1, label=net.profile.name)
        for begin_s, end_s in net.outages_s:
            axes[0].axvspan(begin_s, end_s, color="#cf222e", alpha=0.1, linewidth=0)
    axes[0].set(xlabel="time (s)", ylabel="on the air (bit/s)", ylim=(0, None))
    axes[0].legend(fontsize=8, ncols=2)
    _draw_use(axes[1], [(net.profile.name, net.profile.rate_bits_per_s) for net in busiest], used)
    more = f" The busiest {FEW} of {len(nets)} nets." if len(nets) > FEW else ""
    caption = f"Bits on the air with the links' headers, averaged over {_WINDOW_S:g} s; outages in red."
    return Plot("Radio use", svg_of(figure), caption + more)


def _draw_use(axis: "Axes", rates: Sequence[tuple[str, float]], used: Mapping[str, float]) -> None:
    names = [name for name, _ in rates]
    axis.barh(names, [rate for _, rate in rates], color="#eaeef2", label="the net's rate")
    axis.barh(names, [used[name] for name in names], color=FUSED, height=0.5, label="used, average")
    axis.set_ylim(max(len(names), 3) - 0.5, -0.5)  # from the top down, and bars of a net or two not too thick
    axis.set(xlabel="rate (bit/s)")
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
