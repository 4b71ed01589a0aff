"""Who has heard what, as far as it is known: receivers that tell, and stand-ins for those that do not.

Nobody acknowledges a report. So the scheduler plays some receivers that lose frames by chance, as the real ones do,
and sends what lowers their error. A hub that tells now and then which of our frames it heard (`Feedback`) takes the
place of stand-ins: of its picture only the last few frames are left to chance.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import Feedback
from sa_hub.radio.picture import BoolArray, Pictures, Spoken
from sa_hub.radio.update_codec import COUNTER_MODULUS

ROWS: Final = 24
LOSSLESS: Final = 0.005
"""Below this loss one receiver stands for all."""
_SILENT_NS: Final = 300 * NS_PER_S
_REMEMBERED: Final = 64
_LEARNING: Final = 0.02


@dataclass(slots=True)
class _Listener:
    """One hub that gives feedback: the row of its certain picture, and the last frame that this takes in."""

    row: int
    counter: int
    told_ns: int


class Listeners:
    """The receivers of one net. ``loss``: the share of frames that they miss, as assumed or as told."""

    def __init__(self, loss: float, seed: int) -> None:
        self.loss = loss
        self._random = np.random.default_rng(seed)
        self._slots = 0
        self._sent: deque[tuple[int, Spoken]] = deque(maxlen=_REMEMBERED)
        self._listeners: dict[int, _Listener] = {}
        self._certain = Pictures(0)
        self.pictures = Pictures(1 if loss < LOSSLESS else ROWS)

    @property
    def tell(self) -> bool:
        """Whether any receiver tells what it heard."""
        return bool(self._listeners)

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        self._slots = slots
        self._certain.widen(slots)
        self.pictures.widen(slots)

    def certain(self) -> Iterator[tuple[int, int, float]]:
        """(listener, slot, report's time) of all that listeners have said to have heard."""
        for number, each in self._listeners.items():
            for slot in np.flatnonzero(self._certain.known[each.row]).tolist():
                yield number, slot, float(self._certain.time_s[each.row, slot])

    def forget(self, slot: int) -> None:
        """Nobody knows this soldier any more."""
        self.pictures.forget(slot)
        self._certain.forget(slot)

    def clear(self) -> None:
        """Nobody knows anything."""
        self._listeners.clear()
        self._sent.clear()
        self._certain = Pictures(0, self._slots)
        self.pictures = Pictures(1 if self.loss < LOSSLESS else ROWS, self._slots)

    def spoke(self, counter: int, spoken: Spoken) -> None:
        """Our frame is on the air."""
        self._sent.append((counter, spoken))
        self.pictures.hear(self._by_chance(self.pictures.rows), spoken)

    def overheard(self, spoken: Spoken) -> None:
        """Somebody else's frame was on the air."""
        self.pictures.hear(self._by_chance(self.pictures.rows), spoken)
        self._certain.hear(self._by_chance(self._certain.rows), spoken)

    def _by_chance(self, rows: int) -> BoolArray:
        if self.loss < LOSSLESS:
            return np.ones(rows, dtype=np.bool_)
        return self._random.random(rows) >= self.loss

    def told(self, listener: int, feedback: Feedback, now_ns: int) -> None:
        """A hub tells which of our frames it heard."""
        if not self._sent:
            return
        newest = self._newest(feedback)
        known = self._listeners.get(listener)
        if known is None:
            known = self._new_listener(listener, newest - feedback.span - 1, now_ns)
        known.told_ns = now_ns
        for counter, spoken in self._sent:
            if known.counter < counter <= newest:
                self._settle(known.row, spoken, _was_heard(feedback, newest - counter))
        known.counter = max(known.counter, newest)
        self._drop_silent(now_ns)
        self._deal()

    def _newest(self, feedback: Feedback) -> int:
        """The whole counter of which feedback tells the low bits."""
        last = self._sent[-1][0]
        return last - (last - feedback.newest) % COUNTER_MODULUS

    def _settle(self, row: int, spoken: Spoken, heard: bool) -> None:
        """One frame of which it is known now whether it was heard."""
        there = np.arange(self._certain.rows) == row
        self._certain.hear(there & heard, spoken, there)
        self.loss += _LEARNING * ((not heard) - self.loss)

    def _new_listener(self, listener: int, counter: int, now_ns: int) -> _Listener:
        """Begins with what a stand-in has."""
        certain = Pictures(self._certain.rows + 1, self._slots)
        for row in range(self._certain.rows):
            certain.copy(row, self._certain, row)
        certain.copy(self._certain.rows, self.pictures, 0)
        self._certain = certain
        self._listeners[listener] = _Listener(certain.rows - 1, counter, now_ns)
        return self._listeners[listener]

    def _drop_silent(self, now_ns: int) -> None:
        """Who has told nothing for long is one of the others again."""
        silent = [number for number, each in self._listeners.items() if now_ns - each.told_ns > _SILENT_NS]
        for number in silent:
            del self._listeners[number]
        if silent:
            kept = Pictures(len(self._listeners), self._slots)
            for row, each in enumerate(self._listeners.values()):
                kept.copy(row, self._certain, each.row)
                each.row = row
            self._certain = kept

    def _deal(self) -> None:
        """Give every listener its share of rows: its certain picture, and by chance what it has not told of yet."""
        copies = max(1, ROWS // len(self._listeners))
        pictures = Pictures(copies * len(self._listeners), self._slots)
        since = np.zeros(pictures.rows, dtype=np.int64)
        for index, each in enumerate(self._listeners.values()):
            for row in range(index * copies, (index + 1) * copies):
                pictures.copy(row, self._certain, each.row)
                since[row] = each.counter
        for counter, spoken in self._sent:
            open_yet = counter > since
            if open_yet.any():
                pictures.hear(self._by_chance(pictures.rows) & open_yet, spoken, open_yet)
        self.pictures = pictures


def _was_heard(feedback: Feedback, before: int) -> bool:
    """Whether the frame so many before the newest was heard; what lies beyond the bits was not, to be safe."""
    return before == 0 or (before <= feedback.span and bool(feedback.heard >> (before - 1) & 1))
