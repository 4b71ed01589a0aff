"""Where steps are in the vertical acceleration: peaks that rise enough, as often as steps come, and regularly.

The signal is smoothed without delay of phase by a Hann window of 0.26 s, so a peak is known 0.12 s after it. A step
is the highest point between two troughs, each lower by the threshold, which follows the usual rise of this person;
a second peak within half the usual interval belongs to the same step. What begins must be regular: gestures and a
vehicle's jolts are not, so the first steps of a bout wait for the next two and are then all reported. A bout whose
`rhythm` breaks is none, and the next one has to be even, and its strides alike, for longer.
"""

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from statistics import mean, median
from typing import Protocol

from pdr_engine.body.settings import StepSettings
from pdr_engine.body.steps.grid import CELL_NS
from pdr_engine.body.steps.rhythm import ALIKE, EVEN, Rhythm, unevenness

_TAPS = 13
_HANN = [0.5 - 0.5 * math.cos(2.0 * math.pi * (i + 1) / (_TAPS + 1)) for i in range(_TAPS)]
_WEIGHTS = [weight / sum(_HANN) for weight in _HANN]
_DELAY_NS = (_TAPS // 2) * CELL_NS
_REMEMBERED, _FEW = 8, 3
_NS = 1e-9
_TWO_STRIDES = 5  # peaks


class AlikeStrides(Protocol):
    """Who knows how the body moved (`pdr_engine.body.steps.strides`)."""

    def likeness(self, peaks_ns: Sequence[int]) -> float:
        """How alike the two strides between five peaks (UTC ns) are, -1 to 1."""
        ...


class Footfalls:
    """Finds steps cell by cell; times are those of the peaks.

    ``strides`` tell how alike the two strides between five peaks are; without them only the vertical is judged.
    """

    def __init__(self, settings: StepSettings, strides: AlikeStrides | None = None) -> None:
        self._settings = settings
        self._strides = strides
        self._window: deque[float] = deque(maxlen=_TAPS)
        self._rises: deque[float] = deque(maxlen=_REMEMBERED)
        self._intervals_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._waiting: list[int] = []
        self._last_ns: int | None = None  # of the bout that is going on
        self._newest: deque[int] = deque(maxlen=_TWO_STRIDES)  # peaks of that bout
        self._rhythm = Rhythm()
        self._doubted_steps = 0  # until bouts begin as soon again
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
        self._newest.clear()
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
        usual = median(self._rises) if len(self._rises) >= _FEW else 0.0
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
        if interval_s < self._refractory_s(rise):
            return []
        self._rises.append(rise)
        self._intervals_s.append(interval_s)
        if self._last_ns is not None:
            return self._go_on(peak_ns, interval_s, rise)
        self._waiting.append(peak_ns)
        return self._begin_bout()

    def _refractory_s(self, rise: float) -> float:
        """Within which a peak of this rise is none of its own: what rises little is not run."""
        settings = self._settings
        shortest = settings.shortest_s if rise > settings.run_rise_m_s2 else settings.shortest_walk_s
        if len(self._intervals_s) < _FEW or rise > settings.share_of_usual_rise_soon * median(self._rises):
            return shortest
        return max(shortest, settings.share_of_usual_interval * median(self._intervals_s))

    def _go_on(self, peak_ns: int, interval_s: float, rise: float) -> list[tuple[int, int]]:
        """Another step of the bout, unless it turns out to be no walk: then only many even steps are one."""
        assert self._last_ns is not None
        self._newest.append(peak_ns)
        if not self._rhythm.take(interval_s, rise, self._alike(self._newest), self._doubted_steps > 0):
            self._end_bout()
            self._doubted_steps = self._settings.steps_until_trusted
            self._waiting = [peak_ns]
            return []
        self._doubted_steps = 0 if self._rhythm.proven else max(0, self._doubted_steps - 1)
        start_ns, self._last_ns = self._last_ns, peak_ns
        return [(start_ns, peak_ns)]

    def _begin_bout(self) -> list[tuple[int, int]]:
        """Report what waited once enough steps in a row are a walk; drop the oldest while they are not."""
        wanted = self._settings.steps_in_doubt if self._doubted_steps else self._settings.steps_to_begin
        if not self._doubted_steps and self._is_regular(wanted):
            self.refused += len(self._waiting) - wanted
            del self._waiting[:-wanted]
        elif len(self._waiting) < max(wanted, _TWO_STRIDES):
            return []
        elif not self._repeats():
            self._waiting.pop(0)
            self.refused += 1
            return []
        intervals = self._intervals()
        self._rhythm.restart(intervals)
        times = [self._waiting[0] - round(median(intervals) / _NS), *self._waiting]
        self._newest.extend(self._waiting)
        self._waiting, self._last_ns = [], times[-1]
        return list(pairwise(times))

    def _intervals(self) -> list[float]:
        """Between the peaks that wait, s."""
        return [(b - a) * _NS for a, b in pairwise(self._waiting)]

    def _is_regular(self, count: int) -> bool:
        """Whether the newest so many peaks come evenly."""
        intervals = self._intervals()[1 - count :]
        if len(intervals) < count - 1:
            return False
        return max(intervals) <= (1.0 + self._settings.irregularity) * min(intervals)

    def _repeats(self) -> bool:
        """Whether the strides that wait take as long and are alike; left and right steps need not be.

        So begins a walk in doubt, and one whose trunk is shaken more by one foot than by the other.
        """
        waiting = self._waiting
        spans = range(len(waiting) - _TWO_STRIDES + 1)
        found = [self._alike(waiting[first : first + _TWO_STRIDES]) for first in spans]
        known = [alike for alike in found if alike is not None]
        alike = mean(known) > ALIKE if known else self._doubted_steps > 0
        return alike and unevenness(self._intervals()) < EVEN

    def _alike(self, peaks_ns: Sequence[int]) -> float | None:
        """The likeness of the two strides between the peaks, if there are as many."""
        if self._strides is None or len(peaks_ns) < _TWO_STRIDES:
            return None
        return self._strides.likeness(list(peaks_ns))
