"""`bootprint router`: an embedded zenoh router, for a computer without zenohd."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bootprint.stopping import Stop


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(router)


def router(
    listen: Annotated[
        str | None, typer.Option(help="Where to listen; tcp/127.0.0.1:7447 by default.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="The computer.toml whose router this is; its certificates guard it.")
    ] = None,
    stop_on_eof: Annotated[bool, typer.Option(help="Stop when standard input closes.")] = False,
) -> None:
    """Run this computer's message router until stopped.

    Every computer runs one router, and all its services are clients of it. In deployment `zenohd` or the
    image `eclipse/zenoh` does the same. With a configuration that has `tls/` addresses it admits only computers of
    the realm, holds each to its own part of the bus, and reports whoever tries more (docs/security.md).
    """
    from bootprint import logs
    from bootprint.commands.options import DEFAULT_ROUTER
    from bootprint.config import load_computer
    from bootprint.keys.gatekeeper import run_guarded
    from bootprint.stopping import Stop

    logs.configure("info")
    computer = None if config is None else load_computer(config)
    with Stop() as stop:
        if stop_on_eof:
            stop.watch_input()
        if computer is not None and computer.is_guarded:
            run_guarded(computer, stop)
        else:
            _run_open(listen or (DEFAULT_ROUTER if computer is None else computer.router), stop)


def _run_open(listen: str, stop: "Stop") -> None:
    from bootprint.zenoh_bus import EmbeddedRouter

    embedded = EmbeddedRouter(listen)
    sys.stderr.write(f"router at {listen}; Ctrl-C stops it\n")
    while not stop.wait(1.0):
        pass
    embedded.close()
