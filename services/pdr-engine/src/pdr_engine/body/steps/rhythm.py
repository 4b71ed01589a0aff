"""How evenly a person strides: what tells a walk from a vehicle's bouncing, step by step.

A stride is as long as the one before, to some percent, at any speed; left and right steps need not be. What a road
does to a vehicle's springs comes about as often as steps, but never as evenly.
"""

from collections import deque
from collections.abc import Sequence
from statistics import median

_REMEMBERED = 16
EVEN = 0.12  # recorded and simulated walks: median 0.04, rides 0.26 to 0.34
_BROKEN, _FEW = 0.3, 14  # by so many: pauses and turns are uneven, too
_BROKEN_IN_DOUBT, _FEW_IN_DOUBT = 0.2, 8
_BROKEN_RISES = 0.25  # walks 0.03 to 0.25, rides 0.34 to 0.45


def unevenness(values: Sequence[float]) -> float:
    """Median of what values differ by from the last one of the same foot, as a share; 0 of too few."""
    changes = [abs(b - a) / (0.5 * (a + b)) for a, b in zip(values[:-2], values[2:], strict=True)]
    return median(changes) if changes else 0.0


class Rhythm:
    """The newest steps of one bout: how long they took, and how high they rose."""

    def __init__(self) -> None:
        self._intervals_s: deque[float] = deque(maxlen=_REMEMBERED + 2)
        self._rises: deque[float] = deque(maxlen=_REMEMBERED + 2)

    def restart(self, intervals_s: Sequence[float] = ()) -> None:
        """A bout begins, with these intervals."""
        self._intervals_s.clear()
        self._intervals_s.extend(intervals_s)
        self._rises.clear()

    def take(self, interval_s: float, rise: float, in_doubt: bool) -> bool:
        """Another step; whether this can still be a walk. ``in_doubt``: what came before was none.

        A walk's steps may be uneven in time or in height, as a unit sits and as one goes, but not in both.
        """
        self._intervals_s.append(interval_s)
        self._rises.append(rise)
        few, broken = (_FEW_IN_DOUBT, _BROKEN_IN_DOUBT) if in_doubt else (_FEW, _BROKEN)
        if len(self._intervals_s) < few + 2 or unevenness(list(self._rises)) <= _BROKEN_RISES:
            return True
        return unevenness(list(self._intervals_s)) <= broken
