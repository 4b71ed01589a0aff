"""Ways to a TAK network: datagrams to a mesh, or a stream (plain or TLS) to a server. No threads of its own.

`send` and `receive` are called in turn by one thread; `receive` never waits. A stream that breaks is opened again
by the next call, and what could not be sent is given up: the next report is newer.
"""

import contextlib
import ipaddress
import socket
import ssl
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Protocol

from bootprint.errors import ConfigError
from sa_hub.tak.event import MAX_EVENT_BYTES
from sa_hub.tak.settings import Endpoint, TakSettings

_TIMEOUT_S: Final = 5.0
_READ_BYTES: Final = 65_536
_MOST_READS: Final = 256
_END: Final = b"</event>"
_BEGIN: Final = b"<event"


class TakLink(Protocol):
    """One connection; OSError when it is broken."""

    def send(self, data: bytes) -> None:
        """Send one encoded event."""

    def receive(self) -> Iterator[bytes]:
        """The encoded events that wait."""

    def close(self) -> None:
        """Let go."""


def open_link(settings: TakSettings, endpoint: Endpoint, folder: Path, where: str) -> TakLink:
    """The link for an endpoint; ConfigError if its files cannot be used."""
    if endpoint.scheme == "udp":
        return MeshLink(endpoint, settings.interface)
    context = _tls(settings, folder, where) if endpoint.scheme == "tls" else None
    return StreamLink(endpoint, context, settings.server_name or endpoint.host)


def _tls(settings: TakSettings, folder: Path, where: str) -> ssl.SSLContext:
    """TAK servers have certificates of their own, so the server's is checked against ``ca``."""
    try:
        context = ssl.create_default_context(cafile=str(folder / settings.ca) if settings.ca else None)
        if settings.cert:
            context.load_cert_chain(folder / settings.cert, folder / settings.key)
    except (OSError, ssl.SSLError) as error:
        raise ConfigError(f"{where}: ca, cert or key cannot be used: {error}") from error
    return context


class MeshLink:
    """Datagrams to a group or a host; what others send to that group, or to our port, is received."""

    def __init__(self, endpoint: Endpoint, interface: str) -> None:
        self._endpoint = endpoint
        self._interface = interface or "0.0.0.0"
        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._receiver: socket.socket | None = None
        if interface:
            self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))

    def send(self, data: bytes) -> None:
        """One datagram."""
        self._sender.sendto(data, (self._endpoint.host, self._endpoint.port))

    def receive(self) -> Iterator[bytes]:
        """Whatever came; one datagram is one event."""
        socket_ = self._receiver = self._receiver or self._listening()
        for _ in range(_MOST_READS):
            try:
                yield socket_.recv(_READ_BYTES)
            except BlockingIOError:
                return

    def _listening(self) -> socket.socket:
        """On the group's port for a group, else on the port that answers come to."""
        if not _is_group(self._endpoint.host):
            self._sender.setblocking(False)
            return self._sender
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind((self._endpoint.host, self._endpoint.port))
            group = struct.pack(
                "4s4s", socket.inet_aton(self._endpoint.host), socket.inet_aton(self._interface)
            )
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
            receiver.setblocking(False)
        except OSError:
            receiver.close()
            raise
        return receiver

    def close(self) -> None:
        """Close the sockets."""
        self._sender.close()
        if self._receiver is not None:
            self._receiver.close()


def _is_group(host: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.IPv4Address(host).is_multicast
    return False


class StreamLink:
    """XML documents one after the other, as TAK servers take and give them."""

    def __init__(self, endpoint: Endpoint, tls: ssl.SSLContext | None, server_name: str) -> None:
        self._endpoint = endpoint
        self._tls = tls
        self._server_name = server_name
        self._socket: socket.socket | None = None
        self._documents = Documents()

    def _connected(self) -> socket.socket:
        if self._socket is None:
            self._documents = Documents()
            plain = socket.create_connection((self._endpoint.host, self._endpoint.port), timeout=_TIMEOUT_S)
            try:
                self._socket = (
                    plain
                    if self._tls is None
                    else self._tls.wrap_socket(plain, server_hostname=self._server_name)
                )
            except (OSError, ValueError):
                plain.close()
                raise
        return self._socket

    def send(self, data: bytes) -> None:
        """One document."""
        socket_ = self._connected()
        try:
            socket_.settimeout(_TIMEOUT_S)
            socket_.sendall(data)
        except OSError:
            self.close()
            raise

    def receive(self) -> Iterator[bytes]:
        """The whole documents that have come."""
        socket_ = self._connected()
        socket_.setblocking(False)
        for _ in range(_MOST_READS):
            try:
                data = socket_.recv(_READ_BYTES)
            except (BlockingIOError, ssl.SSLWantReadError):
                return
            except OSError:
                self.close()
                raise
            if not data:
                self.close()
                raise ConnectionResetError(f"{self._endpoint.host} has closed the connection")
            yield from self._documents.feed(data)

    def close(self) -> None:
        """Close the connection; the next call opens it again."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class Documents:
    """Cuts a stream into documents, one event each; what goes on too long without an end is given up."""

    def __init__(self) -> None:
        self._waiting = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes in; the events that are whole now."""
        *whole, self._waiting = (self._waiting + data).split(_END)
        for document in whole:
            yield document[max(0, document.find(_BEGIN)) :] + _END
        if len(self._waiting) > MAX_EVENT_BYTES:
            oversized, self._waiting = self._waiting, b""
            yield oversized
