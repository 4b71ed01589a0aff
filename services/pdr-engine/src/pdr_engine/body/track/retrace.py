"""Back the same way: after a turn by 180° the way out tells where the way back leads (METHODS B6).

While the azimuths of the way back, less 180°, agree with those of the way out at the same distance, and it is
not longer, a person is taken to walk on the track they came by: whatever the azimuth's errors were on the way
out, the way back undoes them. As soon as the azimuths disagree, the steps that showed it are taken as they are.

What iron on the person does to a compass is not the same both ways, and a gyro drifts: the ways' azimuths differ by
degrees for hundreds of metres (`_Discord`). That comes slowly; who takes another way turns off within some steps.
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
# Who branches off is seen in the short window, who bears away by little in the long one.
_WINDOWS_STEPS = (8, 30)
_SIGMA_RAD = math.radians(9.0)  # of one step's azimuth against that of the way out
_SIGNIFICANT = 3.5  # sigmas: left once in some thousand steps for nothing
_AROUND_STEPS = 3  # on both sides of a step on the way out tell its azimuth
_NEIGHBOURS_STEPS = 5.0  # whose azimuth errors are alike: so many steps count as one
# What compass and gyro make the ways' azimuths differ by: at the turn, grown in a step, and ever.
_FIRST_SIGMA_RAD, _STEP_SIGMA_RAD, _USUAL_RAD = math.radians(2.5), math.radians(0.3), math.radians(12.0)
_MOST_STEPS = 50_000


@dataclass(frozen=True, slots=True)
class _Step:
    """One step as walked: its vector east, north (2,), its azimuth, and the arc of the whole way at its end."""

    vector_m: FloatArray
    azimuth_rad: float
    arc_m: float
    place_m: FloatArray


class _Discord:
    """By how much the azimuths of both ways differ for no other reason than compass and gyro: a Kalman filter.

    The difference goes its random walk and is drawn back to none (Gauss and Markov), so that it stays `_USUAL_RAD`.
    """

    def __init__(self) -> None:
        self.angle_rad, self.variance = 0.0, _FIRST_SIGMA_RAD**2
        self._keep = 1.0 - 0.5 * (_STEP_SIGMA_RAD / _USUAL_RAD) ** 2

    def step(self, difference_rad: float) -> None:
        """Take a step's difference in."""
        self.angle_rad *= self._keep
        self.variance = self._keep**2 * self.variance + _STEP_SIGMA_RAD**2
        noise = _NEIGHBOURS_STEPS * _SIGMA_RAD**2
        gain = self.variance / (self.variance + noise)
        self.angle_rad += gain * (difference_rad - self.angle_rad)
        self.variance *= 1.0 - gain

    @property
    def credible(self) -> bool:
        """Whether instruments can differ so much."""
        return abs(self.angle_rad) < _SIGNIFICANT * _USUAL_RAD


@dataclass(frozen=True, slots=True)
class _Back:
    """A step on the way back: where it began (2,), its vector (2,), its azimuth's difference to the way out's, and
    what was known of such differences before it."""

    place_m: FloatArray
    vector_m: FloatArray
    difference_rad: float
    usual_rad: float
    usual_variance: float


