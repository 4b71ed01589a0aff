"""The person's own factor on step length, learned from satellite fixes while they are good (METHODS A1, C2).

Between two good fixes far enough apart the steps should lead as far as the fixes say; directions do not count, so
no heading has to be known. The logarithm of the factor is a scalar Kalman state; it starts with what the walks of
different people scatter by, and is held within bounds whatever the fixes say.
"""

import math
from dataclasses import dataclass

PRIOR_SIGMA = 0.055
MODEL_SIGMA = 0.02  # how far one stretch's factor is from the person's
MOST_LOG = math.log(1.25)
WALK_PER_STRETCH = 0.003  # shoes, load and tiredness change it
LEAST_DISTANCE_M = 50.0
WORST_ACCURACY_M = 5.0
LONGEST_STRETCH_S = 180.0
_GATE = 3.0
_NS = 1e-9


@dataclass(frozen=True, slots=True)
class _Anchor:
    time_ns: int
    east_m: float
    north_m: float
    accuracy_m: float
    walked_m: tuple[float, float]


class PersonalScale:
    """Follows the factor; `factor` is what lengths are to be multiplied with."""

    def __init__(self, factor: float = 1.0, sigma: float = PRIOR_SIGMA) -> None:
        self._log = math.log(factor)
        self._variance = sigma**2
        self._walked = (0.0, 0.0)
        self._anchor: _Anchor | None = None
        self.stretches = self.refused = 0

    @property
    def factor(self) -> float:
        """The factor as it is known now."""
        return math.exp(self._log)

    @property
    def sigma(self) -> float:
        """One sigma of its logarithm: a share of the length that all steps err by alike."""
        return math.sqrt(self._variance)

    def walk(self, length_m: float, azimuth_rad: float) -> None:
        """Another step, with the factor in it."""
        east, north = self._walked
        self._walked = (east + length_m * math.sin(azimuth_rad), north + length_m * math.cos(azimuth_rad))

    def fix(self, time_ns: int, east_m: float, north_m: float, accuracy_m: float) -> None:
        """A satellite fix in a local frame; bad ones are passed over."""
        if accuracy_m > WORST_ACCURACY_M:
            return
        here = _Anchor(time_ns, east_m, north_m, max(accuracy_m, 1.0), self._walked)
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
        (x, y), (x0, y0) = here.walked_m, self._anchor.walked_m
        walked = math.hypot(x - x0, y - y0)
        if walked < 0.5 * LEAST_DISTANCE_M:
            self.refused += 1
            return
        self._variance += WALK_PER_STRETCH**2
        noise = (here.accuracy_m**2 + self._anchor.accuracy_m**2) / distance**2 + MODEL_SIGMA**2
        innovation = math.log(distance / walked)
        if innovation**2 > _GATE**2 * (self._variance + noise):
            self.refused += 1
            return
        gain = self._variance / (self._variance + noise)
        self._log = min(MOST_LOG, max(-MOST_LOG, self._log + gain * innovation))
        self._variance *= 1.0 - gain
        self.stretches += 1
