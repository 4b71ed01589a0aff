"""Frames as UDP datagrams: to any number of peers, unicast, broadcast or multicast; one thread receives."""

import contextlib
import ipaddress
import selectors
import socket
import struct
import threading
from collections.abc import Callable
from typing import Final

import structlog

from bootprint.errors import ConfigError
from sa_hub.settings import LinkProfile

_LONGEST_DATAGRAM: Final = 65_535

Address = tuple[str, int]


class UdpLink:
    """One socket, bound when made; ConfigError if the profile's addresses cannot be used.

    ``on_datagram`` is called in the receiving thread. ``send_faults`` counts datagrams the system refused.
    """

    def __init__(self, profile: LinkProfile, on_datagram: Callable[[bytes], None]) -> None:
        self.name = profile.name
        self.send_faults = 0
        self._on_datagram = on_datagram
        self._peers = [_parse(peer, profile.name) for peer in profile.peers]
        self._socket = _open(profile)
        self._wake, self._woken = socket.socketpair()
        self._thread = threading.Thread(target=self._run, name=f"link {profile.name}", daemon=True)

    @property
    def port(self) -> int:
        """The port it is bound to."""
        port: int = self._socket.getsockname()[1]
        return port

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Send one datagram to every peer, without waiting; what the system refuses is lost, as on the air."""
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except OSError:
                self.send_faults += 1

    def close(self) -> None:
        """Stop receiving and free the socket."""
        self._wake.close()
        if self._thread.is_alive():
            self._thread.join()
        self._socket.close()
        self._woken.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            selector.register(self._woken, selectors.EVENT_READ)
            while True:
                ready = [key.fileobj for key, _ in selector.select()]
                if self._woken in ready:
                    return
                self._receive_one()

    def _receive_one(self) -> None:
        try:
            data = self._socket.recv(_LONGEST_DATAGRAM)
        except OSError as error:  # an ICMP answer to something sent: the next datagram may be fine
            structlog.get_logger().debug("receive failed", link=self.name, error=str(error))
            return
        self._on_datagram(data)


def _open(profile: LinkProfile) -> socket.socket:
    bind = _parse(profile.bind, profile.name)
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        groups = [
            host for host, _ in (bind, *(_parse(p, profile.name) for p in profile.peers)) if _multicast(host)
        ]
        if groups:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            _use_interface(opened, profile.interface)
        opened.bind(bind)
        for group in dict.fromkeys(groups):
            _join(opened, group, profile.interface)
    except OSError as error:
        opened.close()
        raise ConfigError(
            f"link {profile.name!r}: cannot use {profile.bind} on interface {profile.interface}: {error}"
        ) from error
    return opened


def _use_interface(opened: socket.socket, interface: str) -> None:
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)


def _join(opened: socket.socket, group: str, interface: str) -> None:
    membership = struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton(interface))
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)


def _multicast(host: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_multicast
    return False


def _parse(address: str, link: str) -> Address:
    """``host:port`` resolved once; ConfigError if it is not that."""
    host, colon, port = address.rpartition(":")
    if not (colon and host and port.isdecimal() and int(port) <= 65_535):
        raise ConfigError(f"link {link!r}: address {address!r} must be host:port")
    try:
        return socket.gethostbyname(host), int(port)
    except OSError as error:
        raise ConfigError(f"link {link!r}: host of {address!r} is not known: {error}") from error
