"""Acknowledgements that this hub owes on one net: gathered for a moment, so that one frame carries several."""

import random
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.control import COUNTED_BITS, MOST_ACKNOWLEDGED, Acknowledgement
from sa_hub.radio.outbox import Sending

LEAST_WAIT_S: Final = 0.1
SPREAD_S: Final = 1.0
"""Hubs that heard the same frame answer spread over this time."""
SAID_NS: Final = 3 * NS_PER_S
"""So long an acknowledgement is trusted to have arrived, unless we are asked again by name."""
_CAPACITY: Final = 64


@dataclass(slots=True)
class _Owed:
    """The frame to acknowledge, and in which of the hub's looks it came."""

    counted: int
    look: int


class Answers:
    """What was heard and is to be acknowledged; of something heard again only the newest frame is."""

    def __init__(self, seed: str) -> None:
        self._random = random.Random(seed)
        self._owed: dict[tuple[int, Hashable], _Owed] = {}
        self._said: dict[tuple[int, Hashable], int] = {}
        self._due_ns = 0

    def owe(
        self, sender: int, what: Hashable, counter: int, now_ns: int, *, by_name: bool, look: int = 0
    ) -> None:
        """A frame came that asks us, by name or with everybody; ``what`` it says tells a repetition from news."""
        if not by_name and now_ns - self._said.get((sender, what), now_ns - SAID_NS) < SAID_NS:
            return
        if not self._owed:
            wait_s = LEAST_WAIT_S + self._random.uniform(0.0, SPREAD_S)
            self._due_ns = now_ns + round(wait_s * NS_PER_S)
        self._owed[sender, what] = _Owed(counter % (1 << COUNTED_BITS), look)
        if len(self._owed) > _CAPACITY:
            del self._owed[next(iter(self._owed))]

    def due(self, now_ns: int, kept_until: int | None = None) -> Sending | None:
        """The acknowledgement to send now; what came in looks after ``kept_until`` must wait."""
        if not self._owed or now_ns < self._due_ns:
            return None
        kept = [
            (key, owed) for key, owed in self._owed.items() if kept_until is None or owed.look <= kept_until
        ]
        told = kept[:MOST_ACKNOWLEDGED]
        if not told:
            return None

        def sent(now_ns: int, _counter: int) -> None:
            self._said = {key: at_ns for key, at_ns in self._said.items() if now_ns - at_ns < SAID_NS}
            for key, _ in told:
                del self._owed[key]
                self._said[key] = now_ns

        return Sending(Acknowledgement(tuple((sender, owed.counted) for (sender, _), owed in told)), sent)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._due_ns -= by_ns
        self._said.clear()
