"""Frames as UDP datagrams to any number of peers, unicast or multicast; what comes waits in the socket."""

import contextlib
import errno
import ipaddress
import socket
import struct
import time
from collections.abc import Callable
from typing import Final

import structlog

from bootprint.errors import ConfigError
from sa_hub.radio.link_profile import LinkProfile

_LONGEST_DATAGRAM: Final = 65_535
_ANY_PORT: Final = "0.0.0.0:0"
_ANY_HOST: Final = "0.0.0.0"
_RETRY_S: Final = 1.0
_RECEIVE_BUFFER_BYTES: Final = 4_000_000
"""Asked of the system, which may give less: what comes between two looks at the socket has to fit."""
_MOST_AT_ONCE: Final = 4096
_DOWN: Final = {errno.ENETDOWN, errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENODEV, errno.EADDRNOTAVAIL}

Address = tuple[str, int]


class UdpLink:
    """One socket, bound when made; ConfigError if the profile's addresses cannot be used.

    ``on_datagram`` is called by `poll`. ``send_faults`` counts datagrams the system refused. While
    none of the peers can be reached (no interface, no route), one frame in a second tries again, and groups are
    joined anew.
    """

    def __init__(self, profile: LinkProfile, on_datagram: Callable[[bytes], None]) -> None:
        self.name = profile.name
        self.send_faults = 0
        self.garbled = 0  # what a socket gives is a datagram
        self.fault = ""
        self._retry_at_s = 0.0
        self._on_datagram = on_datagram
        self._peers = [_parse(peer, profile.name) for peer in profile.peers]
        self._groups = _groups(profile)
        self._interface = profile.interface or _ANY_HOST
        self._socket = _open(profile)

    @property
    def port(self) -> int:
        """The port it is bound to."""
        port: int = self._socket.getsockname()[1]
        return port

    def start(self) -> None:
        """It receives since it was made."""

    def poll(self) -> None:
        """Hand over the datagrams that wait in the socket."""
        for _ in range(_MOST_AT_ONCE):
            try:
                data = self._socket.recv(_LONGEST_DATAGRAM)
            except BlockingIOError:
                return
            except OSError as error:  # an ICMP answer to something sent: the next datagram may be fine
                structlog.get_logger().debug("receive failed", link=self.name, error=str(error))
                continue
            self._on_datagram(data)

    @property
    def busy(self) -> bool:
        """Whether the network was not there a moment ago."""
        return bool(self.fault) and time.monotonic() < self._retry_at_s

    def send(self, data: bytes) -> None:
        """Send one datagram to every peer, without waiting; what the system refuses is lost, as on the air."""
        was_down, refused = bool(self.fault), 0
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except OSError as error:
                refused += 1
                self._note_down(error)
        self.send_faults += refused
        if refused < len(self._peers):
            self.fault = ""
        if was_down and not self.fault:
            self._join_again()

    def _note_down(self, error: OSError) -> None:
        if error.errno in _DOWN:
            self.fault = f"{self.name}: {error.strerror}"
            self._retry_at_s = time.monotonic() + _RETRY_S

    def _join_again(self) -> None:
        """The network is back: an interface that was made anew knows nothing of our groups."""
        for group in self._groups:
            with contextlib.suppress(OSError):  # joined still
                _join(self._socket, group, self._interface)

    def close(self) -> None:
        """Free the socket."""
        self._socket.close()


def _open(profile: LinkProfile) -> socket.socket:
    bind = _parse(profile.bind or _ANY_PORT, profile.name)
    interface = profile.interface or _ANY_HOST
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        groups = _groups(profile)
        if groups:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            _use_interface(opened, interface)
        opened.bind(bind)
        for group in groups:
            _join(opened, group, interface)
    except OSError as error:
        opened.close()
        raise ConfigError(
            f"link {profile.name!r}: cannot use {bind[0]}:{bind[1]} on interface {interface}: {error}"
        ) from error
    return opened


def _groups(profile: LinkProfile) -> list[str]:
    """The multicast groups among the profile's addresses."""
    addresses = (profile.bind or _ANY_PORT, *profile.peers)
    hosts = (_parse(address, profile.name)[0] for address in addresses)
    return [host for host in dict.fromkeys(hosts) if _multicast(host)]


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
