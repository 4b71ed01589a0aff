"""NMEA out as a companion of the hub: datagrams, connections that others open, or a terminal of its own.

A reader that does not read loses sentences; it never holds up the others.
"""

import contextlib
import os
import socket
import tty
from pathlib import Path
from typing import Final, Protocol

from bootprint.bus import Envelope
from bootprint.errors import ConfigError
from bootprint.messages import Position
from sa_hub.outputs.nmea import sentences
from sa_hub.outputs.settings import Address, NmeaSettings, address_of

_MOST_CLIENTS: Final = 16


class Outlet(Protocol):
    """One way out."""

    def write(self, data: bytes) -> None:
        """Give these bytes to whoever listens; never waits."""

    def close(self) -> None:
        """Let go."""


class NmeaSink:
    """Tells the newest own position, once an interval, if there is a new one."""

    name = "nmea"
    most = 10_000
    keeps = False

    def __init__(self, settings: NmeaSettings, folder: Path, where: str) -> None:
        self.interval_s = settings.interval_s
        self._settings = settings
        self._outlets = [_outlet(each, folder, f"{where}.to") for each in settings.to]
        self._sent = 0

    def wants(self, envelope: Envelope) -> bool:
        """Our own soldier's positions, the only ones a hub is told."""
        return isinstance(envelope.message, Position)

    def take(self, envelopes: list[Envelope]) -> None:
        """Tell the newest of these."""
        positions = [each.message for each in envelopes if isinstance(each.message, Position)]
        if not positions:
            return
        newest = max(positions, key=lambda position: position.time_ns)
        data = sentences(newest, self._settings.talker, self._settings.geoid_undulation_m)
        for outlet in self._outlets:
            outlet.write(data)
        self._sent += 1

    def counters(self) -> dict[str, int]:
        """Positions told."""
        return {"sent": self._sent}

    def close(self) -> None:
        """Close every outlet."""
        for outlet in self._outlets:
            outlet.close()


def _outlet(text: str, folder: Path, where: str) -> Outlet:
    kind, _, rest = text.partition(":")
    try:
        match kind:
            case "udp":
                return Datagrams(address_of(rest, where))
            case "tcp":
                return Served(address_of(rest, where))
            case "pty" if rest:
                return Terminal(folder / rest)
    except OSError as error:
        raise ConfigError(f"{where}: {text!r} cannot be opened: {error.strerror or error}") from error
    raise ConfigError(f"{where}: {text!r} must be udp:host:port, tcp:host:port or pty:file")


class Datagrams:
    """One datagram for the sentences of one moment."""

    def __init__(self, address: Address) -> None:
        self._address = address
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def write(self, data: bytes) -> None:
        """Send them."""
        self._socket.sendto(data, self._address)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class Served:
    """A server: everyone who has connected gets the sentences."""

    def __init__(self, address: Address) -> None:
        self._listening = socket.create_server(address, backlog=_MOST_CLIENTS)
        self._listening.setblocking(False)
        self._clients: list[socket.socket] = []

    @property
    def port(self) -> int:
        """The port it listens at."""
        port: int = self._listening.getsockname()[1]
        return port

    def write(self, data: bytes) -> None:
        """Send to all; one that is gone, or does not read, is let go."""
        with contextlib.suppress(BlockingIOError):
            while len(self._clients) < _MOST_CLIENTS:
                client, _ = self._listening.accept()
                client.setblocking(False)
                self._clients.append(client)
        self._clients = [client for client in self._clients if _sent(client, data)]

    def close(self) -> None:
        """Hang up."""
        for each in (self._listening, *self._clients):
            each.close()


def _sent(client: socket.socket, data: bytes) -> bool:
    try:
        if client.send(data) == len(data):
            return True
    except OSError:
        pass
    client.close()
    return False


class Terminal:
    """A pseudo terminal, for tools that know only serial devices; the file is a link to it."""

    def __init__(self, path: Path) -> None:
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self._path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(self._theirs))

    def write(self, data: bytes) -> None:
        """Write them; if nobody reads and the terminal is full, they are lost."""
        with contextlib.suppress(BlockingIOError):
            os.write(self._ours, data)

    def close(self) -> None:
        """Take the link away."""
        self._path.unlink(missing_ok=True)
        os.close(self._ours)
        os.close(self._theirs)
