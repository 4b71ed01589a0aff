"""Telling in full again: for whoever can resolve nothing of a soldier, and does not say so.

The first times soon, since a first frame may be missed, then after ever longer pauses. One such frame takes what
several updates need, so it takes no more than a share of the budget, and where all say that they hear nearly all,
so that little is left to chance, the longest pause is the first.
"""

from collections.abc import Iterable
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import Report
from sa_hub.radio.ground import FloatArray
from sa_hub.radio.listeners import LOSSLESS, Listeners
from sa_hub.radio.room import Room
from sa_hub.radio.wares import Candidates

_WORTH: Final = 5.0
_PAUSE_S: Final = 12.0
"""Of which so many, by the loss, are the longest pause."""
_LIMITS_S: Final = (60.0, 600.0)
_FIRST_S: Final = (5.0, 1.0)
_OVERDUE_S: Final = 20.0
_CHEAP_PAUSE_S: Final = 15.0
_SELDOM: Final = 3.0
"""Times what telling all in full takes of the budget are the first and the longest pause at least."""
_OLD_NS: Final = 10 * NS_PER_S


def _longest_pause_s(listeners: Listeners, *, cheap: bool) -> float:
    """Between two frames in full of a soldier: the longer the less is lost, or if all say what they heard."""
    if cheap:
        return _CHEAP_PAUSE_S
    low, high = _LIMITS_S
    return high if listeners.all_tell else min(max(_PAUSE_S / max(listeners.loss, LOSSLESS), low), high)


class Refreshing:
    """When, and how often, each soldier was told in full."""

    def __init__(self) -> None:
        self._full_ns: dict[int, tuple[int, int]] = {}

    def told_in_full(self, reports: Iterable[Report], now_ns: int) -> None:
        """These were."""
        for report in reports:
            _, times = self._full_ns.get(report.number, (now_ns, -1))
            self._full_ns[report.number] = now_ns, times + 1

    def clear(self) -> None:
        """Nobody was."""
        self._full_ns.clear()

    def worth(
        self, who: Candidates, now_ns: int, listeners: Listeners, room: Room, *, cheap: bool
    ) -> FloatArray:
        """(n,) of telling in full again; of an old report nothing, it will be told when it is newer."""
        least_s = _SELDOM * room.full_s(len(who.reports))
        longest_s = max(_longest_pause_s(listeners, cheap=cheap), least_s)
        first_s = longest_s if listeners.all_hear else max(_FIRST_S[cheap], least_s)
        overdue = [
            self._overdue(number, now_ns, first_s, longest_s) * (now_ns - report.time_ns < _OLD_NS)
            for number, report in zip(who.numbers, who.reports, strict=True)
        ]
        return _WORTH * np.array(overdue, dtype=np.float64)

    def _overdue(self, number: int, now_ns: int, first_s: float, longest_s: float) -> float:
        """How urgently a soldier that was told in full some times is to be so again: 0 within its pause, then 1,
        and within the next minutes ever more, so that no price keeps a receiver in the dark for long."""
        last_ns, times = self._full_ns.get(number, (now_ns, 0))
        late_s = (now_ns - last_ns) / NS_PER_S - min(first_s * 2.0 ** min(times, 16), longest_s)
        return 1.0 + (late_s / _OVERDUE_S) ** 2 if late_s > 0.0 else 0.0
