"""Whether satellite fixes are as good as they say: their track against the one that was walked.

A receiver that states 5 m and errs by 20 m draws another picture than the steps did. Whatever direction, place and
length the steps are off by is taken out by a fit over the last minute or two (lengths within what people's steps
are misjudged by: those are what fixes are to teach); what is left, against what the fixes state, tells by how much
they understate. Errors of fixes last, so a fit swallows part of them, and an honest receiver that is not quite so
good as it says is not suspected.
"""

import math
from collections import deque
from typing import NamedTuple

SPACING_NS = 2_000_000_000
_KEPT = 45  # fixes
_LEAST_FIXES = 6
_FITTED = 4.0  # parameters of the fit
_MOST_STRETCH = 1.3  # of the walked track, or its inverse
_SUSPECT = 1.5  # times what is stated
_LEAST_ACCURACY_M = 1.0
_STEPS_SHARE = 0.05  # by which parts of the walked track may be longer than others


class _Fix(NamedTuple):
    fixed_m: complex
    walked_m: complex
    sigma_m: float


class Honesty:
    """Judges fix after fix; places are complex, east + i·north, m."""

    def __init__(self) -> None:
        self._fixes: deque[_Fix] = deque(maxlen=_KEPT)
        self._walked_m = 0j
        self._last_ns: int | None = None

    def walk(self, length_m: float, azimuth_rad: float) -> None:
        """Another step."""
        self._walked_m += length_m * complex(math.sin(azimuth_rad), math.cos(azimuth_rad))

    def accuracy(self, time_ns: int, east_m: float, north_m: float, stated_m: float) -> float:
        """What a fix that states this accuracy is to be believed, m."""
        if self._last_ns is None or time_ns - self._last_ns >= SPACING_NS:
            self._last_ns = time_ns
            sigma_m = max(stated_m, _LEAST_ACCURACY_M) / math.sqrt(2.0)
            self._fixes.append(_Fix(complex(east_m, north_m), self._walked_m, sigma_m))
        return stated_m * self.understatement

    @property
    def understatement(self) -> float:
        """By what stated accuracies are to be multiplied; 1 while there is nothing to be said against them."""
        if len(self._fixes) < _LEAST_FIXES:
            return 1.0
        ratio = math.sqrt(self._misfit() / (2.0 * len(self._fixes) - _FITTED))
        return ratio if ratio > _SUSPECT else 1.0

    def _misfit(self) -> float:
        """The sum of squares, in sigmas, that a fit of the walked places to the fixes leaves."""
        weights = [fix.sigma_m**-2 for fix in self._fixes]
        total = sum(weights)
        fixed = sum(w * fix.fixed_m for w, fix in zip(weights, self._fixes, strict=True)) / total
        walked = sum(w * fix.walked_m for w, fix in zip(weights, self._fixes, strict=True)) / total
        apart = [(fix.fixed_m - fixed, fix.walked_m - walked) for fix in self._fixes]
        turned = sum(w * a * b.conjugate() for w, (a, b) in zip(weights, apart, strict=True))
        extent = sum(w * abs(b) ** 2 for w, (_, b) in zip(weights, apart, strict=True))
        turn = _bounded(turned / extent) if turned else 1.0 + 0j
        return sum(
            abs(a - turn * b) ** 2 / (w**-1 + (_STEPS_SHARE * abs(b)) ** 2)
            for w, (a, b) in zip(weights, apart, strict=True)
        )


def _bounded(factor: complex) -> complex:
    """Turn and stretch, the latter as far as steps may be misjudged."""
    stretch = min(max(abs(factor), 1.0 / _MOST_STRETCH), _MOST_STRETCH)
    return factor / abs(factor) * stretch
