"""An emulated radio net: every datagram a member sends reaches all others, at the net's rate, late, or not at all.

Members are hubs with ordinary UDP links whose peer is this net's port. The channel carries one datagram at a
time (rate), each member hears it after the latency, and may miss it (loss, drawn from a seeded generator). Times
are event time: at ``--speed N`` the net runs N times as fast. It only handles loopback addresses.
"""

import heapq
import random
import selectors
import socket
import threading
import time
from dataclasses import dataclass, field

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


@dataclass
class NetCounts:
    """What the air carried; ``lost`` counts (datagram, receiver) pairs that the channel swallowed."""

    datagrams: int = 0
    bytes: int = 0
    delivered: int = 0
    lost: int = 0


@dataclass(order=True)
class _Delivery:
    due_s: float
    order: int
    port: int = field(compare=False)
    datagram: bytes = field(compare=False)


class EmulatedNet:
    """One net on one loopback port; runs in a thread of its own between `start` and `close`."""

    def __init__(self, profile: NetProfile, member_ports: list[int], speed: float = 1.0) -> None:
        self.profile = profile
        self.counts = NetCounts()
        self._members = member_ports
        self._speed = speed
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._free_at_s = 0.0
        self._waiting: list[_Delivery] = []
        self._random = random.Random(profile.seed)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"radio net {profile.name}", daemon=True)

    def start(self) -> None:
        """Put the net on the air."""
        self._thread.start()

    def close(self) -> None:
        """Take it off the air."""
        self._stop.set()
        self._thread.join(timeout=2.0)
        self._socket.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            while not self._stop.is_set():
                wait_s = self._waiting[0].due_s - time.monotonic() if self._waiting else _MAX_WAIT_S
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
            self._transmit(datagram, port)

    def _transmit(self, datagram: bytes, sender_port: int) -> None:
        size = len(datagram) + self.profile.header_bytes
        airtime_s = 8.0 * size / self.profile.rate_bits_per_s
        self._free_at_s = max(self._free_at_s, time.monotonic()) + airtime_s / self._speed
        due_s = self._free_at_s + self.profile.latency_s / self._speed
        self.counts.datagrams += 1
        self.counts.bytes += size
        for port in self._members:
            if port == sender_port:
                continue
            if self._random.random() < self.profile.loss:
                self.counts.lost += 1
            else:
                heapq.heappush(self._waiting, _Delivery(due_s, self.counts.datagrams, port, datagram))

    def _deliver_due(self) -> None:
        while self._waiting and self._waiting[0].due_s <= time.monotonic():
            delivery = heapq.heappop(self._waiting)
            try:
                self._socket.sendto(delivery.datagram, ("127.0.0.1", delivery.port))
                self.counts.delivered += 1
            except (BlockingIOError, ConnectionError):
                self.counts.lost += 1
