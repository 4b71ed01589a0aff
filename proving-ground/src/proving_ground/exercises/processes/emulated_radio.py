"""An emulated radio net: every datagram a member sends reaches all others, at the net's rate, late, or not at all.

`Air` is the net in event time, pure: one datagram at a time (rate), each member hears it after the latency, and may
miss it (loss, drawn from a seeded generator; outages). `EmulatedNet` puts it between real sockets: members are hubs
with ordinary UDP links whose peer is this net's port. At ``--speed N`` it runs N times as fast. Loopback only.
"""

import heapq
import math
import random
import selectors
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from sa_hub.radio.medium import Medium
from sa_hub.radio.profiles import named

_RECEIVE_BYTES = 2048
_MAX_WAIT_S = 0.2


@dataclass(frozen=True)
class NetProfile:
    """What the air is like."""

    name: str
    rate_bits_per_s: float
    latency_s: float = 0.05
    loss: float = 0.0
    header_bytes: int = 0
    seed: int = 1
    profile: str | None = None
    """A named radio, whose key-up, slots and symbols take their time on the air."""

    @classmethod
    def of_radio(cls, name: str, radio: str | None, **own: Any) -> "NetProfile":
        """A net of a named radio (plain UDP if None); what is given of its own goes before the radio's figures."""
        given = {key: value for key, value in own.items() if value is not None}
        return cls(name, profile=radio, **(_figures(named(radio or "udp")) | given))

    @property
    def medium(self) -> Medium:
        """What a frame costs here."""
        rate = max(1, round(self.rate_bits_per_s))
        if self.profile is not None:
            radio = named(self.profile)
            return msgspec.structs.replace(radio, rate_bits_per_s=rate, header_bytes=self.header_bytes)
        return Medium(rate_bits_per_s=rate, header_bytes=self.header_bytes, mtu_bytes=_RECEIVE_BYTES)


def _figures(radio: Medium) -> dict[str, Any]:
    """What a net takes over from a radio."""
    return {
        "rate_bits_per_s": float(radio.rate_bits_per_s),
        "latency_s": radio.latency_s,
        "header_bytes": radio.header_bytes,
    }


@dataclass
class NetCounts:
    """What the air carried; ``lost`` counts (datagram, receiver) pairs that the channel swallowed."""

    datagrams: int = 0
    bytes: int = 0
    delivered: int = 0
    lost: int = 0


@dataclass(frozen=True)
class Parting:
    """Between two times (s) those ``apart`` hear each other only, and so do all others."""

    apart: frozenset[str]
    begin_s: float
    end_s: float


@dataclass(order=True)
class Delivery:
    """A datagram that is to reach a member when event time is ``due_s``."""

    due_s: float
    order: int
    member: str = field(compare=False)
    datagram: bytes = field(compare=False)


class Air:
    """A net in event time, s. ``silences_s``: (member, or "" for the whole net; from, until) when nothing passes.

    Silences and ``partings`` count from the exercise's zero, at ``zero_s``; until that is set there are none.
    """

    def __init__(
        self,
        profile: NetProfile,
        members: Sequence[str],
        silences_s: Sequence[tuple[str, float, float]] = (),
        zero_s: float = math.inf,
        partings: Sequence[Parting] = (),
    ) -> None:
        self.profile = profile
        self._partings = tuple(partings)
        self._medium = profile.medium
        self.counts = NetCounts()
        self.zero_s = zero_s
        self._members = tuple(members)
        self._silences_s = tuple(silences_s)
        self._free_at_s = -math.inf
        self._waiting: list[Delivery] = []
        self._random = random.Random(profile.seed)

    def transmit(self, sender: str, datagram: bytes, now_s: float) -> None:
        """A member sends: the datagram takes its time on the air, then the others hear it or do not."""
        size = self._medium.air_bytes(len(datagram))
        self._free_at_s = max(self._free_at_s, now_s) + 8.0 * size / self.profile.rate_bits_per_s
        due_s = self._free_at_s + self.profile.latency_s
        self.counts.datagrams += 1
        self.counts.bytes += size
        deaf = self._silent(now_s)
        for order, member in enumerate(self._members):
            if member == sender:
                continue
            # Drawn for everybody, so that an outage does not shift what others lose afterwards.
            missed = self._random.random() < self.profile.loss
            if missed or not deaf.isdisjoint(("", sender, member)) or self._parted(sender, member, now_s):
                self.counts.lost += 1
            else:
                turn = self.counts.datagrams * len(self._members) + order
                heapq.heappush(self._waiting, Delivery(due_s, turn, member, datagram))

    def _silent(self, now_s: float) -> set[str]:
        at_s = now_s - self.zero_s
        return {who for who, begin, end in self._silences_s if begin <= at_s < end}

    def _parted(self, sender: str, member: str, now_s: float) -> bool:
        at_s = now_s - self.zero_s
        return any(
            one.begin_s <= at_s < one.end_s and (sender in one.apart) != (member in one.apart)
            for one in self._partings
        )

    @property
    def next_due_s(self) -> float:
        """When the next datagram arrives; infinite if none is on its way."""
        return self._waiting[0].due_s if self._waiting else math.inf

    def arrived(self, now_s: float) -> list[Delivery]:
        """The datagrams that have arrived by now, in order."""
        found = []
        while self._waiting and self._waiting[0].due_s <= now_s:
            found.append(heapq.heappop(self._waiting))
            self.counts.delivered += 1
        return found


class EmulatedNet:
    """One net on one loopback port, for members by their UDP ports; a thread runs it from `start` to `close`."""

    def __init__(
        self,
        profile: NetProfile,
        member_ports: Mapping[str, int],
        speed: float = 1.0,
        silences_s: Sequence[tuple[str, float, float]] = (),
        partings: Sequence[Parting] = (),
    ) -> None:
        self.profile = profile
        self._air = Air(profile, list(member_ports), silences_s, partings=partings)
        self._ports = dict(member_ports)
        self._names = {port: name for name, port in member_ports.items()}
        self._speed = speed
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"radio net {profile.name}", daemon=True)

    @property
    def counts(self) -> NetCounts:
        """What the air has carried so far."""
        return self._air.counts

    def begin(self, host_s: float) -> None:
        """The exercise's zero comes in so many host seconds: from there on silences count."""
        self._air.zero_s = self._now_s() + host_s * self._speed

    def start(self) -> None:
        """Put the net on the air."""
        self._thread.start()

    def close(self) -> None:
        """Take it off the air."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._socket.close()

    def _now_s(self) -> float:
        """Event time, from some zero of its own."""
        return time.monotonic() * self._speed

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            while not self._stop.is_set():
                wait_s = (self._air.next_due_s - self._now_s()) / self._speed
                if selector.select(min(max(wait_s, 0.0), _MAX_WAIT_S)):
                    self._take_all()
                self._deliver_due()

    def _take_all(self) -> None:
        while True:
            try:
                datagram, (_, port) = self._socket.recvfrom(_RECEIVE_BYTES)
            except BlockingIOError:
                return
            except ConnectionError:  # a member's port was closed: radio does not care
                continue
            self._air.transmit(self._names.get(port, ""), datagram, self._now_s())

    def _deliver_due(self) -> None:
        for delivery in self._air.arrived(self._now_s()):
            try:
                self._socket.sendto(delivery.datagram, ("127.0.0.1", self._ports[delivery.member]))
            except (BlockingIOError, ConnectionError):
                self.counts.delivered -= 1
                self.counts.lost += 1
