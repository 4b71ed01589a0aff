"""Options that several commands share, and what they mean."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from bootprint.config import ComputerFile, load_computer
from bootprint.errors import ConfigError
from bootprint.keys.credentials import Credentials
from bootprint.zenoh_bus import ZenohBus, open_bus

DEFAULT_ROUTER: str = next(
    field.default for field in msgspec.structs.fields(ComputerFile) if field.name == "router"
)

Config = Annotated[
    Path | None, typer.Option("--config", help="The computer.toml that knows router, realm and certificate.")
]
Router = Annotated[
    str | None,
    typer.Option(
        "--router", help="Router to connect to; the configuration's by default.", metavar="ENDPOINT"
    ),
]
Duration = Annotated[
    float | None, typer.Option("--duration", help="Stop after this many seconds.", metavar="S", min=0.0)
]
Json = Annotated[
    str | None, typer.Option("--json", help="Write rows as JSON to FILE, or - for standard output.")
]


@dataclass(frozen=True)
class BusWay:
    """How a command gets onto the bus: at which router, and what it shows there."""

    router: str
    credentials: Credentials | None = None

    def open(self, *, lossless: bool = False, should_stop: Callable[[], bool] | None = None) -> ZenohBus:
        """Connect; BusError if no router answers."""
        return open_bus(self.router, credentials=self.credentials, lossless=lossless, should_stop=should_stop)


def bus_way(config: Path | None, router: str | None) -> BusWay:
    """The way that ``--config`` and ``--router`` tell, the latter before the former."""
    if config is None:
        return BusWay(router or DEFAULT_ROUTER)
    computer = load_computer(config)
    return BusWay(router or computer.router, computer.credentials)


def parse_speed(speed: str) -> float:
    """``--speed`` as a factor of event time over host time, infinite for ``max``."""
    try:
        factor = math.inf if speed == "max" else float(speed)
    except ValueError:
        factor = math.nan
    if not factor > 0 or (factor == math.inf and speed != "max"):
        raise ConfigError(f"--speed {speed!r} must be a positive number or 'max'")
    return factor


def write_text(text: str, output: Path | None) -> None:
    """Write a text to the file of ``--output``, or to standard output without one."""
    if output is None:
        typer.echo(text, nl=False)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"--output {output}: cannot be written: {error.strerror}") from error


def write_json(value: object, target: str) -> None:
    """Write a value as JSON to a file, or to standard output if ``target`` is ``-``."""
    text = msgspec.json.format(msgspec.json.encode(value), indent=2).decode()
    if target == "-":
        typer.echo(text)
        return
    try:
        Path(target).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"--json {target}: cannot be written: {error.strerror}") from error
