"""`bootprint up`: one computer's router and services, kept running without containers or a unit for each."""

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(up)


def up(
    config: Annotated[Path, typer.Argument(help="This computer's configuration.")] = Path("computer.toml"),
    only: Annotated[str, typer.Option(help="Run these services alone: a,b (default: all configured).")] = "",
    logs: Annotated[
        Path | None, typer.Option(help="Folder for a log file a process (default: all to standard error).")
    ] = None,
    log_level: Annotated[str, typer.Option(help="debug, info, warning or error.")] = "info",
    stop_on_eof: Annotated[bool, typer.Option(help="Stop when standard input closes.")] = False,
) -> None:
    """Run everything that this computer is configured for, and keep it running.

    A router if none answers at its address, and the services that have a section in the file: [gateway] sensors,
    boots and fusion, [hub] picture and radio. What ends is started again within seconds; what tells nothing of its
    health for 15 s is ended first. What cannot run as it is configured ends everything, with exit code 2.
    """
    from bootprint import logs as logging
    from bootprint.config import load_computer
    from bootprint.upkeep import chosen, keep_up

    logging.configure(log_level)
    computer = load_computer(config)
    keep_up(computer, chosen(computer, only), logs, log_level, stop_on_eof=stop_on_eof)
