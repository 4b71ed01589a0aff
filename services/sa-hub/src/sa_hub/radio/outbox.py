"""Notices waiting for the air: repeated with growing pauses until all who should have them say so, or in vain.

Alerts go before observations before status. Alerts and observations are acknowledged, status is not: the next one
says it anew. Who should have a notice is whoever was heard on the net lately.
"""

import random
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import AlertNotice, Notice, StatusNotice
from sa_hub.radio.control import COUNTED_BITS, MOST_ASKED, Asked, Control, Fragment
from sa_hub.radio.quantise import tick_of

CAPACITY: Final = 32
NAMED_FROM: Final = 3
"""From this time on those who are still missing are asked by name, so that the others need not answer again."""
_COUNTERS_KEPT: Final = 16
_SPAN: Final = 1 << COUNTED_BITS
_LATELY: Final = _SPAN // 2
"""Frames: an acknowledgement is of one among so many, or its bits might be those of an older one."""
_JITTER: Final = 0.2

Key = tuple[str, int, int, str]
Parcel = Notice | Fragment


@dataclass(frozen=True, slots=True)
class Persistence:
    """How a parcel is repeated: first pause, each further one ``growth`` times as long, until ``give_up_s``."""

    first_pause_s: float
    growth: float
    give_up_s: float


ALERT: Final = Persistence(0.5, 1.25, 60.0)
"""Eight times within 7.5 s: at 30 % loss one in 15,000 misses them all."""
OBSERVATION: Final = Persistence(2.0, 1.5, 120.0)
ONCE: Final = Persistence(0.0, 1.0, 0.0)


def key_of(notice: Notice) -> Key:
    """What makes two notices the same event: text may be cut and hops differ on the way."""
    kind = notice.kind if isinstance(notice, AlertNotice) else ""
    return type(notice).__name__, notice.number, tick_of(notice.time_ns), kind


@dataclass(frozen=True, slots=True)
class Sending:
    """Something to put on the air now; ``sent`` is to be told when, and under which counter."""

    content: Parcel | Control
    sent: Callable[[int, int], None]
    asked: Asked | None = None


@dataclass(slots=True)
class _Waiting:
    parcel: Parcel
    persistence: Persistence
    due_ns: int
    until_ns: int
    pause_s: float
    times: int = 0
    counters: deque[int] = field(default_factory=lambda: deque(maxlen=_COUNTERS_KEPT))
    acknowledged: set[int] = field(default_factory=set)

    def missing(self, members: Collection[int]) -> list[int]:
        """Who has not said yet that it is there."""
        return sorted(set(members) - self.acknowledged)

    def is_done(self, members: Collection[int]) -> bool:
        """Whether all have it, and somebody has."""
        return bool(self.acknowledged) and not self.missing(members)


class Outbox:
    """Notices of one net; a soldier's next status supersedes the one before.

    ``dropped``: what found no room. ``given_up``: what somebody never acknowledged. ``seed`` of the pauses' jitter.
    """

    def __init__(self, seed: str) -> None:
        self._waiting: list[_Waiting] = []
        self._random = random.Random(seed)
        self._newest = 0
        self.dropped = 0
        self.given_up = 0

    def post(self, parcel: Parcel, now_ns: int) -> None:
        """Queue a parcel; when all is full of what is no less urgent, the oldest of the least urgent goes."""
        if isinstance(parcel, StatusNotice):
            self._supersede(parcel.number)
        persistence = _persistence(parcel)
        until_ns = now_ns + round(persistence.give_up_s * NS_PER_S)
        self._waiting.append(_Waiting(parcel, persistence, now_ns, until_ns, persistence.first_pause_s))
        self._waiting.sort(key=lambda waiting: _rank(waiting.parcel))
        if len(self._waiting) > CAPACITY:
            last = _rank(self._waiting[-1].parcel)
            self._waiting.remove(next(each for each in self._waiting if _rank(each.parcel) == last))
            self.dropped += 1

    def due(self, now_ns: int, members: Collection[int], *, alerts_only: bool = False) -> Sending | None:
        """The most urgent parcel whose time has come. ``members``: who was heard on the net lately."""
        self._settle(now_ns, members)
        for waiting in self._waiting:
            if waiting.due_ns <= now_ns and (isinstance(waiting.parcel, AlertNotice) or not alerts_only):
                return self._sending(waiting, members)
        return None

    def acknowledged(self, by: int, counted: int) -> None:
        """Somebody has heard our frame with these low bits of its counter."""
        for waiting in self._waiting:
            lately = (each for each in waiting.counters if self._newest - each < _LATELY)
            if any(each % _SPAN == counted for each in lately):
                waiting.acknowledged.add(by)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for waiting in self._waiting:
            waiting.due_ns -= by_ns
            waiting.until_ns -= by_ns

    def _sending(self, waiting: _Waiting, members: Collection[int]) -> Sending:
        def sent(now_ns: int, counter: int) -> None:
            if counter <= self._newest:
                self._epoch_begins()
            waiting.times += 1
            waiting.counters.append(counter)
            self._newest = counter
            pause_s = waiting.pause_s * self._random.uniform(1.0 - _JITTER, 1.0 + _JITTER)
            waiting.due_ns = now_ns + round(pause_s * NS_PER_S)
            waiting.pause_s *= waiting.persistence.growth

        if waiting.persistence is ONCE:
            return Sending(waiting.parcel, sent)
        missing = waiting.missing(members)
        named = waiting.times + 1 >= NAMED_FROM and len(missing) <= MOST_ASKED
        return Sending(waiting.parcel, sent, Asked(tuple(missing) if named else ()))

    def _epoch_begins(self) -> None:
        """Counters have begun again: acknowledgements from now on are of the new ones."""
        for waiting in self._waiting:
            waiting.counters.clear()

    def _settle(self, now_ns: int, members: Collection[int]) -> None:
        """Forget what has arrived or what was said once, and give up what was repeated long enough."""
        left = [each for each in self._waiting if not each.is_done(members)]
        said = [each for each in left if each.times and each.until_ns <= now_ns]
        self.given_up += sum(each.persistence is not ONCE for each in said)
        self._waiting = [each for each in left if each not in said]

    def _supersede(self, number: int) -> None:
        self._waiting = [
            waiting
            for waiting in self._waiting
            if not (isinstance(waiting.parcel, StatusNotice) and waiting.parcel.number == number)
        ]


def _persistence(parcel: Parcel) -> Persistence:
    match parcel:
        case AlertNotice():
            return ALERT
        case StatusNotice():
            return ONCE
        case _:
            return OBSERVATION


def _rank(parcel: Parcel) -> int:
    match parcel:
        case AlertNotice():
            return 0
        case StatusNotice():
            return 2
        case _:
            return 1
