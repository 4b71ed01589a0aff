"""Back the same way: after a turn by 180° the way out tells where the way back leads (METHODS B6).

While the azimuths of the way back, less 180°, agree with those of the way out at the same distance, and it is
not longer, a person is taken to walk on the track they came by: whatever the azimuth's errors were on the way
out, the way back undoes them. As soon as the azimuths disagree, the steps that showed it are taken as they are.
"""

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

import numpy as np

from pdr_engine.body.pieces import FloatArray

_ABOUT_RAD = math.radians(150.0)  # a turn of at least so much is a turn about
_ABOUT_WITHIN_M = 4.0  # of way
# Ways back differ from ways out by the width of a corridor; dead reckoning of some percent is worse than that only
# where the way out was long.
LEAST_OUT_M = 150.0
_STEADY_STEPS = 3  # whose mean azimuth counts before and after it
_SLACK_M, _SLACK_SHARE = 1.5, 0.02  # by which both ways' distances may differ, and of the way back
_WINDOWS_STEPS = (
    8,
    30,
)  # who branches off is seen in the short one, who bears away by little in the long one
_SIGMA_RAD = math.radians(9.0)  # of one step's azimuth against that of the way out
_SIGNIFICANT = 3.5  # sigmas of the window's mean: left once in some thousand steps for nothing
_NEIGHBOURS_STEPS = 5.0  # whose azimuth errors are alike: so many steps count as one
_MOST_STEPS = 50_000


@dataclass(frozen=True, slots=True)
class _Step:
    """One step as walked: its vector east, north (2,), its azimuth, and the arc of the whole way at its end."""

    vector_m: FloatArray
    azimuth_rad: float
    arc_m: float
    place_m: FloatArray


class Retrace:
    """Places of steps, with the way back laid on the way out.

    ``place_m`` (2,) east, north from where it began; ``active`` while on the way back; ``left`` counts how often
    the tracks disagreed.
    """

    def __init__(self, place_m: FloatArray | None = None) -> None:
        self.place_m: FloatArray = np.zeros(2) if place_m is None else place_m.copy()
        self.active = False
        self.left = 0
        self._arc_m = 0.0
        self._walked: list[_Step] = []
        self._outward: list[_Step] = []
        self._arcs: list[float] = []  # of the way out
        self._turned_at_m = 0.0  # arc of the way out where it was turned
        self._back_m = 0.0
        self._window: deque[tuple[float, FloatArray, FloatArray]] = deque(maxlen=max(_WINDOWS_STEPS))

    def step(self, length_m: float, azimuth_rad: float) -> FloatArray:
        """One step on; the place (2,) then."""
        vector = length_m * np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
        self._arc_m += length_m
        if self.active:
            self._follow(length_m, azimuth_rad, vector)
        else:
            self.place_m = self.place_m + vector
        self._walked.append(_Step(vector, azimuth_rad, self._arc_m, self.place_m))
        if len(self._walked) > _MOST_STEPS:
            del self._walked[: _MOST_STEPS // 2]
        if not self.active:
            self._look_for_turn()
        return self.place_m

    def published(self, length_m: float, azimuth_rad: float) -> tuple[float, float]:
        """As `step`, but the length and azimuth that lead from place to place."""
        before, was_active = self.place_m, self.active
        east, north = (self.step(length_m, azimuth_rad) - before).tolist()
        if not was_active:
            return length_m, azimuth_rad
        length = math.hypot(east, north)
        return length, math.atan2(east, north) if length > 0.0 else azimuth_rad

    def _look_for_turn(self) -> None:
        """Whether the last steps lead back where the steps a little before came from."""
        if len(self._walked) < 3 * _STEADY_STEPS or self._arc_m - self._walked[0].arc_m < LEAST_OUT_M:
            return
        now = _mean_azimuth(self._walked[-_STEADY_STEPS:])
        since = self._arc_m - self._walked[-_STEADY_STEPS].arc_m
        for first in range(len(self._walked) - _STEADY_STEPS, _STEADY_STEPS - 1, -1):
            pivot = self._walked[first - 1]
            if self._arc_m - since - pivot.arc_m > _ABOUT_WITHIN_M:
                return
            before = _mean_azimuth(self._walked[first - _STEADY_STEPS : first])
            if abs(math.remainder(now - before, math.tau)) > _ABOUT_RAD:
                self._begin(first)
                return

    def _begin(self, first: int) -> None:
        """The way back began with this step."""
        self._outward = self._walked[:first]
        self._arcs = [step.arc_m for step in self._outward]
        self._turned_at_m = self._arcs[-1]
        # What was walked since the turn: as far as it leads away from the pivot.
        back = np.asarray(self._walked[-1].place_m - self._outward[-1].place_m)
        self._back_m = float(np.hypot(*back))
        self._window.clear()
        self.active = True

    def _follow(self, length_m: float, azimuth_rad: float, vector: FloatArray) -> None:
        self._back_m += length_m
        arc = self._turned_at_m - self._back_m
        if arc <= self._outward[0].arc_m:  # longer than the way out
            self._stop(self.place_m + vector)
            return
        self._window.append((self._difference(arc, azimuth_rad), self.place_m, vector))
        for steps in _WINDOWS_STEPS:
            recent = list(self._window)[-steps:]
            if _disagree([difference for difference, _, _ in recent], steps):
                self.left += 1
                self._stop(recent[0][1] + np.sum([step for _, _, step in recent], axis=0))
                return
        self.place_m = self._place_at(arc)

    def _difference(self, arc_m: float, azimuth_rad: float) -> float:
        """Least difference of this azimuth, less 180°, to the way out around an arc."""
        slack = _SLACK_M + _SLACK_SHARE * self._back_m
        low, high = bisect_left(self._arcs, arc_m - slack), bisect_left(self._arcs, arc_m + slack)
        near = self._outward[low : max(high, low) + 1]
        turned = azimuth_rad - math.pi
        return min((math.remainder(turned - step.azimuth_rad, math.tau) for step in near), key=abs)

    def _place_at(self, arc_m: float) -> FloatArray:
        """The way out at an arc (2,)."""
        after = min(max(bisect_left(self._arcs, arc_m), 1), len(self._outward) - 1)
        before, behind = self._outward[after - 1], self._outward[after]
        share = (arc_m - before.arc_m) / max(behind.arc_m - before.arc_m, 1e-9)
        return np.asarray(before.place_m + min(max(share, 0.0), 1.0) * (behind.place_m - before.place_m))

    def _stop(self, place_m: FloatArray) -> None:
        self.place_m, self.active = place_m, False
        self._outward, self._arcs = [], []
        # What lies behind is no way out any more: a new one begins here.
        self._walked = []


def _disagree(differences_rad: list[float], window_steps: int) -> bool:
    """Whether the mean difference is significant; only of at least half a window."""
    if len(differences_rad) < window_steps // 2:
        return False
    independent = max(len(differences_rad) / _NEIGHBOURS_STEPS, 1.0)
    return abs(float(np.mean(differences_rad))) > _SIGNIFICANT * _SIGMA_RAD / math.sqrt(independent)


def _mean_azimuth(steps: list[_Step]) -> float:
    total = np.sum([step.vector_m for step in steps], axis=0)
    return math.atan2(float(total[0]), float(total[1]))
