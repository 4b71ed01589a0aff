"""How evenly a person strides: what tells a walk from a vehicle's bouncing, step by step.

A stride is as long as the one before, to some percent, at any speed; left and right steps need not be. What a road
does to a vehicle's springs comes about as often as steps, but never as evenly, and never twice alike (`likeness`).
"""

from collections import deque
from collections.abc import Sequence
from statistics import median

_REMEMBERED = 16
EVEN = 0.12  # recorded and simulated walks: median 0.04, rides 0.26 to 0.34
_BROKEN, _FEW = 0.3, 14  # by so many: pauses and turns are uneven, too
_BROKEN_IN_DOUBT, _FEW_IN_DOUBT = 0.2, 8
_BROKEN_RISES = 0.25  # walks 0.03 to 0.25, rides 0.34 to 0.45
# Likeness of strides. Recorded walks: median 0.83, about 0.2 where they turn or halt; rides: mean 0.1, spread 0.2.
ALIKE, _MIDWAY = 0.45, 0.3
# Sums of what is above midway: where no walk is left to believe in, after that, and what a walk can save up.
_UNLIKE, _UNLIKE_ONCE, _MOST_ALIKE = -2.2, -1.2, 2.0


def unevenness(values: Sequence[float]) -> float:
    """Median of what values differ by from the last one of the same foot, as a share; 0 of too few."""
    changes = [abs(b - a) / (0.5 * (a + b)) for a, b in zip(values[:-2], values[2:], strict=True)]
    return median(changes) if changes else 0.0


class Rhythm:
    """The newest steps of one bout: how long they took, and how high they rose."""

    def __init__(self) -> None:
        self._intervals_s: deque[float] = deque(maxlen=_REMEMBERED + 2)
        self._rises: deque[float] = deque(maxlen=_REMEMBERED + 2)
        self._alike = 0.0  # a sequential test (Wald 1945), over all bouts

    def restart(self, intervals_s: Sequence[float] = ()) -> None:
        """A bout begins, with these intervals."""
        self._intervals_s.clear()
        self._intervals_s.extend(intervals_s)
        self._rises.clear()

    @property
    def proven(self) -> bool:
        """Whether strides have been so alike for so long that only legs can have made them."""
        return self._alike >= _MOST_ALIKE

    def take(self, interval_s: float, rise: float, alike: float | None, in_doubt: bool) -> bool:
        """Another step; whether this can still be a walk. ``in_doubt``: what came before was none.

        ``alike``: its stride's `likeness` to the one before, if there is one. A walk's steps may be uneven in time
        or in height, as a unit sits and as one goes, but not in both; and its strides are alike.
        """
        self._intervals_s.append(interval_s)
        self._rises.append(rise)
        if alike is not None and self._is_unlike(alike):
            return False
        few, broken = (_FEW_IN_DOUBT, _BROKEN_IN_DOUBT) if in_doubt else (_FEW, _BROKEN)
        if len(self._intervals_s) < few + 2 or unevenness(list(self._rises)) <= _BROKEN_RISES:
            return True
        return unevenness(list(self._intervals_s)) <= broken

    def _is_unlike(self, alike: float) -> bool:
        """Take a likeness in; whether strides have been too unlike for too long."""
        self._alike = min(self._alike + alike - _MIDWAY, _MOST_ALIKE)
        unlike = self._alike < _UNLIKE
        if unlike:
            self._alike = _UNLIKE_ONCE
        return unlike
