"""The `bootprint` command: gathers what the rooms offer under one name.

A room adds commands through the entry-point group ``bootprint.commands``; each entry is a function
``register(app)``. Modules named there import heavy things inside their functions, so that help stays quick.
"""

import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Final

import typer

from bootprint import logs
from bootprint.errors import BootprintError
from bootprint.service import EXIT_BAD_INPUT

GROUP = "bootprint.commands"
_ALONE: Final = frozenset({"bus", "doctor", "fix", "router", "topics", "up", "watch"})
"""Entries that are one command by their own name, to which no other entry adds anything."""


def build_app(words: Sequence[str] = ()) -> typer.Typer:
    """The top-level application with the commands of every installed room.

    ``words``: what was typed; if the first is a command that stands for itself, nothing else is loaded: a router
    that is started again need not wait for the proving ground.
    """
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

    for entry in sorted(_entries(words), key=lambda entry: entry.name):
        entry.load()(app)
    return app


def _entries(words: Sequence[str]) -> Iterable[EntryPoint]:
    if words and words[0] in _ALONE:
        return entry_points(group=GROUP, name=words[0])
    return entry_points(group=GROUP)


def group(app: typer.Typer, name: str, summary: str) -> typer.Typer:
    """The group of commands of that name; made, with its help, by the first room that asks for it."""
    for registered in app.registered_groups:
        if registered.name == name and registered.typer_instance is not None:
            return registered.typer_instance
    made = typer.Typer(help=summary, no_args_is_help=True)
    app.add_typer(made, name=name)
    return made


def preload() -> None:
    """What `bootprint router` needs beyond this module; of all commands it alone is kept running by another."""
    import bootprint.keys.gatekeeper  # noqa: F401

    typer.main.get_command(build_app(["router"])).make_context("bootprint", ["router"])


def main() -> None:
    """The console script: one line and exit 2 on anything a person can mend."""
    try:
        build_app(sys.argv[1:])()
    except BootprintError as error:
        sys.stderr.write(f"bootprint: {error}\n")
        sys.exit(EXIT_BAD_INPUT)
