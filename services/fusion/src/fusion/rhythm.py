"""When a steady source speaks next, so that nobody waits for a receiver of one fix a second between two of them."""

from collections import deque
from typing import Final

from bootprint.clock import NS_PER_S

_OF_LAST: Final = 4
"""Intervals that make a rhythm: no turn comes before the shortest, and none is missed before the longest."""
_EARLIEST: Final = 0.8
"""Of an interval: clocks jitter."""
_MISSED: Final = 3
"""Intervals without a word: two turns were missed."""
_LEAST_SILENCE_NS: Final = NS_PER_S
"""What is shorter may be a delay."""
_UNKNOWN_NS: Final = NS_PER_S
"""The interval of who has not told one: most receivers'."""


class Rhythm:
    """The intervals between one source's messages, in their order."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._intervals_ns: deque[int] = deque(maxlen=_OF_LAST)
        self._interval_ns: int | None = None
        self._longest_ns: int | None = None

    def hear(self, time_ns: int) -> None:
        """The next message has this stamp; one that does not advance tells nothing."""
        if self._last_ns is not None and time_ns <= self._last_ns:
            return
        if self._last_ns is not None:
            self._intervals_ns.append(time_ns - self._last_ns)
        self._last_ns = time_ns
        if len(self._intervals_ns) == _OF_LAST:
            self._interval_ns = min(self._intervals_ns)
            self._longest_ns = max(self._intervals_ns)

    @property
    def is_kept(self) -> bool:
        """Whether enough messages have come to tell it."""
        return self._interval_ns is not None

    @property
    def rest_ns(self) -> int:
        """So long after its last message comes no other."""
        return round(_EARLIEST * (self._interval_ns or 0))

    def is_over(self, silence_ns: int) -> bool:
        """Whether a source that has been silent for so long is not to be waited for."""
        return silence_ns > max(_MISSED * (self._longest_ns or _UNKNOWN_NS), _LEAST_SILENCE_NS)
