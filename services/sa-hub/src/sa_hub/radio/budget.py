"""The hard budget of a link: a token bucket in event time, in whole numbers, so that no rounding can leak a bit.

In every window of T seconds at most ``rate · T + depth`` bits go on the air, the link's header bytes included.
"""

from typing import Final

NS_PER_S: Final = 1_000_000_000
DEPTH_BITS: Final = 4000
SHORTEST_S: Final = 2
LONGEST_S: Final = 40


def depth_bits(rate_bits_per_s: int) -> int:
    """Depth of the bucket: rate × clamp(4000 / rate, 2 s, 40 s), in bits."""
    return min(max(DEPTH_BITS, SHORTEST_S * rate_bits_per_s), LONGEST_S * rate_bits_per_s)


class TokenBucket:
    """Bits that may be sent now; empty at start. Levels are in 1e-9 bit: rate in bit/s times ns is whole."""

    def __init__(self, rate_bits_per_s: int) -> None:
        self.rate_bits_per_s = rate_bits_per_s
        self.depth_bits = depth_bits(rate_bits_per_s)
        self._level = 0
        self._now_ns: int | None = None

    def fill(self, now_ns: int) -> None:
        """Event time is ``now_ns``; the first call starts the clock, and time that goes back fills nothing."""
        if self._now_ns is None:
            self._now_ns = now_ns
        elapsed_ns = max(0, now_ns - self._now_ns)
        self._now_ns += elapsed_ns
        self._level = min(self._level + self.rate_bits_per_s * elapsed_ns, self.depth_bits * NS_PER_S)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: nothing is gained by it, and nothing lost."""
        if self._now_ns is not None:
            self._now_ns -= by_ns

    def take(self, air_bytes: int, now_ns: int) -> bool:
        """Pay for ``air_bytes`` (link header included); False, and nothing spent, if that is too much now."""
        self.fill(now_ns)
        cost = 8 * air_bytes * NS_PER_S
        if cost > self._level:
            return False
        self._level -= cost
        return True
