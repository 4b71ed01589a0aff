"""`bootprint fix`: a person says where a soldier is, for example at a doorway on the map."""

import math
from typing import Annotated

import typer

from bootprint.bus import Envelope
from bootprint.commands.options import Config, Router
from bootprint.commands.person import (
    SOURCE,
    At,
    RealmId,
    Soldier,
    Unit,
    made,
    publish,
    said_ns,
    whose,
)
from bootprint.errors import ConfigError
from bootprint.messages import Fix

# The soldier's fusion, or a hub that holds places itself (a command post's).
_LISTENERS = ("fusion", "sa-hub")


def register(app: typer.Typer) -> None:
    """Add the command; a latitude such as -33.9 must not be taken for an option."""
    app.command(context_settings={"ignore_unknown_options": True})(fix)


def fix(
    latitude: Annotated[float, typer.Argument(help="Latitude, degrees north.", metavar="LAT")],
    longitude: Annotated[float, typer.Argument(help="Longitude, degrees east.", metavar="LON")],
    soldier: Soldier = None,
    azimuth: Annotated[
        float | None, typer.Option(help="Which way they face, degrees clockwise from true north.")
    ] = None,
    azimuth_sigma: Annotated[float, typer.Option(help="How well that is known, degrees.")] = 10.0,
    height: Annotated[float | None, typer.Option(help="Height above the ellipsoid, metres.")] = None,
    accuracy: Annotated[float, typer.Option(help="How well the place is known, metres (1 sigma).")] = 1.0,
    at: At = None,
    config: Config = None,
    realm: RealmId = None,
    unit: Unit = None,
    router: Router = None,
) -> None:
    """Tell the services where a soldier is, and perhaps which way they face.

    Example: bootprint fix --config computer.toml 47.05012 8.30932 --azimuth 90
    """
    identity, way = whose(config, realm, unit, soldier, router)
    if azimuth is not None and not -360.0 <= azimuth <= 360.0:
        raise ConfigError(f"--azimuth {azimuth:g} must be degrees clockwise from true north, 0 to 360")
    message = made(
        lambda: Fix(
            time_ns=said_ns(at),
            latitude_deg=latitude,
            longitude_deg=longitude,
            height_m=height,
            accuracy_m=accuracy,
            azimuth_rad=None if azimuth is None else math.radians(azimuth % 360.0),
            azimuth_sigma_rad=None if azimuth is None else math.radians(azimuth_sigma),
        ),
        "a place",
    )
    publish(Envelope(identity.address("fix", SOURCE), message), way, _LISTENERS)
    typer.echo(f"{identity.soldier} is at {latitude} {longitude}")
