"""The bounded reorder buffer: inputs by (time, source, sequence), whatever order they arrived in.

Time is driven by the *drivers* (the feet): an input waits until nothing earlier can come in time any more. That is
when either

- every *expected* source has gone past it. A source's watermark is the stamp of its last message without a hole in
  the sequence before it, so a message that overtook another does not move it; or
- the newest stamp of a driver is ``window`` later; or
- the drivers have been silent while other stamps or `advance` (the host's event time) went on by ``patience``.

So the order in which expected sources arrive does not matter within the window (what nobody expects may find that
it was not waited for), and others (a receiver that is quicker than the foot filter) wait for the feet. A stamp far
from its source's last one is queued but drives nothing: one broken stamp in the future carries nobody along.
"""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum

from bootprint.clock import NS_PER_S
from bootprint.messages import Message

_JUMP_NS = 10 * NS_PER_S
_NEVER = -(1 << 63)


class Arrival(Enum):
    """What became of a pushed message."""

    QUEUED = "queued"
    LATE = "late"  # what stands behind it has been released: it cannot be put in order any more
    DUPLICATE = "duplicates"
    OVERFLOW = "overflow"


@dataclass(frozen=True, slots=True)
class Waiting:
    """One message in the buffer."""

    time_ns: int
    source: str
    sequence: int
    message: Message


@dataclass(frozen=True, slots=True)
class Promise:
    """After message ``sequence`` of ``source`` comes none with a stamp before ``until_ns``."""

    source: str
    sequence: int
    until_ns: int


@dataclass(slots=True)
class _Source:
    """How far one source has come without a hole."""

    next_sequence: int = 0
    reached_ns: int = _NEVER
    newest_ns: int | None = None
    overtaking: dict[int, int] = field(default_factory=dict)  # sequence -> time, behind a hole
    promised: Promise | None = None

    def take(self, sequence: int, time_ns: int) -> None:
        """A message has arrived."""
        if sequence > self.next_sequence:
            self.overtaking[sequence] = time_ns
        elif sequence == self.next_sequence or time_ns > self.reached_ns:  # in order, or begun anew
            self.pass_by(sequence, time_ns)

    def pass_by(self, sequence: int, time_ns: int) -> None:
        """Everything up to this message has arrived or is given up."""
        if sequence < self.next_sequence:
            self.overtaking.clear()
        self._reach(sequence, time_ns)
        while self.next_sequence in self.overtaking:
            self._reach(self.next_sequence, self.overtaking.pop(self.next_sequence))
        self.keep_promise()

    def _reach(self, sequence: int, time_ns: int) -> None:
        self.next_sequence = sequence + 1
        self.reached_ns = max(self.reached_ns, time_ns)

    def give_up(self, sequence: int, time_ns: int) -> None:
        """This message was released although others before it are missing."""
        if sequence >= self.next_sequence:
            self.overtaking = {late: time for late, time in self.overtaking.items() if late > sequence}
            self.pass_by(sequence, time_ns)

    def keep_promise(self) -> None:
        """Move the watermark as promised, once the promised message is here."""
        if self.promised and self.next_sequence > self.promised.sequence:
            self.reached_ns = max(self.reached_ns, self.promised.until_ns)
            self.promised = None


class ReorderBuffer:
    """Holds messages back until their order is sure, for a bounded stretch of event time."""

    def __init__(
        self,
        window_ns: int,
        drivers: frozenset[str],
        expected: frozenset[str],
        patience_ns: int,
        capacity: int = 4096,
    ) -> None:
        self._window_ns = window_ns
        self._patience_ns = patience_ns
        self._drivers = drivers
        self._expected = expected
        self._capacity = capacity
        self._heap: list[tuple[int, str, int, Message]] = []
        self._keys: set[tuple[int, str, int]] = set()
        self._sources: dict[str, _Source] = {name: _Source() for name in drivers | expected}
        self._driven_ns = _NEVER  # newest stamp of a driver
        self._ahead_ns = _NEVER  # newest stamp or tick of anybody
        self._quiet_since_ns = _NEVER  # how far anybody was when a driver was last heard
        self.low_ns = _NEVER  # everything before this has been released

    def __len__(self) -> int:
        return len(self._heap)

    def push(self, source: str, message: Message, promise: Promise | None = None) -> Arrival:
        """Take a message in; `release` then gives what has become sure."""
        key = (message.time_ns, source, message.sequence)
        if key in self._keys:
            return Arrival.DUPLICATE
        arrival = self._arrival(message)  # before the message moves the line itself
        if arrival is Arrival.QUEUED:
            self._keys.add(key)
            heapq.heappush(self._heap, (*key, message))
        state = self._sources.setdefault(source, _Source())
        if self._plausible(state, message.time_ns):
            self._listen(state, source in self._drivers, message, arrival)
            if promise is not None:
                self._promise(promise)
            self._lower()
        return arrival

    def _arrival(self, message: Message) -> Arrival:
        if message.time_ns < self.low_ns:
            return Arrival.LATE
        return Arrival.QUEUED if len(self._heap) < self._capacity else Arrival.OVERFLOW

    def _plausible(self, state: _Source, time_ns: int) -> bool:
        last = state.newest_ns if state.newest_ns is not None else self._ahead_ns
        state.newest_ns = time_ns
        return last == _NEVER or abs(time_ns - last) <= _JUMP_NS

    def _listen(self, state: _Source, drives: bool, message: Message, arrival: Arrival) -> None:
        if arrival is Arrival.QUEUED:
            state.take(message.sequence, message.time_ns)
        else:
            state.give_up(message.sequence, message.time_ns)
        self._ahead_ns = max(self._ahead_ns, message.time_ns)
        if drives:
            self._driven_ns = max(self._driven_ns, message.time_ns)
        if drives or self._quiet_since_ns == _NEVER:
            self._quiet_since_ns = self._ahead_ns

    def _promise(self, promise: Promise) -> None:
        state = self._sources.setdefault(promise.source, _Source())
        state.promised = promise
        state.keep_promise()

    def advance(self, now_ns: int) -> None:
        """Event time, as the host sees it, has come to ``now_ns``."""
        self._ahead_ns = max(self._ahead_ns, now_ns)
        if self._quiet_since_ns == _NEVER:
            self._quiet_since_ns = now_ns
        self._lower()

    def release(self) -> Iterator[Waiting]:
        """Everything whose order is sure, in order; may be called at any time."""
        while self._heap and self._heap[0][0] < self.low_ns:
            time_ns, source, sequence, message = heapq.heappop(self._heap)
            self._keys.discard((time_ns, source, sequence))
            self._sources[source].give_up(sequence, time_ns)
            yield Waiting(time_ns, source, sequence, message)

    def flush(self) -> None:
        """Nothing more will come: everything up to the drivers' newest stamp (or whoever is left) is sure."""
        end = self._driven_ns if self._driven_ns != _NEVER else self._ahead_ns
        self.low_ns = max(self.low_ns, end + 1)

    def _lower(self) -> None:
        """Move the line before which everything is sure; it never goes back."""
        bound = self._driven_ns - self._window_ns
        if self._expected:
            bound = max(bound, min(self._sources[name].reached_ns for name in self._expected))
        if self._ahead_ns - self._quiet_since_ns > self._patience_ns:
            bound = max(bound, self._ahead_ns - self._patience_ns)
        self.low_ns = max(self.low_ns, bound)
