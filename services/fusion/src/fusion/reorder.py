"""The bounded reorder buffer: inputs by (time, source, sequence), whatever order they arrived in.

Time is driven by the *drivers* (the feet): an input waits until nothing earlier can come in time any more. That is
when either

- every *expected* source has gone past it. A source's watermark is the stamp of its last message without a hole in
  the sequence before it, so a message that overtook another does not move it. *Steady* sources (receivers, cameras)
  are expected as soon as they keep a rhythm, at their next turn and not before, until they have missed two; or
- the `Pulse` says that nobody is waited for any longer: the newest stamp of a driver is ``window`` later, or the
  drivers have been silent for longer than the ``patience``: then it is the window behind the present that counts,
  until one of them speaks again. (In a replay as fast as possible it never says so.)

So the order in which expected sources arrive does not matter within the window (what nobody expects may find that
it was not waited for), and others (a receiver that is quicker than the foot filter) wait for the feet. Stamps that
cannot be true carry nobody along (`fusion.pulse`).
"""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum

from bootprint.messages import Message
from fusion.pulse import JUMP_NS, NEVER, Pulse, Verdict
from fusion.rhythm import Rhythm

_Key = tuple[int, str, int]
_LATEST_NS = 1 << 62  # in the year 2116; times must have room to be calculated with


class Arrival(Enum):
    """What became of a pushed message."""

    QUEUED = "queued"
    LATE = "late"  # what stands behind it has been released: it cannot be put in order any more
    DUPLICATE = "duplicates"
    OVERFLOW = "overflow"
    IMPLAUSIBLE = (
        "implausible_stamps"  # too far ahead of everybody; a driver's is kept until it is contradicted
    )


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
    reached_ns: int = NEVER
    overtaking: dict[int, int] = field(default_factory=dict)  # sequence -> time, behind a hole
    promised: Promise | None = None
    rhythm: Rhythm | None = None  # of a steady one

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
        if self.rhythm is not None:
            self.rhythm.hear(time_ns)

    def give_up(self, sequence: int, time_ns: int) -> None:
        """This message was released although others before it are missing."""
        if sequence >= self.next_sequence:
            self.overtaking = {late: time for late, time in self.overtaking.items() if late > sequence}
            self.pass_by(sequence, time_ns)

    def watermark_ns(self, from_ns: int, now_ns: int) -> int | None:
        """Before this comes nothing more; None if it is not waited for, by what it has said ``from_ns`` to now."""
        if self.rhythm is None:
            return self.reached_ns
        if self.rhythm.is_over(now_ns - max(self.reached_ns, from_ns)):
            return None
        return self.reached_ns + self.rhythm.rest_ns

    def keep_promise(self) -> None:
        """Move the watermark as promised, once the promised message is here."""
        if self.promised and self.next_sequence > self.promised.sequence:
            self.reached_ns = max(self.reached_ns, self.promised.until_ns)
            self.promised = None


