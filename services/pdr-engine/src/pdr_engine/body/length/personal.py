"""The person's own factor on step length, learned from satellite fixes while they are good (METHODS A1, C2).

Between two good fixes far enough apart the steps should lead as far as the fixes say; directions do not count, so
no heading has to be known. The logarithm of the factor is a scalar Kalman state; it starts with what the walks of
different people scatter by, and is held within bounds whatever the fixes say. With the neural network the factor
goes by gait: its logarithm is linear in the hidden layer's outputs, so the same fixes refine the output weights on
line, by a Kalman filter instead of gradient steps, and no walk can make them run away. What walking has shown says
nothing of the models of other movements: runs have a factor of their own, and so has all the rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bootprint.messages import Float64Array, MotionClass

PRIOR_SIGMA = 0.055
GAIT_SIGMA = 0.03  # of what a person's factor depends on the gait by, for each output of the hidden layer
OTHER_SIGMA = 0.12  # of the models of runs, and of what is neither walked nor run
MODEL_SIGMA = 0.02  # how far one stretch's factor is from the person's
MOST_LOG = math.log(1.25)
WALK_PER_STRETCH = 0.003  # shoes, load and tiredness change it
LEAST_DISTANCE_M = 50.0
WORST_ACCURACY_M = 5.0
LONGEST_STRETCH_S = 180.0
_GATE = 3.0
_RUN, _REST = -2, -1  # weights of what is not walked, behind the walker's
_NS = 1e-9


class Person(NamedTuple):
    """What the next walk begins with: the factor, the sigma of its logarithm, what is added to output weights."""

    scale: float
    sigma: float
    refinement: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Anchor:
    """A good fix, the track (2,) there, and by how much that grows with each weight (2, n)."""

    time_ns: int
    east_m: float
    north_m: float
    accuracy_m: float
    walked_m: Float64Array
    leaning_m: Float64Array


class PersonalScale:
    """Follows the factor; `factor` is what lengths are to be multiplied with.

    ``refinement``: for models whose steps come with features (`meet`), the weight of each to begin with.
    """

    def __init__(
        self, factor: float = 1.0, sigma: float = PRIOR_SIGMA, refinement: Sequence[float] = ()
    ) -> None:
        self._weights = np.array([math.log(factor), *refinement, 0.0, 0.0])
        refined = [GAIT_SIGMA] * len(refinement)
        self._variance = np.diag(np.square([sigma, *refined, OTHER_SIGMA, OTHER_SIGMA]))
        self._features = np.zeros(len(self._weights))
        self.meet([0.0] * len(refinement))
        self._walked = np.zeros(2)
        self._leaning = np.zeros((2, len(self._weights)))
        self._anchor: _Anchor | None = None
        self.stretches = self.refused = 0

    @property
    def factor(self) -> float:
        """The factor as it is known now, for the step at hand."""
        return math.exp(min(MOST_LOG, max(-MOST_LOG, float(self._features @ self._weights))))

    @property
    def sigma(self) -> float:
        """One sigma of its logarithm: a share of the length that all steps err by alike."""
        return math.sqrt(float(self._features @ self._variance @ self._features))

    @property
    def person(self) -> Person:
        """To be begun with the next time."""
        log, *refinement = self._weights[:_RUN].tolist()
        return Person(math.exp(log), math.sqrt(float(self._variance[0, 0])), tuple(refinement))

    def meet(self, features: Sequence[float], motion: MotionClass = "walking") -> None:
        """The next step's features, as many as there are refined weights; they count for walking."""
        self._features[:] = 0.0
        if motion == "walking":
            self._features[:_RUN] = (1.0, *features)
        else:
            self._features[_RUN if motion == "running" else _REST] = 1.0

    def walk(self, length_m: float, azimuth_rad: float) -> None:
        """Another step, with the factor in it."""
        step = length_m * np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
        self._walked = self._walked + step
        self._leaning = self._leaning + np.outer(step, self._features)

    def fix(self, time_ns: int, east_m: float, north_m: float, accuracy_m: float) -> None:
        """A satellite fix in a local frame; bad ones are passed over."""
        if accuracy_m > WORST_ACCURACY_M:
            return
        here = _Anchor(time_ns, east_m, north_m, max(accuracy_m, 1.0), self._walked, self._leaning)
        if self._anchor is None or (time_ns - self._anchor.time_ns) * _NS > LONGEST_STRETCH_S:
            self._anchor = here
        elif self._distance(here) >= LEAST_DISTANCE_M:
            self._learn(here)
            self._anchor = here

    def _distance(self, here: _Anchor) -> float:
        assert self._anchor is not None
        return math.hypot(here.east_m - self._anchor.east_m, here.north_m - self._anchor.north_m)

    def _learn(self, here: _Anchor) -> None:
        assert self._anchor is not None
        distance = self._distance(here)
        way = here.walked_m - self._anchor.walked_m
        walked = math.hypot(*way.tolist())
        if walked < 0.5 * LEAST_DISTANCE_M:
            self.refused += 1
            return
        self._variance[0, 0] += WALK_PER_STRETCH**2
        # The logarithm of the distance that the steps lead grows with each weight by the mean feature along it.
        by_weight = way @ (here.leaning_m - self._anchor.leaning_m) / walked**2
        noise = (here.accuracy_m**2 + self._anchor.accuracy_m**2) / distance**2 + MODEL_SIGMA**2
        total = float(by_weight @ self._variance @ by_weight) + noise
        innovation = math.log(distance / walked)
        if innovation**2 > _GATE**2 * total:
            self.refused += 1
            return
        gain = self._variance @ by_weight / total
        self._weights = np.clip(self._weights + gain * innovation, -MOST_LOG, MOST_LOG)
        self._variance = self._variance - np.outer(gain, by_weight @ self._variance)
        self.stretches += 1
