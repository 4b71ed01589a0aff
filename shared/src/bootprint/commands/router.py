"""`bootprint router`: an embedded zenoh router, for a computer without zenohd."""

import signal
import sys
import threading
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
    from bootprint.zenoh_bus import EmbeddedRouter

    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    embedded = EmbeddedRouter(listen)
    try:
        sys.stderr.write(f"router at {listen}; Ctrl-C stops it\n")
        if stop_on_eof:
            threading.Thread(target=_wait_eof, args=(stop,), daemon=True).start()
        stop.wait()
    finally:
        embedded.close()


def _wait_eof(stop: threading.Event) -> None:
    while sys.stdin.buffer.read(1024):
        pass
    stop.set()
