"""`bootprint fix`: a person says where a soldier is, for example at a doorway on the map."""

import math
import time
from pathlib import Path
from typing import Annotated

import typer

from bootprint.bus import Envelope
from bootprint.commands.options import DEFAULT_ROUTER
from bootprint.config import load_computer
from bootprint.errors import BusError, ConfigError
from bootprint.messages import Fix
from bootprint.topics import Address, Identity
from bootprint.zenoh_bus import ZenohBus, open_bus

_SOURCE = "person"
_LISTENERS = ("fusion", "sa-hub")
_NS_PER_S = 1_000_000_000
# Until the router has told a new session who listens, a message would go to nobody.
_SETTLE_S = 0.5


def register(app: typer.Typer) -> None:
    """Add the command; a latitude such as -33.9 must not be taken for an option."""
    app.command(context_settings={"ignore_unknown_options": True})(fix)


def fix(
    latitude: Annotated[float, typer.Argument(help="Latitude, degrees north.", metavar="LAT")],
    longitude: Annotated[float, typer.Argument(help="Longitude, degrees east.", metavar="LON")],
    soldier: Annotated[str | None, typer.Option(help="Whose place it is; with --config its own.")] = None,
    azimuth: Annotated[
        float | None, typer.Option(help="Which way they face, degrees clockwise from true north.")
    ] = None,
    azimuth_sigma: Annotated[float, typer.Option(help="How well that is known, degrees.")] = 10.0,
    height: Annotated[float | None, typer.Option(help="Height above the ellipsoid, metres.")] = None,
    accuracy: Annotated[float, typer.Option(help="How well the place is known, metres (1 sigma).")] = 1.0,
    at: Annotated[float | None, typer.Option(help="When it was so, UTC seconds; now by default.")] = None,
    config: Annotated[Path | None, typer.Option(help="The computer.toml that knows realm and unit.")] = None,
    realm: Annotated[str | None, typer.Option(help="Realm id, without --config.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit, without --config.")] = None,
    router: Annotated[
        str | None,
        typer.Option(help="Router to connect to; the configuration's by default.", metavar="ENDPOINT"),
    ] = None,
) -> None:
    """Tell the services where a soldier is, and perhaps which way they face.

    Example: bootprint fix --config computer.toml 47.05012 8.30932 --azimuth 90
    """
    identity, known_router = _whose(config, realm, unit, soldier)
    if azimuth is not None and not -360.0 <= azimuth <= 360.0:
        raise ConfigError(f"--azimuth {azimuth:g} must be degrees clockwise from true north, 0 to 360")
    try:
        message = Fix(
            time_ns=time.time_ns() if at is None else round(at * _NS_PER_S),
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            accuracy_m=accuracy,
            azimuth_rad=None if azimuth is None else math.radians(azimuth % 360.0),
            azimuth_sigma_rad=None if azimuth is None else math.radians(azimuth_sigma),
        )
    except (ValueError, OverflowError) as error:
        raise ConfigError(f"not a place: {error}") from error
    _publish(Envelope(identity.address("fix", _SOURCE), message), router or known_router)
    typer.echo(f"{identity.soldier} is at {latitude} {longitude}")


def _whose(
    config: Path | None, realm: str | None, unit: str | None, soldier: str | None
) -> tuple[Identity, str]:
    """The soldier's identity, and the router if a configuration names it."""
    try:
        if config is not None:
            computer = load_computer(config)
            member = computer.realm.member(soldier) if soldier else computer.member
            return Identity(computer.realm.id, member.unit, member.id), computer.router
        if realm and unit and soldier:
            return Identity(realm, unit, soldier), DEFAULT_ROUTER
    except ValueError as error:
        raise ConfigError(str(error)) from error
    raise ConfigError("whose place is it? Give --config computer.toml, or --realm, --unit and --soldier")


def _check_somebody_listens(bus: ZenohBus, address: Address, router: str) -> None:
    """BusError unless the soldier's fusion runs, or a hub that holds places itself (a command post's)."""
    if not any(bus.alive(address.with_subject("health", service).key) for service in _LISTENERS):
        raise BusError(
            f"neither {' nor '.join(_LISTENERS)} of {address.soldier} runs at {router}: nobody to tell"
        )


def _publish(envelope: Envelope, router: str) -> None:
    bus = open_bus(router)
    try:
        _check_somebody_listens(bus, envelope.address, router)
        time.sleep(_SETTLE_S)
        bus.publish(envelope)
    finally:
        bus.close()
