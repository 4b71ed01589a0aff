"""When a hub that has just started may speak: a fresh epoch is its own only when the epoch's second is over.

`FileCounters` waits for that before it hands counters out. At the start the hub need not stand still meanwhile: it
listens, keeps its picture and tells of its health, and its nets hold back what is due. Later, in the middle of
speaking, there is nothing for it but to sleep.
"""

import time
from collections.abc import Callable


class FirstSecond:
    """The waits of all nets at a hub's start, side by side; times are host seconds (monotonic)."""

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock = clock
        self._sleep = sleep
        self._until_s: dict[str, float] = {}
        self._starting = True

    def waiting(self, net: str) -> Callable[[float], None]:
        """What a net's counters are to wait by: until the start is over it returns at once, and the net `waits`."""

        def wait(seconds: float) -> None:
            if self._starting:
                self._until_s[net] = self._clock() + seconds
            else:
                self._sleep(seconds)

        return wait

    def started(self) -> None:
        """All nets have their first counters."""
        self._starting = False

    def waits(self, net: str) -> bool:
        """Whether a net may not speak yet."""
        return self._clock() < self._until_s.get(net, 0.0)