class Retrace:
    """Places of steps, with the way back laid on the way out.

    ``place_m`` (2,) east, north from where it began; ``active`` while on the way back; ``left`` counts how often
    the tracks disagreed. What is learned of a person's step length between way out and way back must not make the
    one longer than the other: both are measured in steps' lengths without it (``learned``, a factor in them).
    """

    def __init__(self, place_m: FloatArray | None = None) -> None:
        self.place_m: FloatArray = np.zeros(2) if place_m is None else place_m.copy()
        self.active = False
        self.left = 0
        self._arc_m = 0.0
        self._walked: list[_Step] = []
        self._outward: list[_Step] = []
        self._arcs: list[float] = []  # of the way out
        self._azimuths: list[float] = []  # of the way out, smoothed
        self._turned_at_m = 0.0  # arc of the way out where it was turned
        self._back_m = 0.0
        self._discord = _Discord()
        self._window: deque[_Back] = deque(maxlen=max(_WINDOWS_STEPS))

    def step(self, length_m: float, azimuth_rad: float, learned: float = 1.0) -> FloatArray:
        """One step on; the place (2,) then."""
        vector = length_m * np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
        self._arc_m += length_m / learned
        if self.active:
            self._follow(length_m / learned, azimuth_rad, vector)
        else:
            self.place_m = self.place_m + vector
        self._walked.append(_Step(vector, azimuth_rad, self._arc_m, self.place_m))
        if len(self._walked) > _MOST_STEPS:
            del self._walked[: _MOST_STEPS // 2]
        if not self.active:
            self._look_for_turn(learned)
        return self.place_m

    def published(self, length_m: float, azimuth_rad: float, learned: float = 1.0) -> tuple[float, float]:
        """As `step`, but the length and azimuth that lead from place to place."""
        before, was_active = self.place_m, self.active
        east, north = (self.step(length_m, azimuth_rad, learned) - before).tolist()
        if not was_active:
            return length_m, azimuth_rad
        length = math.hypot(east, north)
        return length, math.atan2(east, north) if length > 0.0 else azimuth_rad

    def _look_for_turn(self, learned: float) -> None:
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
                self._begin(first, learned)
                return

    def _begin(self, first: int, learned: float) -> None:
        """The way back began with this step."""
        self._outward = self._walked[:first]
        self._arcs = [step.arc_m for step in self._outward]
        self._azimuths = _smoothed(self._outward)
        self._turned_at_m = self._arcs[-1]
        # What was walked since the turn: as far as it leads away from the pivot.
        back = np.asarray(self._walked[-1].place_m - self._outward[-1].place_m)
        self._back_m = float(np.hypot(*back)) / learned
        self._window.clear()
        self._discord = _Discord()
        self.active = True

    def _follow(self, length_m: float, azimuth_rad: float, vector: FloatArray) -> None:
        self._back_m += length_m
        arc = self._turned_at_m - self._back_m
        if arc <= self._outward[0].arc_m:  # longer than the way out
            self._stop(self.place_m + vector)
            return
        usual, variance = self._discord.angle_rad, self._discord.variance
        difference = usual + self._difference(arc, azimuth_rad - usual)
        self._window.append(_Back(self.place_m, vector, difference, usual, variance))
        self._discord.step(difference)
        for steps in _WINDOWS_STEPS:
            recent = list(self._window)[-steps:]
            if _disagree(recent, steps) or not self._discord.credible:
                self.left += 1
                self._stop(recent[0].place_m + np.sum([step.vector_m for step in recent], axis=0))
                return
        self.place_m = self._place_at(arc)

    def _difference(self, arc_m: float, azimuth_rad: float) -> float:
        """Least difference of this azimuth, less 180°, to the way out around an arc."""
        slack = _SLACK_M + _SLACK_SHARE * self._back_m
        low, high = bisect_left(self._arcs, arc_m - slack), bisect_left(self._arcs, arc_m + slack)
        near = self._azimuths[low : max(high, low) + 1]
        turned = azimuth_rad - math.pi
        return min((math.remainder(turned - azimuth, math.tau) for azimuth in near), key=abs)

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


def _disagree(recent: list[_Back], window_steps: int) -> bool:
    """Whether the mean difference is off what was usual before; only of at least half a window."""
    count = len(recent)
    if count < window_steps // 2:
        return False
    independent = max(count / _NEIGHBOURS_STEPS, 1.0)
    variance = _SIGMA_RAD**2 / independent + recent[0].usual_variance + count * _STEP_SIGMA_RAD**2 / 3.0
    mean = float(np.mean([step.difference_rad for step in recent]))
    return abs(mean - recent[0].usual_rad) > _SIGNIFICANT * math.sqrt(variance)


def _smoothed(steps: list[_Step]) -> list[float]:
    """The azimuth around each step, so that the least difference to some of them is not that to the noisiest."""
    way = np.cumsum([np.zeros(2), *(step.vector_m for step in steps)], axis=0)
    ahead = np.minimum(np.arange(len(steps)) + 1 + _AROUND_STEPS, len(steps))
    behind = np.maximum(np.arange(len(steps)) - _AROUND_STEPS, 0)
    east, north = (way[ahead] - way[behind]).T
    return [math.atan2(x, y) for x, y in zip(east.tolist(), north.tolist(), strict=True)]


def _mean_azimuth(steps: list[_Step]) -> float:
    total = np.sum([step.vector_m for step in steps], axis=0)
    return math.atan2(float(total[0]), float(total[1]))
