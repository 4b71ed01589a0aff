"""The replay window: which of each sender's counters were heard already."""

from collections.abc import Iterator
from typing import Final

import msgspec

from sa_hub.radio.layout import COUNTER_LOW_BITS
from sa_hub.radio.quantise import unwrap

WINDOW: Final = 64
SPANS: Final = 4
"""Spans of 256 counters that are tried: a sender is heard again at once after some 900 lost frames."""


class Heard(msgspec.Struct):
    """What was heard of one sender on one net: epoch, highest counter, the 64 up to it (bit 0: the highest)."""

    epoch: int
    highest: int
    mask: int = 1

    def candidates(self, counter_low: int) -> Iterator[int]:
        """Counters with these low bits, the likeliest first: from 63 below the highest to 960 above it."""
        span = 1 << COUNTER_LOW_BITS
        first = unwrap(counter_low, COUNTER_LOW_BITS, self.highest - WINDOW + 1 + span // 2)
        return (counter for counter in range(first, first + SPANS * span, span) if counter >= 0)

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
