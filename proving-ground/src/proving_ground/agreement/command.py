"""`bootprint agreement`: how simulated people and their sensors compare with the recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.commands.options import write_json
from bootprint.errors import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from proving_ground.agreement.comparison import Finding

_STDOUT = "-"
_SEEDS = 3
_NO_LIMIT = 10_000  # columns of a file or pipe


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(agreement)


def agreement(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="The folder of recorded data sets.")],
    seeds: Annotated[int, typer.Option(min=1, help="Simulated twins of every recorded walk.")] = _SEEDS,
    check: Annotated[bool, typer.Option("--check", help="End with 1 if a figure does not agree.")] = False,
    json_file: Annotated[
        str | None, typer.Option("--json", metavar="FILE", help="Write the rows as JSON (- for stdout).")
    ] = None,
) -> None:
    """Compare simulated walks with recorded ones: signals, strides, and errors of the foot INS.

    Every recorded walk is matched by simulated people on the same way at the same pace. A figure agrees when
    simulated over recorded lies between 1/bound and bound.
    """
    from rich.console import Console

    from proving_ground.agreement.report import findings, rows_of

    if not data.is_dir():
        raise ConfigError(f"{data}: is no folder; DATA must be the folder of recorded data sets")
    found = findings(data, seeds)
    if not found:
        raise ConfigError(f"{data}: holds none of the sets that simulated walks are compared with")
    if json_file is not None:
        write_json(rows_of(found), json_file)
    if json_file != _STDOUT:
        show(found, Console())
    if check and not all(finding.agrees for finding in found):
        raise typer.Exit(1)


def show(found: Sequence["Finding"], console: "Console") -> None:
    """The table of findings, and how many agree."""
    from rich.table import Table

    if not console.is_terminal:
        console.width = _NO_LIMIT
    table = Table(box=None, header_style="bold", row_styles=["", "dim"], pad_edge=False)
    for heading in ("set", "kind", "figure"):
        table.add_column(heading, no_wrap=True)
    for heading in ("recorded", "simulated", "ratio", "held out", "bound", "agrees"):
        table.add_column(heading, justify="right", no_wrap=True)
    for one in found:
        table.add_row(
            one.dataset,
            one.kind,
            one.figure,
            f"{one.recorded:.3g}",
            f"{one.simulated:.3g}",
            f"{one.ratio:.2f}",
            "–" if one.held_out_ratio is None else f"{one.held_out_ratio:.2f}",
            f"{one.bound:g}",
            "yes" if one.agrees else "[bold red]no[/]",
        )
    console.print(table)
    console.print(f"{sum(one.agrees for one in found)} of {len(found)} figures agree", highlight=False)
