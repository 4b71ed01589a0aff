"""What a receiver's speed and course teach of the body's steps: how the unit sits, and how long steps are.

Doppler knows the way from one fix to the next within a decimetre, whatever the position's slow error. Laid over
what the body's steps tell of the same time it gives an angle and a ratio, as boots do where there are any. Each
kind of step is taught by itself.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import BodyStep, GnssFix
from fusion.state import Array
from fusion.velocity import LONGEST_S, velocity_m_s
from fusion.wearing import by_itself, kind

_REMEMBERED = 64  # steps, and ways that wait for theirs
_LESSON_M = 30.0  # of way by steps
_LEAST_WAY_M = 0.3


@dataclass(slots=True)
class _Path:
    """Where steps have led by themselves: (time, (2,) m, kind) at their beginnings and ends."""

    points: deque[tuple[int, Array, str]] = field(default_factory=lambda: deque(maxlen=2 * _REMEMBERED))

    def go(self, step: BodyStep) -> None:
        of_kind = kind(step)
        last_ns, place, _ = self.points[-1] if self.points else (step.start_time_ns, np.zeros(2), of_kind)
        self.points.append((max(step.start_time_ns, last_ns), place, of_kind))
        self.points.append((max(step.time_ns, last_ns), place + by_itself(step), of_kind))

    def covers(self, until_ns: int) -> bool:
        return bool(self.points) and self.points[-1][0] >= until_ns

    def between(self, from_ns: int, until_ns: int) -> tuple[Array, str] | None:
        """(2,) m, and by steps of which kind; None if that is not remembered, or steps were of several."""
        if not self.points or from_ns < self.points[0][0]:
            return None
        times = np.array([at - from_ns for at, _, _ in self.points], dtype=np.float64)
        first, last = (int(np.searchsorted(times, at)) for at in (0.0, float(until_ns - from_ns)))
        kinds = {self.points[index][2] for index in range(first, last + 1)}
        if len(kinds) != 1:
            return None
        places = np.array([place for _, place, _ in self.points])
        start, end = (
            np.array([np.interp(at, times, places[:, axis]) for axis in (0, 1)])
            for at in (0.0, float(until_ns - from_ns))
        )
        return np.asarray(end - start), kinds.pop()


@dataclass(slots=True)
class _Sums:
    """Of ways by Doppler beside ways by steps of one kind."""

    dot: float = 0.0
    cross: float = 0.0
    walked_m: float = 0.0
    walked_m2: float = 0.0

    def lay(self, told: Array, walked: Array) -> None:
        """One way beside the other: of all, least squares finds the turn and the scale."""
        self.dot += float(walked @ told)
        self.cross += float(walked[0] * told[1] - walked[1] * told[0])
        self.walked_m += float(np.hypot(*walked))
        self.walked_m2 += float(walked @ walked)

    @property
    def turn_and_ratio(self) -> tuple[float, float]:
        """From the steps to the truth."""
        return math.atan2(self.cross, self.dot), math.hypot(self.dot, self.cross) / self.walked_m2


@dataclass(slots=True)
class Lessons:
    """Ways by Doppler beside ways by steps, of all receivers."""

    _path: _Path = field(default_factory=_Path)
    _last: dict[str, tuple[int, Array]] = field(default_factory=dict)  # time and velocity, by receiver
    _waiting: deque[tuple[int, int, Array]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    _sums: dict[str, _Sums] = field(default_factory=dict)  # by kind of step

    def fix(self, source: str, fix: GnssFix) -> None:
        """A fix of a receiver that is believed."""
        velocity, last = velocity_m_s(fix), self._last.pop(source, None)
        if velocity is None:
            return
        self._last[source] = fix.time_ns, velocity
        if last is not None and 0 < fix.time_ns - last[0] <= LONGEST_S * NS_PER_S:
            lasted_s = (fix.time_ns - last[0]) / NS_PER_S
            self._waiting.append((last[0], fix.time_ns, 0.5 * lasted_s * (velocity + last[1])))

    def step(self, step: BodyStep) -> Iterator[tuple[str, float, float]]:
        """Another step; lessons: of which kind of step, the angle from what it tells to the truth, the ratio."""
        self._path.go(step)
        while self._waiting and self._path.covers(self._waiting[0][1]):
            from_ns, until_ns, told = self._waiting.popleft()
            walked = self._path.between(from_ns, until_ns)
            if walked is not None and float(np.hypot(*walked[0])) >= _LEAST_WAY_M:
                self._sums.setdefault(walked[1], _Sums()).lay(told, walked[0])
        for of_kind in [name for name, sums in self._sums.items() if sums.walked_m >= _LESSON_M]:
            yield of_kind, *self._sums.pop(of_kind).turn_and_ratio
