"""`bootprint watch`: a terminal view for the soldier, on a small screen or over ssh."""

import time

import typer

from bootprint.bus import Envelope
from bootprint.commands.options import Config, Router
from bootprint.commands.person import SOURCE, RealmId, Soldier, Unit, whose


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(watch)


def watch(
    soldier: Soldier = None,
    config: Config = None,
    realm: RealmId = None,
    unit: Unit = None,
    router: Router = None,
) -> None:
    """Show where you are, who is near and what must be known; send alert, status, observation and fix.

    Example: bootprint watch --config computer.toml
    """
    from bootprint.messages import Message
    from bootprint.topics import SUBJECT_OF
    from bootprint.watch.app import Watch
    from bootprint.watch.view import SUBJECTS, WatchView

    identity, way = whose(config, realm, unit, soldier, router)
    bus = way.open()
    try:
        inlets = [bus.open_inlet(identity.selector(subject)) for subject in SUBJECTS]

        def take() -> list[Envelope]:
            return [envelope for inlet in inlets for envelope in inlet.take()]

        def send(message: Message) -> None:
            bus.publish(Envelope(identity.address(SUBJECT_OF[type(message)], SOURCE), message))

        Watch(WatchView(identity.soldier), take, send, time.time_ns, identity.soldier).run()
    finally:
        bus.close()
