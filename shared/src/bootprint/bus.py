"""What a service knows of the bus: envelopes in, envelopes out. `MemoryBus` is the deterministic one."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

from bootprint import wire
from bootprint.messages import Message
from bootprint.topics import Address, parse_key


@dataclass(frozen=True, slots=True)
class Envelope:
    """A message and where it belongs."""

    address: Address
    message: Message


Handler = Callable[[Envelope], None]


class Bus(Protocol):
    """The way between processes. Handlers may be called from another thread."""

    def publish(self, envelope: Envelope) -> None:
        """Send one message."""

    def subscribe(self, selector: str, handler: Handler) -> None:
        """Call ``handler`` with every message whose key matches the selector (``*`` and ``**``)."""

    def close(self) -> None:
        """Stop receiving and free everything; safe to call twice."""


class Core(Protocol):
    """A service's thinking part: no bus, no clock, no files; the same inputs give the same outputs."""

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """Take one message in; time is the message's own."""

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Event time has reached ``now_ns``: what silence means (stale, heartbeat, overdue output)."""


class MemoryBus:
    """A bus within one process: every message is encoded, decoded and delivered in the order it was published.

    Delivery is first-in first-out across all subscribers (a message published by a handler is delivered after
    those already waiting), so a run is a function of its input alone. ``journal`` holds every (key, payload).
    """

    def __init__(self) -> None:
        self._subscriptions: list[tuple[str, Handler]] = []
        self._waiting: deque[tuple[Address, bytes]] = deque()
        self._delivering = False
        self.journal: list[tuple[str, bytes]] = []

    def publish(self, envelope: Envelope) -> None:
        """Send one message; returns when it and all that follows from it has been delivered."""
        payload = wire.encode(envelope.message)
        self.journal.append((envelope.address.key, payload))
        self._waiting.append((envelope.address, payload))
        if not self._delivering:
            self._deliver()

    def _deliver(self) -> None:
        self._delivering = True
        try:
            while self._waiting:
                address, payload = self._waiting.popleft()
                key = address.key
                for selector, handler in self._subscriptions:
                    if matches(selector, key):
                        handler(Envelope(address, wire.decode(address.subject, payload)))
        finally:
            self._delivering = False

    def subscribe(self, selector: str, handler: Handler) -> None:
        """Call ``handler`` with every message whose key matches the selector."""
        self._subscriptions.append((selector, handler))

    def attach(self, core: Core, selectors: Iterable[str]) -> None:
        """Wire a core to this bus: what matches goes in, what comes out is published."""

        def handler(envelope: Envelope) -> None:
            for output in core.handle(envelope):
                self.publish(output)

        for selector in selectors:
            self.subscribe(selector, handler)

    def replayed(self, subject: str) -> Iterator[Envelope]:
        """The messages of one subject in the journal, in order."""
        for key, payload in self.journal:
            address = parse_key(key)
            if address.subject == subject:
                yield Envelope(address, wire.decode(subject, payload))

    def close(self) -> None:
        """Forget all subscriptions."""
        self._subscriptions.clear()


@lru_cache(maxsize=4096)
def matches(selector: str, key: str) -> bool:
    """Whether a key expression with ``*`` (one part) and ``**`` (any number of parts) matches a key."""
    return _match_parts(tuple(selector.split("/")), tuple(key.split("/")))


def _match_parts(selector: tuple[str, ...], key: tuple[str, ...]) -> bool:
    if not selector:
        return not key
    head, rest = selector[0], selector[1:]
    if head == "**":
        # As in zenoh, a part that begins with @ is matched only by itself, never by a wildcard.
        wild = next((index for index, part in enumerate(key) if part.startswith("@")), len(key))
        return any(_match_parts(rest, key[skip:]) for skip in range(wild + 1))
    if not key:
        return False
    if head != key[0] and (head != "*" or key[0].startswith("@")):
        return False
    return _match_parts(rest, key[1:])
