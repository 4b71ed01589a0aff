"""Where steps are in the vertical acceleration: peaks that rise enough, as often as steps come, and regularly.

The signal is smoothed without delay of phase by a Hann window of 0.26 s, so a peak is known 0.12 s after it. A step
is the highest point between two troughs, each lower by the threshold, which follows the usual rise of this person;
a second peak within half the usual interval belongs to the same step. What begins must be regular: gestures and a
vehicle's jolts are not, so the first steps of a bout wait for the next two and are then all reported.
"""

import math
from collections import deque
from itertools import pairwise
from statistics import median

from pdr_engine.body.settings import StepSettings
from pdr_engine.body.steps.grid import CELL_NS

_TAPS = 13
_HANN = [0.5 - 0.5 * math.cos(2.0 * math.pi * (i + 1) / (_TAPS + 1)) for i in range(_TAPS)]
_WEIGHTS = [weight / sum(_HANN) for weight in _HANN]
_DELAY_NS = (_TAPS // 2) * CELL_NS
_REMEMBERED = 8
_NS = 1e-9


class Footfalls:
    """Finds steps cell by cell; times are those of the peaks."""

    def __init__(self, settings: StepSettings) -> None:
        self._settings = settings
        self._window: deque[float] = deque(maxlen=_TAPS)
        self._rises: deque[float] = deque(maxlen=_REMEMBERED)
        self._intervals_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._waiting: list[int] = []
        self._last_ns: int | None = None  # of the bout that is going on
        self.refused = 0
        self.restart()

    def restart(self) -> None:
        """The stream broke: what was rising is forgotten, and so is the bout."""
        self._window.clear()
        self._rising = False
        self._extreme, self._extreme_ns, self._foot = math.inf, 0, 0.0
        self._end_bout()

    def _end_bout(self) -> None:
        self.refused += len(self._waiting)
        self._waiting, self._last_ns = [], None
        self._rises.clear()
        self._intervals_s.clear()

    def take(self, time_ns: int, vertical_m_s2: float) -> list[tuple[int, int]]:
        """Take a cell; the steps that are sure now, as (start, end), UTC ns."""
        self._window.append(vertical_m_s2)
        if len(self._window) < _TAPS:
            return []
        now_ns = time_ns - _DELAY_NS
        value = sum(w * v for w, v in zip(_WEIGHTS, self._window, strict=True))
        self._forget_old(now_ns)
        peak = self._zigzag(now_ns, value)
        return [] if peak is None else self._judge(*peak)

    def _forget_old(self, now_ns: int) -> None:
        newest_ns = self._waiting[-1] if self._waiting else self._last_ns
        if newest_ns is not None and (now_ns - newest_ns) * _NS > self._settings.longest_s + 0.3:
            self._end_bout()

    def _threshold(self) -> float:
        usual = median(self._rises) if len(self._rises) > 2 else 0.0
        return max(self._settings.smallest_rise_m_s2, self._settings.share_of_usual_rise * usual)

    def _zigzag(self, now_ns: int, value: float) -> tuple[int, float] | None:
        """Follow peaks and troughs; a peak (its time and rise) once the signal has fallen below it."""
        further = value > self._extreme if self._rising else value < self._extreme
        if further:
            self._extreme, self._extreme_ns = value, now_ns
            return None
        if abs(value - self._extreme) < self._threshold():
            return None
        peak = (self._extreme_ns, self._extreme - self._foot) if self._rising else None
        if not self._rising:
            self._foot = self._extreme
        self._rising = not self._rising
        self._extreme, self._extreme_ns = value, now_ns
        return peak

    def _judge(self, peak_ns: int, rise: float) -> list[tuple[int, int]]:
        """Whether a peak is a step, and whether the bout is a walk."""
        before_ns = self._waiting[-1] if self._waiting else self._last_ns
        if before_ns is None:
            self._waiting = [peak_ns]
            return []
        interval_s = (peak_ns - before_ns) * _NS
        if interval_s < self._refractory_s():
            return []
        self._rises.append(rise)
        self._intervals_s.append(interval_s)
        if self._last_ns is not None:
            start_ns, self._last_ns = self._last_ns, peak_ns
            return [(start_ns, peak_ns)]
        self._waiting.append(peak_ns)
        return self._begin_bout()

    def _refractory_s(self) -> float:
        usual = median(self._intervals_s) if len(self._intervals_s) > 2 else 0.0
        return max(self._settings.shortest_s, self._settings.share_of_usual_interval * usual)

    def _begin_bout(self) -> list[tuple[int, int]]:
        """Report what waited once enough steps in a row are regular; drop the oldest while they are not."""
        wanted = self._settings.steps_to_begin
        if len(self._waiting) < wanted:
            return []
        intervals = [(b - a) * _NS for a, b in pairwise(self._waiting)]
        if max(intervals) > (1.0 + self._settings.irregularity) * min(intervals):
            self._waiting.pop(0)
            self.refused += 1
            return []
        times = [self._waiting[0] - round(median(intervals) / _NS), *self._waiting]
        self._waiting, self._last_ns = [], times[-1]
        return list(pairwise(times))