class ReorderBuffer:
    """Holds messages back until their order is sure, for a bounded stretch of event time."""

    def __init__(
        self,
        pulse: Pulse,
        expected: frozenset[str],
        capacity: int | None = 4096,
        is_steady: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self._pulse = pulse
        self._expected = expected
        self._is_steady = is_steady
        self._begun_ns = NEVER  # when a driver was first heard
        self._capacity = capacity
        self._heap: list[tuple[int, str, int, Message]] = []
        self._keys: set[_Key] = set()
        self._lone: set[_Key] = set()  # in the heap, but perhaps wrong
        self._sources: dict[str, _Source] = {}
        self.low_ns = NEVER  # everything before this has been released
        self.set_back_ns: int | None = (
            None  # the drivers' clock has been set back to here: `restart` follows it
        )
        self.evicted = 0  # made room for something earlier

    def __len__(self) -> int:
        return len(self._heap)

    def push(self, source: str, message: Message, promise: Promise | None = None) -> Arrival:
        """Take a message in; `release` then gives what has become sure."""
        key = (message.time_ns, source, message.sequence)
        if key in self._keys:
            return Arrival.DUPLICATE
        if abs(message.time_ns) > _LATEST_NS:
            return Arrival.IMPLAUSIBLE
        verdict = self._pulse.hear(source, message.time_ns, self.low_ns)
        if verdict is Verdict.REFUSED:
            return Arrival.IMPLAUSIBLE
        if verdict is Verdict.CONTRADICTS:
            self._drop_lone()
        arrival = self._queue(key, message)
        if verdict is Verdict.LONE and arrival is Arrival.QUEUED:
            self._lone.add(key)
            return Arrival.IMPLAUSIBLE
        if verdict is Verdict.SET_BACK:
            self.set_back_ns = message.time_ns
        if verdict in (Verdict.NEAR, Verdict.CONTRADICTS, Verdict.CONFIRMED):
            self._listen(source, message, arrival)
            self._promise(promise)
            self._lower()
        if verdict is Verdict.CONFIRMED:
            self._lone.clear()
        return arrival

    def _queue(self, key: _Key, message: Message) -> Arrival:
        """Before the message moves the line itself."""
        if message.time_ns < self.low_ns:
            return Arrival.LATE
        if not self._has_room(key):
            return Arrival.OVERFLOW
        self._keys.add(key)
        heapq.heappush(self._heap, (*key, message))
        return Arrival.QUEUED

    def _has_room(self, key: _Key) -> bool:
        """Whether there is room for this message: what would be released last gives way."""
        if self._capacity is None or len(self._heap) < self._capacity:
            return True
        latest = max(self._keys)
        if key > latest:
            return False
        self.evicted += 1
        self._drop({latest})
        return True

    def _drop_lone(self) -> None:
        self._drop(self._lone)
        self._lone.clear()

    def _drop(self, keys: set[_Key]) -> None:
        self._heap = [entry for entry in self._heap if entry[:3] not in keys]
        heapq.heapify(self._heap)
        self._keys -= keys

    def _source(self, name: str) -> _Source:
        if name not in self._sources:
            self._sources[name] = _Source(rhythm=Rhythm() if self._is_steady(name) else None)
        return self._sources[name]

    def _listen(self, source: str, message: Message, arrival: Arrival) -> None:
        state = self._source(source)
        if self._pulse.in_order:
            state.pass_by(message.sequence, message.time_ns)
        elif arrival is Arrival.QUEUED:
            state.take(message.sequence, message.time_ns)
        else:
            state.give_up(message.sequence, message.time_ns)

    def _promise(self, promise: Promise | None) -> None:
        if promise is not None:
            state = self._source(promise.source)
            state.promised = promise
            state.keep_promise()

    def advance(self, now_ns: int) -> None:
        """Event time, as the host sees it, has come to ``now_ns``."""
        self._pulse.tick(now_ns)
        self._lower()

    def release(self) -> Iterator[Waiting]:
        """Everything whose order is sure, in order; may be called at any time."""
        while self._heap and self._heap[0][0] < self.low_ns:
            time_ns, source, sequence, message = heapq.heappop(self._heap)
            self._keys.discard((time_ns, source, sequence))
            self._lone.discard((time_ns, source, sequence))
            self._source(source).give_up(sequence, time_ns)
            yield Waiting(time_ns, source, sequence, message)

    def flush(self) -> None:
        """Nothing more will come: sure is all up to the drivers' newest stamp, and what goes on from there."""
        end_ns = self._pulse.driven_ns
        for time_ns, _, _ in sorted(self._keys):
            if end_ns != NEVER and time_ns > end_ns + JUMP_NS:
                break
            end_ns = max(end_ns, time_ns)
        self.low_ns = max(self.low_ns, end_ns + 1)

    def restart(self, time_ns: int) -> int:
        """Follow the drivers' clock back to ``time_ns``; by how much it was set (negative), ns."""
        self.set_back_ns = None
        self._begun_ns = NEVER
        self._sources.clear()  # their watermarks are of the old time, and so is what is far ahead now
        self._drop({key for key in self._keys if key[0] > time_ns + JUMP_NS})
        self.low_ns = NEVER
        by_ns = self._pulse.restart(time_ns)
        self._lower()
        return by_ns

    def _lower(self) -> None:
        """Move the line before which everything is sure; it goes back in `restart` only."""
        bound = self._pulse.sure_before_ns()
        if self._expected:
            bound = max(bound, min(self._watermarks_ns(), default=bound))
        self.low_ns = max(self.low_ns, bound)

    def _watermarks_ns(self) -> Iterator[int]:
        """Of all who are waited for."""
        now_ns = self._pulse.driven_ns
        if self._begun_ns == NEVER:
            self._begun_ns = now_ns
        kept = {name for name, state in self._sources.items() if state.rhythm and state.rhythm.is_kept}
        for name in self._expected | kept:
            watermark_ns = self._source(name).watermark_ns(self._begun_ns, now_ns)
            if watermark_ns is not None:
                yield watermark_ns
