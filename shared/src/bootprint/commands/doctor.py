"""`bootprint doctor`: what is wrong with this computer, and what mends it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.commands.options import Json

if TYPE_CHECKING:
    from bootprint.findings import Finding

_SIGNS = {"ok": "[green]✓[/]", "warning": "[yellow]![/]", "fault": "[red]✗[/]"}


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(doctor)


def doctor(
    config: Annotated[Path, typer.Argument(help="This computer's configuration.")] = Path("computer.toml"),
    json: Json = None,
) -> None:
    """Look this computer over: configuration, folders, clock, devices, keys, router, services.

    Every finding that is not well comes with its mend. Exit code 1 if something will not work (✗); what only does
    not run yet, or could be better, is a warning (!).
    """
    from bootprint.doctor import examine

    tell(list(examine(config)), json)


def tell(findings: "list[Finding]", json: str | None) -> None:
    """Print findings, or write them as JSON; the command then ends, with 1 if one is a fault."""
    from dataclasses import asdict

    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from bootprint.commands.options import write_json

    if json is not None:
        write_json([asdict(finding) for finding in findings], json)
    else:
        table = Table(box=None, show_header=False, padding=(0, 1))
        for finding in findings:
            what = finding.what + (f"\n→ {finding.mend}" if finding.mend else "")
            table.add_row(_SIGNS[finding.level], finding.subject, escape(what))
        Console(highlight=False, markup=True).print(table)
    raise typer.Exit(any(finding.level == "fault" for finding in findings))
