"""Who has heard what, as far as it is known: receivers that tell, and stand-ins for those that do not.

Nobody acknowledges a report. So the scheduler plays some receivers that lose frames by chance, as the real ones do,
and sends what lowers their error. A hub that tells now and then which of our frames it heard (`Feedback`) takes the
place of stand-ins: of its picture only the last few frames are left to chance.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio.arrears import after, certainly, needed
from sa_hub.radio.content import Feedback
from sa_hub.radio.feedback_codec import COUNTER_MODULUS
from sa_hub.radio.ground import FloatArray
from sa_hub.radio.picture import BoolArray, IntArray, Pictures, Spoken

ROWS: Final = 24
LOSSLESS: Final = 0.005
"""Below this loss one receiver stands for all."""
_SILENT_NS: Final = 300 * NS_PER_S
_REMEMBERED: Final = 64
_ASSUMED_FRAMES: Final = (4, 20)
"""As many frames as the loss that was assumed counts, the second if it was stated."""
_LOSS_FRAMES: Final = 50
"""The loss is that of about so many frames last told of."""
_NONE_OPEN: Final = 1 << 40


@dataclass(slots=True)
class _Listener:
    """One hub that gives feedback: the row of its certain picture, and the last frame that this takes in.

    ``arrears``: the odds of how far it is behind by now, by slot. ``proven``: the time of the newest report by slot
    that it has said to have heard in a frame of ours.
    """

    row: int
    counter: int
    told_ns: int
    arrears: FloatArray
    proven: dict[int, float] = field(default_factory=dict)


class Listeners:
    """The receivers of one net. ``loss``: the share of frames that they miss, as assumed or as told.

    ``pictures``: what they may have; a share of rows for each that tells, then one for all that were heard here but
    do not tell, or all rows while nobody does.
    """

    def __init__(self, loss: float, seed: int) -> None:
        self.loss = loss
        self._judged = _ASSUMED_FRAMES[loss >= LOSSLESS]
        self._random = np.random.default_rng(seed)
        self._slots = 0
        self._sent: deque[tuple[int, Spoken]] = deque(maxlen=_REMEMBERED)
        self._listeners: dict[int, _Listener] = {}
        self._heard_ns: dict[int, int] = {}
        self._certain = Pictures(0)
        self._strangers = 0
        self._stand_ins = Pictures(1 if loss < LOSSLESS else ROWS)
        self.pictures = self._stand_ins

    @property
    def tell(self) -> bool:
        """Whether any receiver tells what it heard."""
        return bool(self._listeners)

    @property
    def all_tell(self) -> bool:
        """Whether every receiver does that was heard within 5 min of the time passed, and there is one."""
        return self.tell and self._heard_ns.keys() <= self._listeners.keys()

    @property
    def all_hear(self) -> bool:
        """Whether every receiver tells what it hears, and that it misses next to nothing: no chance is left."""
        return self.all_tell and self.loss < LOSSLESS

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        self._slots = slots
        for pictures in (self._certain, self._stand_ins, self.pictures):
            pictures.widen(slots)
        for each in self._listeners.values():
            more = slots - len(each.arrears)
            each.arrears = np.concatenate([each.arrears, certainly(np.full(more, _NONE_OPEN))])

    def needs(self, slots: IntArray, unsure: float) -> IntArray:
        """(n,) what updates must allow for, so that listeners refuse hardly more than a share of ``unsure``."""
        most = np.zeros(len(slots), dtype=np.int64)
        for each in self._listeners.values():
            most = np.maximum(most, needed(each.arrears[slots], unsure))
        return most

    def certain(self) -> Iterator[tuple[int, int, float]]:
        """(listener, slot, report's time) of all that listeners have said to have heard of us."""
        for number, each in self._listeners.items():
            for slot, time_s in each.proven.items():
                yield number, slot, time_s

    def forget(self, slot: int) -> None:
        """Nobody knows this soldier any more."""
        for pictures in (self._certain, self._stand_ins, self.pictures):
            pictures.forget(slot)
        for each in self._listeners.values():
            each.proven.pop(slot, None)
            each.arrears[slot] = certainly(np.array([_NONE_OPEN]))[0]

    def clear(self) -> None:
        """Nobody knows anything."""
        self._listeners.clear()
        self._heard_ns.clear()
        self._sent.clear()
        self._certain = Pictures(0, self._slots)
        self._stand_ins = Pictures(1 if self.loss < LOSSLESS else ROWS, self._slots)
        self.pictures = self._stand_ins

    def spoke(self, counter: int, spoken: Spoken) -> None:
        """Our frame is on the air."""
        self._sent.append((counter, spoken))
        self._may_hear(spoken)
        for each in self._listeners.values():
            each.arrears = after(each.arrears, spoken, self.loss)

    def overheard(self, spoken: Spoken) -> None:
        """Somebody else's frame was on the air."""
        self._may_hear(spoken)
        self._certain.hear(self._by_chance(self._certain.rows), spoken)

    def heard_from(self, number: int, now_ns: int) -> None:
        """Somebody on this net was heard, and so may hear us."""
        self._heard_ns[number] = now_ns

    def _may_hear(self, spoken: Spoken) -> None:
        chance = self._by_chance(self._stand_ins.rows)
        self._stand_ins.hear(chance, spoken)
        if self.pictures is not self._stand_ins:
            # The last rows are the first of the stand-ins: for them it is the same chance.
            others = self.pictures.rows - self._strangers
            chances = np.concatenate([self._by_chance(others), chance[: self._strangers]])
            self.pictures.hear(chances, spoken)

    def _by_chance(self, rows: int) -> BoolArray:
        if self.loss < LOSSLESS:
            return np.ones(rows, dtype=np.bool_)
        return self._random.random(rows) >= self.loss

    def told(self, listener: int, feedback: Feedback, now_ns: int) -> None:
        """A hub tells which of our frames it heard."""
        if not self._sent:
            return
        newest = self._newest(feedback)
        known = self._listeners.get(listener) or self._new_listener(listener, now_ns)
        known.told_ns = now_ns
        for counter, spoken in self._sent:
            if known.counter < counter <= newest:
                self._settle(known, spoken, _was_heard(feedback, newest - counter))
        known.counter = max(known.counter, newest)
        self._reckon(known)
        self._drop_silent(now_ns)
        self._deal()

    def pass_time(self, now_ns: int) -> None:
        """Event time is ``now_ns``: who fell silent no longer counts, though nobody else says anything either."""
        before = len(self._listeners), self.all_tell
        self._drop_silent(now_ns)
        if (len(self._listeners), self.all_tell) != before:
            self._deal()

    def _reckon(self, listener: _Listener) -> None:
        """How far behind it may be: as it told, and by chance in what was sent since."""
        behind = self._certain.behind(np.arange(self._slots))[listener.row]
        listener.arrears = certainly(behind)
        for counter, spoken in self._sent:
            if counter > listener.counter:
                listener.arrears = after(listener.arrears, spoken, self.loss)

    def _newest(self, feedback: Feedback) -> int:
        """The whole counter of which feedback tells the low bits."""
        last = self._sent[-1][0]
        return last - (last - feedback.newest) % COUNTER_MODULUS

    def _settle(self, listener: _Listener, spoken: Spoken, heard: bool | None) -> None:
        """One frame of which it is known now whether it was heard; None: it is not, so it is taken as missed."""
        certain, row = self._certain, listener.row
        there = np.arange(certain.rows) == row
        certain.hear(there & bool(heard), spoken, there)
        for slot, time_s in zip(spoken.slots.tolist(), spoken.time_s.tolist(), strict=True):
            if heard and certain.known[row, slot] and certain.time_s[row, slot] == time_s:
                listener.proven[slot] = time_s
        if heard is not None:
            self._learn(missed=not heard)

    def _learn(self, *, missed: bool) -> None:
        """The mean of so many frames and of what was assumed: right from the first ones on, and never certain."""
        self._judged = min(self._judged + 1, _LOSS_FRAMES)
        self.loss += (missed - self.loss) / self._judged

    def _new_listener(self, listener: int, now_ns: int) -> _Listener:
        """Begins with nothing: what it has is what it says to have heard."""
        certain = Pictures(self._certain.rows + 1, self._slots)
        for row in range(self._certain.rows):
            certain.copy(row, self._certain, row)
        self._certain = certain
        never = np.full(self._slots, _NONE_OPEN)
        self._listeners[listener] = _Listener(certain.rows - 1, -1, now_ns, certainly(never))
        return self._listeners[listener]

    def _drop_silent(self, now_ns: int) -> None:
        """Who has told nothing for long is one of the others again; who was not heard for long is gone."""
        self._heard_ns = {
            number: at_ns for number, at_ns in self._heard_ns.items() if now_ns - at_ns <= _SILENT_NS
        }
        silent = [number for number, each in self._listeners.items() if now_ns - each.told_ns > _SILENT_NS]
        for number in silent:
            del self._listeners[number]
        if silent:
            kept = Pictures(len(self._listeners), self._slots)
            for row, each in enumerate(self._listeners.values()):
                kept.copy(row, self._certain, each.row)
                each.row = row
            self._certain = kept

    def _spread(self) -> None:
        """Frames are lost after all: stand-ins so far heard the same, from now on each by chance."""
        alike, self._stand_ins = self._stand_ins, Pictures(ROWS, self._slots)
        for row in range(ROWS):
            self._stand_ins.copy(row, alike, 0)

    def _deal(self) -> None:
        """Give every listener its share of rows: its certain picture, and by chance what it has not told of yet."""
        if self.loss >= LOSSLESS and self._stand_ins.rows < ROWS:
            self._spread()
        shares = len(self._listeners) + (not self.all_tell)
        copies = max(1, ROWS // shares)
        told = copies * len(self._listeners)
        self._strangers = 0 if self.all_tell else min(copies, self._stand_ins.rows)
        pictures = Pictures(told + self._strangers, self._slots)
        since = np.full(pictures.rows, _NONE_OPEN, dtype=np.int64)
        for index, each in enumerate(self._listeners.values()):
            for row in range(index * copies, (index + 1) * copies):
                pictures.copy(row, self._certain, each.row)
                since[row] = each.counter
        for row in range(self._strangers):
            pictures.copy(told + row, self._stand_ins, row)
        for counter, spoken in self._sent:
            open_yet = counter > since
            if open_yet.any():
                pictures.hear(self._by_chance(pictures.rows) & open_yet, spoken, open_yet)
        self.pictures = pictures


def _was_heard(feedback: Feedback, before: int) -> bool | None:
    """Whether the frame so many before the newest was heard; None if it lies beyond the bits."""
    if before == 0:
        return True
    return bool(feedback.heard >> (before - 1) & 1) if before <= feedback.span else None
