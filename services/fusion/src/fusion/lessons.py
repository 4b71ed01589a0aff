"""What a receiver's speed and course teach of the body's steps: how the unit sits, and how long steps are.

Doppler knows the way from one fix to the next within a decimetre, whatever the position's slow error. Laid over
what the body's steps tell of the same time it gives an angle and a ratio, as boots do where there are any.
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

_REMEMBERED = 64  # steps, and ways that wait for theirs
_LESSON_M = 30.0  # of way by steps
_LEAST_WAY_M = 0.3


@dataclass(slots=True)
class _Path:
    """Where the body's steps have led by themselves: (time, (2,) m) at their beginnings and ends."""

    points: deque[tuple[int, Array]] = field(default_factory=lambda: deque(maxlen=2 * _REMEMBERED))

    def go(self, step: BodyStep, moved: Array) -> None:
        last_ns, place = self.points[-1] if self.points else (step.start_time_ns, np.zeros(2))
        self.points.append((max(step.start_time_ns, last_ns), place))
        self.points.append((max(step.time_ns, last_ns), place + moved))

    def covers(self, until_ns: int) -> bool:
        return bool(self.points) and self.points[-1][0] >= until_ns

    def between(self, from_ns: int, until_ns: int) -> Array | None:
        """(2,) m; None if that is not remembered."""
        if not self.points or from_ns < self.points[0][0]:
            return None
        times = np.array([at - from_ns for at, _ in self.points], dtype=np.float64)
        places = np.array([place for _, place in self.points])
        start, end = (
            np.array([np.interp(at, times, places[:, axis]) for axis in (0, 1)])
            for at in (0.0, float(until_ns - from_ns))
        )
        return np.asarray(end - start)


@dataclass(slots=True)
class Lessons:
    """Ways by Doppler beside ways by steps, of all receivers."""

    _path: _Path = field(default_factory=_Path)
    _last: dict[str, tuple[int, Array]] = field(default_factory=dict)  # time and velocity, by receiver
    _waiting: deque[tuple[int, int, Array]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    _dot: float = 0.0
    _cross: float = 0.0
    _walked_m: float = 0.0
    _walked_m2: float = 0.0

    def fix(self, source: str, fix: GnssFix) -> None:
        """A fix of a receiver that is believed."""
        velocity, last = velocity_m_s(fix), self._last.pop(source, None)
        if velocity is None:
            return
        self._last[source] = fix.time_ns, velocity
        if last is not None and 0 < fix.time_ns - last[0] <= LONGEST_S * NS_PER_S:
            lasted_s = (fix.time_ns - last[0]) / NS_PER_S
            self._waiting.append((last[0], fix.time_ns, 0.5 * lasted_s * (velocity + last[1])))

    def step(self, step: BodyStep, moved: Array) -> Iterator[tuple[float, float]]:
        """A step that led (2,) m by itself; lessons: the angle from there to the truth, the ratio of lengths."""
        self._path.go(step, moved)
        while self._waiting and self._path.covers(self._waiting[0][1]):
            from_ns, until_ns, told = self._waiting.popleft()
            walked = self._path.between(from_ns, until_ns)
            if walked is not None and float(np.hypot(*walked)) >= _LEAST_WAY_M:
                self._lay(told, walked)
        if self._walked_m >= _LESSON_M:
            yield math.atan2(self._cross, self._dot), math.hypot(self._dot, self._cross) / self._walked_m2
            self._dot = self._cross = self._walked_m = self._walked_m2 = 0.0

    def _lay(self, told: Array, walked: Array) -> None:
        """One way beside the other: of all, least squares finds the turn and the scale."""
        self._dot += float(walked @ told)
        self._cross += float(walked[0] * told[1] - walked[1] * told[0])
        self._walked_m += float(np.hypot(*walked))
        self._walked_m2 += float(walked @ walked)
