"""What a bit is worth now: a price that follows how full the bucket is.

A report is sent when its worth exceeds its bits times the price. The price rises exponentially as the bucket
empties, so bursts of motion are served at once but never drain it, and its level follows slowly what the squad's
motion and the budget make of it: from 75 bit/s to a megabit, for one soldier or five hundred.
"""

import math
from typing import Final

GAIN: Final = 4.0
"""e-folds of the price between a full and an empty bucket."""
SETTLING_S: Final = 60.0
"""Time in which the level moves by one e-fold for half a bucket's difference."""
CHEAPEST: Final = -6.0
DEAREST: Final = 4.0
_FIRST: Final = -3.0


class Pacing:
    """The price of a bit, in worth per bit."""

    def __init__(self) -> None:
        self._level = _FIRST
        self._fill = 0.5

    @property
    def price(self) -> float:
        """Worth that a bit must buy."""
        return math.exp(min(max(self._level + GAIN * (0.5 - self._fill), CHEAPEST), DEAREST))

    def passed(self, elapsed_s: float, fill: float) -> None:
        """So much time has passed, and the bucket is filled to this share, 0 to 1."""
        self._fill = fill
        level = self._level - (fill - 0.5) * 2.0 * elapsed_s / SETTLING_S
        self._level = min(max(level, CHEAPEST - GAIN / 2), DEAREST)
