"""What a person tells the services, for a soldier: whose it is, and how it gets onto the bus."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from bootprint.bus import Envelope
from bootprint.commands.options import BusWay, bus_way
from bootprint.config import load_computer
from bootprint.errors import BusError, ConfigError
from bootprint.topics import Address, Identity
from bootprint.zenoh_bus import ZenohBus

T = TypeVar("T")
SOURCE = "person"
_NS_PER_S = 1_000_000_000
# Until the router has told a new session who listens, a message would go to nobody.
_SETTLE_S = 0.5

Soldier = Annotated[str | None, typer.Option("--soldier", help="Whose it is; with --config its own.")]
At = Annotated[float | None, typer.Option("--at", help="When it was so, UTC seconds; now by default.")]
RealmId = Annotated[str | None, typer.Option("--realm", help="Realm id, without --config.")]
Unit = Annotated[str | None, typer.Option("--unit", help="Unit, without --config.")]


def whose(
    config: Path | None, realm: str | None, unit: str | None, soldier: str | None, router: str | None
) -> tuple[Identity, BusWay]:
    """The soldier's identity, and the way to their bus."""
    try:
        if config is not None:
            computer = load_computer(config)
            member = computer.realm.member(soldier) if soldier else computer.member
            return Identity(computer.realm.id, member.unit, member.id), bus_way(config, router)
        if realm and unit and soldier:
            return Identity(realm, unit, soldier), bus_way(None, router)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    raise ConfigError("whose is it? Give --config computer.toml, or --realm, --unit and --soldier")


def said_ns(at: float | None) -> int:
    """UTC ns of ``--at``, or now."""
    return time.time_ns() if at is None else round(at * _NS_PER_S)


def made(build: Callable[[], T], what: str) -> T:
    """A message of what a person typed; ConfigError if that cannot be one."""
    try:
        return build()
    except (ValueError, OverflowError) as error:
        raise ConfigError(f"not {what}: {error}") from error


def publish(envelope: Envelope, way: BusWay, listeners: Sequence[str]) -> None:
    """Send one message, if one of these services of the soldier is there to hear it; BusError if none is."""
    bus = way.open()
    try:
        _check_somebody_listens(bus, envelope.address, way.router, listeners)
        time.sleep(_SETTLE_S)
        bus.publish(envelope)
    finally:
        bus.close()


def _check_somebody_listens(bus: ZenohBus, address: Address, router: str, listeners: Sequence[str]) -> None:
    if not any(bus.alive(address.with_subject("health", service).key) for service in listeners):
        names = f"neither {' nor '.join(listeners)}" if len(listeners) > 1 else f"no {listeners[0]}"
        raise BusError(f"{names} of {address.soldier} runs at {router}: nobody to tell")
