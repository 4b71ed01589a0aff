"""Real hub processes for tests: a soldier's and a command post's, each at a router of its own, and who feeds them.

Routers stand on sockets in the file system, so that a hub in a network namespace of its own reaches them.
"""

import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from bootprint.bus import Envelope
from bootprint.messages import Health, LinkReport, Message, Position, Track
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus
from sa_hub.keys import create_group_key
from support.hub_squad import START_NS, S, Walk, position
from support.routers import running_router
from support.waiting import wait_until

A1, CP = Identity("bp", "alpha", "a1"), Identity("bp", "hq", "cp")
_ORIGIN = "{ latitude_deg = 59.35, longitude_deg = 18.07, height_m = 50.0 }"
_BOTH = (
    '{ id = "a1", number = 1, unit = "alpha", callsign = "Alpha 1" }',
    '{ id = "cp", number = 100, unit = "hq" }',
)


def write_realm(folder: Path, members: Sequence[str] = _BOTH) -> None:
    """Realm file, with a roster of these inline tables, and group key."""
    roster = ",\n    ".join(members)
    (folder / "realm.toml").write_text(f'id = "bp"\norigin = {_ORIGIN}\nroster = [\n    {roster},\n]\n')
    create_group_key(folder / "keys" / "group.key")


def write_computer(folder: Path, soldier: str, hub: str, link: str) -> Path:
    """A computer's file: lines of [hub] and of its one link, ``net``."""
    path = folder / soldier / "computer.toml"
    path.parent.mkdir()
    path.write_text(
        f'realm = "../realm.toml"\nsoldier = "{soldier}"\nkeys_dir = "../keys"\n'
        f'[hub]\n{hub}\n[[hub.links]]\nname = "net"\n{link}\n'
    )
    return path


@dataclass
class Hub:
    """A running hub, and what it says on its bus."""

    identity: Identity
    bus: ZenohBus
    process: subprocess.Popen[bytes]
    tracks: list[Track] = field(default_factory=list)
    reports: list[LinkReport] = field(default_factory=list)
    health: list[Health] = field(default_factory=list)

    def listen(self) -> None:
        """Collect tracks, link reports and health."""
        for subject in ("track", "link", "health"):
            self.bus.subscribe(self.identity.selector(subject), lambda envelope: self._keep(envelope.message))

    def _keep(self, message: Message) -> None:
        match message:
            case Track():
                self.tracks.append(message)
            case LinkReport():
                self.reports.append(message)
            case Health():
                self.health.append(message)


def command(config: Path, *extra: str) -> list[str]:
    """How a hub is started by itself."""
    return [sys.executable, "-c", "from sa_hub.main import main; main()", "--config", str(config), *extra]


@contextmanager
def running(config: Path, identity: Identity, within: Sequence[str] = ()) -> Iterator[Hub]:
    """A hub's process, alive; ``within`` stands before its command (``ip netns exec …``)."""
    endpoint = f"unixsock-stream/{config.parent / 'router'}"
    with running_router(endpoint) as router:
        process = subprocess.Popen([*within, *command(config, "--router", router)], stderr=subprocess.DEVNULL)
        bus = open_bus(router)
        try:
            hub = Hub(identity, bus, process)
            hub.listen()
            wait_until(lambda: bus.alive(identity.selector("health")), what="the hub's liveliness token")
            yield hub
            process.terminate()
            assert process.wait(timeout=60) == 0
        finally:
            bus.close()
            process.kill()
            process.wait()


class Walker:
    """Tells a hub where its soldier is, five times a second, from `start` to `close`; darts about."""

    def __init__(self, hub: Hub, speed_m_s: float = 6.0) -> None:
        self._hub = hub
        self._walk = Walk(turn_deg=110.0, speed_m_s=speed_m_s)
        self._begin_ns = time.time_ns()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "Walker":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stop.wait(0.2):
            now_ns = time.time_ns()
            # Ten times as fast as it looks: legs of two seconds.
            message = position("a1", START_NS + 10 * (now_ns - self._begin_ns), self._walk).message
            assert isinstance(message, Position)
            told = msgspec.structs.replace(message, time_ns=now_ns)
            self._hub.bus.publish(Envelope(A1.address("position", "fusion"), told))


def newest_age_s(tracks: Sequence[Track]) -> float:
    """How old the newest report among others' tracks is now."""
    return min(((time.time_ns() - track.time_ns) / S for track in tracks), default=float("inf"))
