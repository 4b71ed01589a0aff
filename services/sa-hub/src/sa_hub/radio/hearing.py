"""What to tell a sender of its frames that we heard: only where it helps, on reports that we send anyway.

Feedback costs bits, so it goes to who speaks in updates of at least half as many soldiers as we do (a leader's own
bits are worth more than what one soldier could save by them), and only at first, while some of their last frames
were missed, or now and then after many, so that they learn how little is lost here. Where bits are cheap it is
given anew before what it proves is old: in a quiet net many frames are a long time. The first goes back as far as
it can, each other one to the feedback before the last one, so one may be lost.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import Feedback
from sa_hub.radio.feedback_codec import LONGEST_SPAN, SPAN_STEP
from sa_hub.radio.replay import Heard

_ENOUGH: Final = 24
KEEPS_NS: Final = 30 * NS_PER_S
"""Where bits are cheap feedback is given anew after so long: a report counts as fresh for longer."""


@dataclass(slots=True)
class _Told:
    """Of a sender: its epoch, the counters told up to last and before, the first of use, whom it tells of, and when
    it was told last."""

    epoch: int
    last: int
    before: int
    first: int
    soldiers: set[int] = field(default_factory=set)
    at_ns: int = 0


class Hearing:
    """The senders of updates on one net."""

    def __init__(self) -> None:
        self._told: dict[int, _Told] = {}

    def heard_telling(self, sender: int, epoch: int, counter: int, soldiers: Iterable[int]) -> None:
        """This one tells of these in updates, or of others than itself: feedback is of use to it."""
        told = self._told.get(sender)
        if told is None or told.epoch != epoch:
            told = self._told[sender] = _Told(
                epoch, last=counter - 1, before=counter - 1 - LONGEST_SPAN, first=counter
            )
        told.soldiers.update(soldiers)

    def due(
        self, heard: Callable[[int], Heard | None], telling_of: int, now_ns: int, *, cheap: bool = False
    ) -> Feedback | None:
        """Feedback to the one who needs it most, if anyone does.

        ``heard`` gives what came of a sender; we tell of so many soldiers ourselves.
        """
        old_ns = now_ns - KEEPS_NS
        needs = {
            sender: self._need(told, heard(sender), aged=cheap and told.at_ns <= old_ns)
            for sender, told in self._told.items()
            if 2 * len(told.soldiers) >= telling_of
        }
        sender = max(needs, key=lambda each: needs[each], default=None)
        newest = None if sender is None else heard(sender)
        if sender is None or newest is None or needs[sender] == 0:
            return None
        return _feedback(sender, self._told[sender], newest)

    def sent(self, feedback: Feedback, now_ns: int) -> None:
        """It was on the air."""
        told = self._told[feedback.about]
        told.before, told.last = told.last, feedback.newest
        told.at_ns = now_ns

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for told in self._told.values():
            told.at_ns -= by_ns

    def _need(self, told: _Told, heard: Heard | None, *, aged: bool) -> int:
        """How many of its newest frames are worth telling of, the more the more soldiers they tell of."""
        if heard is None or heard.epoch != told.epoch:
            return 0
        new = heard.highest - told.last
        seen = min(heard.highest - told.first + 1, LONGEST_SPAN)
        lossy = bool(~heard.mask & ((1 << seen) - 1))
        first = told.last < told.first
        return new * len(told.soldiers) if new >= _ENOUGH or (new > 0 and (lossy or first or aged)) else 0


def _feedback(sender: int, told: _Told, heard: Heard) -> Feedback:
    wanted = heard.highest - told.before
    span = min(max(-(-wanted // SPAN_STEP) * SPAN_STEP, SPAN_STEP), LONGEST_SPAN)
    return Feedback(sender, heard.highest, span, heard.mask >> 1 & ((1 << span) - 1))
