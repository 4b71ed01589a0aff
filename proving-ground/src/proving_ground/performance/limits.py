"""Bounds that a benchmark's figures keep, how they are shown, and how a benchmark ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import typer

from bootprint.commands.options import write_json

if TYPE_CHECKING:
    from rich.table import Table


MISSED: Final = 1
"""Exit code of a benchmark with ``--check`` that misses a limit."""


@dataclass(frozen=True, slots=True)
class Limit:
    """A bound on one figure; ``at_least`` turns it round."""

    figure: str
    meaning: str
    bound: float
    unit: str
    at_least: bool = False

    @property
    def bounds(self) -> str:
        """The bound as people write it."""
        return f"{'≥' if self.at_least else '≤'} {self.bound:g} {self.unit}"

    def holds(self, figures: object) -> bool:
        """Whether the figure keeps the bound."""
        value: float = getattr(figures, self.figure)
        return value >= self.bound if self.at_least else value <= self.bound


def limits_table(figures: object, limits: Sequence[Limit], subject: str) -> "Table":
    """The figures, each beside its limit."""
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("figure", "limit", ""):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column(subject)
    for limit in limits:
        verdict = "[green]holds[/green]" if limit.holds(figures) else "[red]missed[/red]"
        value = f"{getattr(figures, limit.figure):.2f} {limit.unit}"
        table.add_row(value, limit.bounds, verdict, limit.meaning)
    return table


def conclude(
    figures: object, show: Callable[[], None], *, keeps_limits: bool, json: str | None, check: bool
) -> None:
    """Tell people and ``--json`` the figures; with ``--check`` exit `MISSED` if a limit is missed."""
    if json is not None:
        write_json(figures, json)
    if json != "-":
        show()
    if check and not keeps_limits:
        raise typer.Exit(MISSED)
