"""Sends our soldier's map of rooms to the others on broadband nets, and tells theirs on our own bus.

Only links of kind ``zenoh`` carry maps: a map is tens of kilobytes, an hour of a narrow radio. Each has a session
of its own at the net's router, under ``{realm}/@rooms1/{net}/{number}``, which no selector of the bus matches. Our
newest map is sent again now and then, for those who came later.
"""

import contextlib
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member
from bootprint.errors import BusError
from bootprint.figures import Figures
from bootprint.rooms import RoomMap
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus
from sa_hub.radio.net_keys import NextKey
from sa_hub.rooms.parcel import ParcelError, open_parcel, seal

AGAIN_NS: Final = 60 * NS_PER_S
_PATIENCE_S: Final = 2.0


class RoomExchange:
    """What is sent and taken, apart from sessions. ``roster`` by number; ``now_ns`` is event time."""

    def __init__(
        self,
        identity: Identity,
        number: int,
        roster: Mapping[int, Member],
        group_key: bytes,
        next_key: NextKey | None = None,
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._identity, self._number, self._roster = identity, number, roster
        self._group_key, self._next_key = group_key, next_key
        self._own: RoomMap | None = None
        self._newest_ns: dict[int, int] = {}
        self._sent_ns: dict[str, int] = {}

    def note_own(self, rooms: RoomMap) -> None:
        """Our soldier's fusion has told its map."""
        if rooms.soldier == self._identity.soldier:
            self._own = rooms
            self._sent_ns.clear()

    def due(self, net: str, now_ns: int) -> bytes | None:
        """A parcel for a net, if one is to be sent now."""
        sent_ns = self._sent_ns.get(net)
        if self._own is None or (sent_ns is not None and 0 <= now_ns - sent_ns < AGAIN_NS):
            return None
        self._sent_ns[net] = now_ns
        self.counters["rooms_sent"] += 1
        return seal(self._own, self._keys(now_ns)[0], self._number, net)

    def take(self, net: str, data: bytes, now_ns: int) -> Envelope | None:
        """Another's map as our bus is told it; None if it is not authentic, or old."""
        try:
            sender, rooms = open_parcel(data, self._keys(now_ns), net)
        except ParcelError as error:
            self.counters[f"rooms_{error.cause}"] += 1
            return None
        member = self._roster.get(sender)
        if member is None or member.id != rooms.soldier or sender == self._number:
            self.counters["rooms_forged"] += 1
            return None
        if rooms.time_ns <= self._newest_ns.get(sender, rooms.time_ns - 1):
            return None
        self._newest_ns[sender] = rooms.time_ns
        self.counters["rooms_taken"] += 1
        return Envelope(self._identity.address("rooms", member.id), rooms)

    def _keys(self, now_ns: int) -> tuple[bytes, ...]:
        """The group key to seal with, and others to open with."""
        if self._next_key is None:
            return (self._group_key,)
        begun = now_ns >= self._next_key.from_ns
        both = (self._next_key.group_key, self._group_key)
        return both if begun else both[::-1]


class RoomLinks:
    """A companion of the hub: a session for each broadband net. ``announce`` is called in the sessions' threads."""

    def __init__(
        self,
        exchange: RoomExchange,
        routers: Mapping[str, str],
        realm: str,
        number: int,
        now_ns: Callable[[], int],
        announce: Callable[[Envelope], None],
    ) -> None:
        self._exchange, self._routers, self._realm, self._number = exchange, routers, realm, number
        self._now_ns, self._announce = now_ns, announce
        self._lock = threading.Lock()
        self._news = threading.Event()
        self._stopping = threading.Event()
        self._threads = [
            threading.Thread(target=self._run, args=(net, router), name=f"rooms {net}", daemon=True)
            for net, router in routers.items()
        ]

    def start(self) -> None:
        """Look for the routers until they are there."""
        for thread in self._threads:
            thread.start()

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """What our soldier's fusion has told."""
        for envelope in envelopes:
            if isinstance(envelope.message, RoomMap):
                with self._lock:
                    self._exchange.note_own(envelope.message)

    def figures(self) -> Figures:
        """What was sent, taken and refused."""
        return Figures("ok", dict(self._exchange.counters))

    def close(self) -> None:
        """Close the sessions."""
        self._stopping.set()
        for thread in self._threads:
            thread.join()

    def _run(self, net: str, router: str) -> None:
        bus: ZenohBus | None = None
        while bus is None and not self._stopping.is_set():
            with contextlib.suppress(BusError):
                bus = open_bus(router, timeout_s=_PATIENCE_S, should_stop=self._stopping.is_set)
        if bus is None:
            return
        topic = f"{self._realm}/@rooms1/{net}"
        own_key = f"{topic}/{self._number}"
        try:
            bus.subscribe_raw(f"{topic}/*", partial(self._arrived, net, own_key))
            put = bus.raw_publisher(own_key)
            while not self._stopping.wait(1.0):
                self._send(net, put)
        finally:
            bus.close()

    def _send(self, net: str, put: Callable[[bytes], None]) -> None:
        with self._lock:
            parcel = self._exchange.due(net, self._now_ns())
        if parcel is not None:
            with contextlib.suppress(BusError):  # the router is gone for a moment: it is sent again
                put(parcel)

    def _arrived(self, net: str, own_key: str, key: str, payload: bytes) -> None:
        if key == own_key:
            return
        with self._lock:
            envelope = self._exchange.take(net, payload, self._now_ns())
        if envelope is not None:
            self._announce(envelope)
