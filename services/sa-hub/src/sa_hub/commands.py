"""What this room adds to the `bootprint` command: `bootprint keys`, `radio profiles`, `history`, `page`."""

import time
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from bootprint.cli import group
from bootprint.commands.keys import KEYS_HELP
from bootprint.commands.options import Json, write_json
from sa_hub.history import commands as history_commands
from sa_hub.page import commands as page_commands

KeyFile = Annotated[Path, typer.Argument(help="The group key's file, e.g. keys/group.key.")]
RADIO_HELP = "Radios: what they cost a sender, and how formats do on them."


def register(app: typer.Typer) -> None:
    """Add the commands."""
    keys = group(app, "keys", KEYS_HELP)
    keys.command("new")(new)
    keys.command("roll")(roll)
    keys.command("finish")(finish)
    history_commands.register(app)
    page_commands.register(app)
    group(app, "radio", RADIO_HELP).command("profiles")(profiles)


def new(path: Annotated[Path, typer.Argument(help="File to write, e.g. keys/group.key.")]) -> None:
    """Make a new group key; copy the file to every computer of the realm, over a way you trust."""
    from sa_hub.keys import create_group_key

    create_group_key(path)
    typer.echo(f"new group key in {path}; put the same file on every computer of the realm")


def roll(
    path: KeyFile,
    at: Annotated[
        datetime,
        typer.Option(formats=["%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S"], help="When senders change over, UTC."),
    ],
    lost: Annotated[
        bool, typer.Option("--lost", help="A computer was lost: the old key is refused from then on.")
    ] = False,
) -> None:
    """Make the key that follows this one; both are accepted until a day after the change, unless one was lost."""
    from sa_hub.keys import create_next_key

    following = create_next_key(path, at, is_lost=lost)
    typer.echo(
        f"next group key in {following}; put it beside the old one everywhere and restart the hubs before {at}Z"
    )


def finish(path: KeyFile) -> None:
    """Put the next key in the old one's place, when that is accepted no more."""
    from sa_hub.keys import finish_roll

    finish_roll(path, time.time())
    typer.echo(f"{path} is the new key now")


def profiles(json: Json = None) -> None:
    """List the named radios: rate, overhead and what a frame of 20 bytes costs on each."""
    from sa_hub.radio.profiles.table import print_profiles, rows

    if json is None:
        print_profiles()
    else:
        write_json(rows(), json)
