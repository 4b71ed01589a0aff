"""The replay window: which of each sender's counters were heard already, and which ones a header may stand for."""

from collections.abc import Iterator
from itertools import chain
from typing import Final

import msgspec

from sa_hub.radio.layout import COUNTER_BITS, COUNTER_LOW_BITS

WINDOW: Final = 64
_SPAN: Final = 1 << COUNTER_LOW_BITS
NEAR: Final = 4
"""Spans of 8 counters that are always tried, ahead of the newest heard and back from it: 32 frames each way."""
FAR_AHEAD: Final = 60
"""Spans ahead up to which is tried while there are far tries left: a gap of 480 frames."""
FAR_BACK: Final = WINDOW // _SPAN


class Heard(msgspec.Struct):
    """What was heard of one sender on one net: epoch, highest counter, the 64 up to it (bit 0: the highest)."""

    epoch: int
    highest: int
    mask: int = 1

    def near(self, counter_low: int) -> Iterator[int]:
        """Counters with these low bits close to the newest heard, the likeliest first; at most 8."""
        ahead = self._ahead(counter_low, 0, NEAR)
        return self._possible(ahead, self._back(counter_low, 0, NEAR))

    def far(self, counter_low: int) -> Iterator[int]:
        """The next ones out, up to 480 ahead and back to the window's end; at most 60."""
        ahead = self._ahead(counter_low, NEAR, FAR_AHEAD)
        return self._possible(ahead, self._back(counter_low, NEAR, FAR_BACK))

    def _next(self, counter_low: int) -> int:
        """The first counter above the highest that has these low bits."""
        return self.highest + 1 + (counter_low - self.highest - 1) % _SPAN

    def _ahead(self, counter_low: int, begin: int, end: int) -> range:
        first = self._next(counter_low)
        return range(first + begin * _SPAN, first + end * _SPAN, _SPAN)

    def _back(self, counter_low: int, begin: int, end: int) -> range:
        first = self._next(counter_low) - _SPAN
        return range(first - begin * _SPAN, first - end * _SPAN, -_SPAN)

    def _possible(self, *counters: range) -> Iterator[int]:
        return (counter for counter in chain(*counters) if 0 <= counter < 1 << COUNTER_BITS)

    def is_new(self, epoch: int, counter: int) -> bool:
        """Whether this counter was not heard before, and is not too old to know."""
        if epoch != self.epoch:
            return epoch > self.epoch
        behind = self.highest - counter
        return behind < 0 or (behind < WINDOW and not self.mask >> behind & 1)

    def accept(self, epoch: int, counter: int) -> int:
        """Remember a new, authentic counter; how many more frames are missing now (−1: one came late)."""
        if epoch > self.epoch:
            self.epoch, self.highest, self.mask = epoch, counter, 1
            return 0
        ahead = counter - self.highest
        if ahead < 0:
            self.mask |= 1 << -ahead
            return -1
        self.highest = counter
        self.mask = (self.mask << ahead | 1) & ((1 << WINDOW) - 1)
        return ahead - 1


Memory = dict[int, Heard]
