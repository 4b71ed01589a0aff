"""The hard budget of a link: a token bucket in event time, in whole numbers, so that no rounding can leak a bit.

In every window of T seconds at most ``rate · T + depth`` bits go on the air, the link's header bytes included.
And one frame at a time: while the radio is still sending the last one, the next is not even made, since whatever
waits in a modem grows stale.
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
    """Bits that may be sent now; empty at start. Levels are in 1e-9 bit: rate in bit/s times ns is whole.

    ``depth``: bits, by `depth_bits` if None. ``channel_bits_per_s``: the radio's own rate, at which the last frame
    must have left before the next one goes; None if frames leave at once.
    """

    def __init__(
        self, rate_bits_per_s: int, depth: int | None = None, channel_bits_per_s: int | None = None
    ) -> None:
        self.rate_bits_per_s = rate_bits_per_s
        self.depth_bits = depth_bits(rate_bits_per_s) if depth is None else depth
        self.busy = False
        """The modem has not taken the last frame, or is not there: nothing is granted."""
        self.refused = False
        """Something had to wait since this was last set to False."""
        self._channel_bits_per_s = channel_bits_per_s
        self._level = 0
        self._earned = 0
        self._now_ns: int | None = None
        self._free_ns = 0

    def fill(self, now_ns: int) -> None:
        """Event time is ``now_ns``; the first call starts the clock, and time that goes back fills nothing."""
        if self._now_ns is None:
            self._now_ns = now_ns
        elapsed_ns = max(0, now_ns - self._now_ns)
        self._now_ns += elapsed_ns
        self._earned += self.rate_bits_per_s * elapsed_ns
        self._level = min(self._level + self.rate_bits_per_s * elapsed_ns, self.depth_bits * NS_PER_S)

    @property
    def free_bits(self) -> float:
        """Bits that may be sent now, as of the last `fill`."""
        return self._level / NS_PER_S

    @property
    def earned_bits(self) -> int:
        """All that came in since the start, spent, kept or run over."""
        return self._earned // NS_PER_S

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: nothing is gained by it, and nothing lost."""
        self._free_ns -= by_ns
        if self._now_ns is not None:
            self._now_ns -= by_ns

    def take(self, air_bytes: int, now_ns: int, keep_bits: int = 0) -> bool:
        """Pay for ``air_bytes`` (link header included) leaving ``keep_bits``; False if it cannot go now."""
        self.fill(now_ns)
        cost = 8 * air_bytes * NS_PER_S
        if self.busy or now_ns < self._free_ns or cost + keep_bits * NS_PER_S > self._level:
            self.refused = True
            return False
        self._level -= cost
        if self._channel_bits_per_s is not None:
            self._free_ns = now_ns + -(-cost // self._channel_bits_per_s)
        return True
