"""Kalman filter of height, weather's drift, the stairs' riser and a storey's height (METHODS A8).

Storeys of a house are alike, as far as their height was told: who surely climbed one, up or down, by stairs or
lift, climbed as much as it is high, which takes back what the weather did meanwhile, and tells the riser.
"""

import math

import numpy as np

from pdr_engine.body.altitude.climb import RISER_M, TICK_S, Way
from pdr_engine.body.pieces import FloatArray

_HEIGHT, _DRIFT, _RISER, _FOOT, _STOREY = range(5)
_FOLLOW_M_PER_SQRT_S: dict[Way, float] = {"level": 0.012, "slope": 0.5, "stairs": 0.02, "lift": 1.5}
_BETWEEN_FLOORS: tuple[Way, ...] = ("stairs", "lift")  # slopes lead anywhere
_STAYING_TICKS = 8  # on the level: shorter is a landing
_RISER_SIGMA_M = 0.014  # from public stairs, 15 cm, to the Swiss norm's steepest, 19.6
_DRIFT_M_PER_SQRT_S = 0.07  # 50 Pa in √h: an unsettled day
_STEP_SIGMA_M = 0.02
_START_SIGMA_M, _START_DRIFT_M = 0.1, 0.3
_RISER_WANDER_M2 = 1e-8  # a prediction
_SIGMAS_OF_NORM = 3.0
_UNKNOWN_M = 500.0
_LEAST_CLIMB_M = 1.5  # less is no flight of stairs
_SAME_SIGMA_M = 0.1  # of storeys alike
_ANOTHER_PER_M = 0.03  # density of climbs that are none
_SURE = 0.8


class HeightFilter:
    """``height_m`` above zero or what `reference` said, with its ``sigma_m``; ``riser_m`` as it is learned."""

    def __init__(self, pressure_m: float, storey_m: float, storey_sigma_m: float) -> None:
        """``pressure_m`` is the height by pressure at zero; a storey is so high as far as is known."""
        self._mean: FloatArray = np.array([0.0, pressure_m, RISER_M, 0.0, storey_m])
        sigmas = np.array([_START_SIGMA_M, _START_DRIFT_M, _RISER_SIGMA_M, 0.0, storey_sigma_m])
        self._covariance: FloatArray = np.diag(sigmas**2)
        self._stay()
        self._referred = False
        self._level_ticks = 0
        self._climbs = False  # by what leads between floors, and not known as a storey yet

    @property
    def height_m(self) -> float:
        """Of the newest prediction."""
        return float(self._mean[_HEIGHT])

    @property
    def sigma_m(self) -> float:
        """Of the height, against the last reference."""
        return math.sqrt(float(self._covariance[_HEIGHT, _HEIGHT]))

    @property
    def riser_m(self) -> float:
        """The stairs' riser."""
        return float(self._mean[_RISER])

    @property
    def storey_m(self) -> float:
        """The height of a storey."""
        return float(self._mean[_STOREY])

    def predict(self, way: Way, risers: float, risers_variance: float) -> None:
        """A tick on, over so many risers (down: negative)."""
        transition = np.eye(len(self._mean))
        transition[_HEIGHT, _RISER] = risers
        self._mean = transition @ self._mean
        self._covariance = transition @ self._covariance @ transition.T
        steps = abs(risers) * _STEP_SIGMA_M**2 + risers_variance * self.riser_m**2
        self._covariance[_HEIGHT, _HEIGHT] += _FOLLOW_M_PER_SQRT_S[way] ** 2 * TICK_S + steps
        self._covariance[_DRIFT, _DRIFT] += _DRIFT_M_PER_SQRT_S**2 * TICK_S
        self._covariance[_RISER, _RISER] += _RISER_WANDER_M2

    def pressure(self, pressure_m: float, sigma_m: float) -> None:
        """Height by pressure: height and drift."""
        self._update(self._row(_HEIGHT, _DRIFT), pressure_m, sigma_m**2)
        # A riser is built within its norm, whatever pressure does.
        spread = _SIGMAS_OF_NORM * _RISER_SIGMA_M
        self._mean[_RISER] = np.clip(self._mean[_RISER], RISER_M - spread, RISER_M + spread)

    def reference(self, height_m: float, sigma_m: float) -> None:
        """Height by satellites or a known place; before the first, only differences are known."""
        if not self._referred:
            together = self._row(_HEIGHT, _FOOT) - self._row(_DRIFT)
            self._covariance += _UNKNOWN_M**2 * np.outer(together, together)
            self._referred = True
        self._update(self._row(_HEIGHT), height_m, sigma_m**2)

    def lose(self, sigma_m: float) -> None:
        """Anything of this sigma may have been climbed."""
        self._covariance[_HEIGHT, _HEIGHT] += sigma_m**2

    def follow_climb(self, way: Way) -> None:
        """By stairs or lift: begun where somebody stayed, and perhaps a storey where it ends."""
        if way != "level":
            self._climbs |= way in _BETWEEN_FLOORS
            self._level_ticks = 0
            return
        self._level_ticks += 1
        if self._level_ticks == 1 and self._climbs:
            self._climbs = not self._know_storey()
        if self._level_ticks >= _STAYING_TICKS:
            self._climbs = False
            self._stay()

    def _stay(self) -> None:
        """No climb is under way: the next begins here."""
        self._mean[_FOOT] = self._mean[_HEIGHT]
        self._covariance[_FOOT] = self._covariance[_HEIGHT]
        self._covariance[:, _FOOT] = self._covariance[:, _HEIGHT]

    def _know_storey(self) -> bool:
        """Whether what was climbed since the last stay is surely a storey; if so, it becomes as high as one."""
        climbed = self._row(_HEIGHT) - self._row(_FOOT)
        climbed_m = float(climbed @ self._mean)
        if abs(climbed_m) < _LEAST_CLIMB_M:
            return False
        apart = math.copysign(1.0, climbed_m) * climbed - self._row(_STOREY)
        likeness = self._likeness(apart)
        if likeness <= _SURE * (likeness + _ANOTHER_PER_M):
            return False
        self._update(apart, 0.0, _SAME_SIGMA_M**2)
        return True

    def _likeness(self, row: FloatArray) -> float:
        """Density, per m, of what should be nothing at what it is."""
        variance = float(row @ self._covariance @ row) + _SAME_SIGMA_M**2
        return math.exp(-0.5 * float(row @ self._mean) ** 2 / variance) / math.sqrt(2.0 * math.pi * variance)

    def _row(self, *states: int) -> FloatArray:
        row = np.zeros(len(self._mean))
        row[list(states)] = 1.0
        return row

    def _update(self, row: FloatArray, measured: float, variance: float) -> None:
        gain = self._covariance @ row
        gain /= float(row @ gain) + variance
        self._mean = self._mean + gain * (measured - float(row @ self._mean))
        keep = np.eye(len(row)) - np.outer(gain, row)
        self._covariance = keep @ self._covariance @ keep.T + variance * np.outer(gain, gain)
