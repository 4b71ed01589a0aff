"""`bootprint router`: an embedded zenoh router, for a computer without zenohd."""

import sys
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(router)


def router(
    listen: Annotated[str, typer.Option(help="Where to listen.")] = "tcp/127.0.0.1:7447",
    stop_on_eof: Annotated[bool, typer.Option(help="Stop when standard input closes.")] = False,
) -> None:
    """Run this computer's message router until stopped.

    Every computer runs one router, and all its services are clients of it. In deployment `zenohd` or the
    image `eclipse/zenoh` does the same.
    """
    from bootprint.stopping import Stop
    from bootprint.zenoh_bus import EmbeddedRouter

    with Stop() as stop:
        if stop_on_eof:
            stop.watch_input()
        embedded = EmbeddedRouter(listen)
        sys.stderr.write(f"router at {listen}; Ctrl-C stops it\n")
        while not stop.wait(1.0):
            pass
        embedded.close()
