"""What this room adds to the `bootprint` command: `bootprint keys`."""

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the commands."""
    keys = typer.Typer(help="The group key that the radio's frames are sealed with.", no_args_is_help=True)
    keys.command("new")(new)
    app.add_typer(keys, name="keys")


def new(path: Annotated[Path, typer.Argument(help="File to write, e.g. keys/group.key.")]) -> None:
    """Make a new group key; copy the file to every computer of the realm, over a way you trust."""
    from sa_hub.keys import create_group_key

    create_group_key(path)
    typer.echo(f"new group key in {path}; put the same file on every computer of the realm")
