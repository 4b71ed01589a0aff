"""The `bootprint` command: gathers what the rooms offer under one name.

A room adds commands through the entry-point group ``bootprint.commands``; each entry is a function
``register(app)``. Modules named there import heavy things inside their functions, so that help stays quick.
"""

import sys
from importlib.metadata import entry_points
from typing import Annotated

import typer

from bootprint import logs
from bootprint.errors import BootprintError
from bootprint.service import EXIT_BAD_INPUT

GROUP = "bootprint.commands"


def build_app() -> typer.Typer:
    """The top-level application with the commands of every installed room."""
    app = typer.Typer(
        name="bootprint",
        help="Where is everyone, indoors, without GPS, over a radio that carries almost nothing?",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )

    @app.callback()
    def common(
        log_level: Annotated[str, typer.Option(help="debug, info, warning or error.")] = "warning",
    ) -> None:
        logs.configure(log_level)

    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        entry.load()(app)
    return app


def group(app: typer.Typer, name: str, summary: str) -> typer.Typer:
    """The group of commands of that name; made, with its help, by the first room that asks for it."""
    for registered in app.registered_groups:
        if registered.name == name and registered.typer_instance is not None:
            return registered.typer_instance
    made = typer.Typer(help=summary, no_args_is_help=True)
    app.add_typer(made, name=name)
    return made


def main() -> None:
    """The console script: one line and exit 2 on anything a person can mend."""
    try:
        build_app()()
    except BootprintError as error:
        sys.stderr.write(f"bootprint: {error}\n")
        sys.exit(EXIT_BAD_INPUT)
