"""What all plots of a report are made with: figures, colours, SVG text."""

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRUTH, REPORTS, STEPS, FUSED, PICTURE = "#c9d1d9", "#e36209", "#a475f9", "#0b6bcb", "#24292f"
FEW = 12
"""So many soldiers have a line each; of more a plot shows units, or medians."""
_MOST_POINTS = 40_000  # in one plot, so that the page stays small


@dataclass(frozen=True)
class Plot:
    """A picture with its title and what to see in it."""

    title: str
    svg: str
    caption: str


def new_figure(
    columns: int = 1, rows: int = 1, width: float = 10.0, height: float = 3.8
) -> "tuple[Figure, Sequence[Axes]]":
    """A figure (inches) with axes side by side, row by row."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update({"svg.hashsalt": "bootprint", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).ravel())
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def svg_of(figure: "Figure") -> str:
    """The figure as an SVG element; the same figure gives the same text."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    return svg[svg.index("<svg") :]


def every(lines: int, points: int) -> int:
    """Every which point to draw."""
    return max(1, lines * points // _MOST_POINTS)


def colours_of(names: Iterable[str]) -> dict[str, str]:
    """A colour for each name, the same in all plots of a report; from the eleventh on paler ones."""
    from matplotlib import color_sequences
    from matplotlib.colors import to_hex

    paired = color_sequences["tab20"]  # strong and pale by turns
    palette = [to_hex(colour) for colour in (*paired[::2], *paired[1::2])]
    distinct = dict.fromkeys(names)
    return {name: palette[number % len(palette)] for number, name in enumerate(distinct)}
