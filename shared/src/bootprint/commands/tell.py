"""`bootprint alert`, `status` and `observation`: a person tells the squad something, by the soldier's hub."""

from collections.abc import Mapping
from typing import Annotated, get_args

import msgspec
import typer

from bootprint.bus import Envelope
from bootprint.commands.options import BusWay, Config, Router
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
from bootprint.messages import Alert, Message, Observation, ObservationCode, Status
from bootprint.topics import SUBJECT_OF, Identity

_LISTENERS = ("sa-hub",)
Text = Annotated[str, typer.Argument(help="Words to go with it, up to 200 characters.")]


def register(app: typer.Typer) -> None:
    """Add the commands; a latitude such as -33.9 must not be taken for an option."""
    app.command()(alert)
    app.command()(status)
    app.command(context_settings={"ignore_unknown_options": True})(observation)


def alert(
    kind: Annotated[str, typer.Argument(help="contact, casualty, help, fire, withdraw or other.")],
    text: Text = "",
    soldier: Soldier = None,
    at: At = None,
    config: Config = None,
    realm: RealmId = None,
    unit: Unit = None,
    router: Router = None,
) -> None:
    """Alert the squad; it goes before everything else on the radio.

    Example: bootprint alert --config computer.toml contact "two men, north"
    """
    identity, way = whose(config, realm, unit, soldier, router)
    fields = {"soldier": identity.soldier, "kind": kind, "text": text}
    _tell(identity, _message(Alert, fields, at), way)


def status(
    condition: Annotated[str, typer.Argument(help="ok, busy, wounded or out.")] = "ok",
    battery: Annotated[float | None, typer.Option(help="The battery's charge, percent.")] = None,
    soldier: Soldier = None,
    at: At = None,
    config: Config = None,
    realm: RealmId = None,
    unit: Unit = None,
    router: Router = None,
) -> None:
    """Tell the squad how a soldier is.

    Example: bootprint status --config computer.toml wounded --battery 40
    """
    identity, way = whose(config, realm, unit, soldier, router)
    fields = {"soldier": identity.soldier, "condition": condition, "battery_pct": battery}
    _tell(identity, _message(Status, fields, at), way)


def observation(
    latitude: Annotated[float, typer.Argument(help="Latitude, degrees north.", metavar="LAT")],
    longitude: Annotated[float, typer.Argument(help="Longitude, degrees east.", metavar="LON")],
    text: Text = "",
    code: Annotated[
        str | None, typer.Option(help=f"What it is: {', '.join(get_args(ObservationCode))}.")
    ] = None,
    accuracy: Annotated[float, typer.Option(help="How well the place is known, metres (1 sigma).")] = 10.0,
    soldier: Soldier = None,
    at: At = None,
    config: Config = None,
    realm: RealmId = None,
    unit: Unit = None,
    router: Router = None,
) -> None:
    """Tell the squad of something seen, and where.

    Example: bootprint observation --config computer.toml 47.05012 8.30932 "on the roof" --code sniper
    """
    identity, way = whose(config, realm, unit, soldier, router)
    fields = {
        "soldier": identity.soldier,
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "accuracy_m": accuracy,
        "text": text,
        "code": code,
    }
    _tell(identity, _message(Observation, fields, at), way)


def _message(type_: type[Message], fields: Mapping[str, object], at: float | None) -> Message:
    """Converted as from the wire: a word that is none of the known ones is refused with those that are named."""
    return made(
        lambda: msgspec.convert({"time_ns": said_ns(at), **fields}, type_),
        f"{'an' if SUBJECT_OF[type_][0] in 'ao' else 'a'} {SUBJECT_OF[type_]}",
    )


def _tell(identity: Identity, message: Message, way: BusWay) -> None:
    subject = SUBJECT_OF[type(message)]
    publish(Envelope(identity.address(subject, SOURCE), message), way, _LISTENERS)
    typer.echo(f"{subject} of {identity.soldier} is with the hub")
