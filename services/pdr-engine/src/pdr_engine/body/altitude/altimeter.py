"""Height from a barometer that knows how one walks (METHODS A8).

Pressure is treated by how height is won (`climb`): on the level it is weather and moves a drift
state; on slopes and in lifts height follows it; on stairs every step adds a riser, whose height is a state too,
learned within its norm. A Kalman filter of height, drift and riser runs `LAG_S` behind, when it is clear what the
way was; `height_m` is for now. Satellite or known heights correct height against drift.
"""

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from pdr_engine.body.altitude.climb import RISER_M, TICK_S, ClimbFilter, Way
from pdr_engine.body.movement.classes import Climb

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

LAG_S = 2.5
_HALF_WINDOW_S = 1.75
_NS_PER_S = 1_000_000_000
_TICK_NS = round(TICK_S * _NS_PER_S)
_KEPT_S = 2.0 * (LAG_S + _HALF_WINDOW_S)
_GAP_S = 10.0  # without pressure: what happened is unknown
SEA_LEVEL_PA, _SCALE_M, _EXPONENT = 101_325.0, 44_330.77, 0.190263  # ISO 2533, up to 11 km

_DRIFT_M_PER_SQRT_S = 0.05  # 35 Pa in √h: an unsettled day
_FOLLOW_M_PER_SQRT_S: dict[Way, float] = {"level": 0.012, "slope": 0.5, "stairs": 0.02, "lift": 1.5}
_RISER_SIGMA_M = 0.012
_STEP_SIGMA_M = 0.02
_LEAST_NOISE_M = 0.05
_UNKNOWN_M = 500.0
_HEIGHT, _DRIFT, _RISER = range(3)


def pressure_height_m(pressure_pa: float) -> float:
    """Height above sea level at which the standard atmosphere has this pressure."""
    return float(_SCALE_M * (1.0 - (pressure_pa / SEA_LEVEL_PA) ** _EXPONENT))


class Altimeter:
    """Height of a body-worn barometer, m above whatever `reference` said, or above where it began.

    Call `step` for each step as it ends and `pressure` for each sample; times in ns, each in order.
    """

    def __init__(self) -> None:
        self.climbing = ClimbFilter()
        self._filter = _fresh_filter()
        self._samples: deque[tuple[float, float]] = deque()  # s since the first, m
        self._steps: deque[float] = deque()
        self._zero_ns: int | None = None
        self._next_tick = 0
        self._noise_m = 0.15
        self._now = ClimbFilter()
        self._rate_m_s = 0.0
        self.reference_ns: int | None = None  # of the last height from outside

    def step(self, time_ns: int) -> None:
        """A step ended."""
        if self._zero_ns is not None:
            self._steps.append((time_ns - self._zero_ns) / _NS_PER_S)

    def pressure(self, time_ns: int, pressure_pa: float) -> None:
        """Take a sample in; what is not a pressure, or older than the last, is left out."""
        if not (math.isfinite(pressure_pa) and pressure_pa > 0.0):
            return
        height = pressure_height_m(pressure_pa)
        if self._zero_ns is None:
            self._zero_ns = time_ns
            self._filter.x = np.array([0.0, height, RISER_M])
        time_s = (time_ns - self._zero_ns) / _NS_PER_S
        if self._samples and time_s <= self._samples[-1][0]:
            return
        if self._samples and time_s - self._samples[-1][0] > _GAP_S:
            self._bridge(time_s)
        self._samples.append((time_s, height))
        while self._next_tick * TICK_S + LAG_S <= time_s:
            self._tick(self._next_tick * TICK_S)
            self._next_tick += 1
        self._forget(time_s)

    def reference(self, time_ns: int, height_m: float, sigma_m: float) -> None:
        """A height from satellites or from a known place, one sigma."""
        if self._zero_ns is None:
            return
        # The height of now is that of the tick and what was climbed since.
        since_m = self.height_m - float(self._filter.x[_HEIGHT])
        if self.reference_ns is None:
            self._filter.P[_HEIGHT, _HEIGHT] += _UNKNOWN_M**2
            self._filter.P[_DRIFT, _DRIFT] += _UNKNOWN_M**2
            self._filter.P[_HEIGHT, _DRIFT] -= _UNKNOWN_M**2
            self._filter.P[_DRIFT, _HEIGHT] -= _UNKNOWN_M**2
        self._filter.update(np.array([height_m - since_m]), R=sigma_m**2, H=np.array([[1.0, 0.0, 0.0]]))
        self.reference_ns = time_ns

    @property
    def height_m(self) -> float:
        """Height now: that of `LAG_S` ago, and what pressure says was climbed since unless that was level."""
        lagged = float(self._filter.x[_HEIGHT])
        if not self._samples or self._now.way == "level":
            return lagged
        tick_s = (self._next_tick - 1) * TICK_S
        return (
            lagged + self._mean(self._samples[-1][0] - 0.3, math.inf) - self._mean(tick_s - 0.3, tick_s + 0.3)
        )

    @property
    def settled_height_m(self) -> float:
        """Height `LAG_S` ago, by all that was known since."""
        return float(self._filter.x[_HEIGHT])

    @property
    def sigma_m(self) -> float:
        """Of the height, against the last reference."""
        return math.sqrt(float(self._filter.P[_HEIGHT, _HEIGHT]))

    @property
    def riser_m(self) -> float:
        """The stairs' riser as learned."""
        return float(self._filter.x[_RISER])

    @property
    def climb(self) -> Climb:
        """What stairs the last seconds show, for the movement class of the step now."""
        return self._now.climb

    @property
    def slope_rate_m_s(self) -> float:
        """How fast a slope rises that is walked on now; 0 on anything else."""
        return self._rate_m_s if self._now.way == "slope" else 0.0

    def _tick(self, at_s: float) -> None:
        rate, sigma = self._rate(at_s - _HALF_WINDOW_S, at_s + _HALF_WINDOW_S)
        self.climbing.update(rate, sigma, self._cadence(at_s - 1.5, at_s + 1.5))
        newest_s = at_s + LAG_S
        rate, sigma = self._rate(newest_s - 2.0, newest_s)
        self._now.update(rate, sigma, self._cadence(newest_s - 2.0, newest_s))
        self._rate_m_s = rate
        half = 0.5 * TICK_S
        self._predict(sum(at_s - half <= step_s < at_s + half for step_s in self._steps))
        seen = [height for time_s, height in self._samples if at_s - half <= time_s < at_s + half]
        if seen:
            noise = max(self._noise_m / math.sqrt(len(seen)), _LEAST_NOISE_M)
            self._filter.update(np.array([np.mean(seen)]), R=noise**2, H=np.array([[1.0, 1.0, 0.0]]))
            self._keep_to_norm()

    def _predict(self, steps: int) -> None:
        """Half a second on, with these steps."""
        way = self.climbing.way
        follow, risers = _FOLLOW_M_PER_SQRT_S[way], 0.0
        transition = np.eye(3)
        if way == "stairs":
            risers = float(steps) if self.climbing.up else -float(steps)
            transition[_HEIGHT, _RISER] = risers
        noise = np.diag(
            [follow**2 * TICK_S + abs(risers) * _STEP_SIGMA_M**2, _DRIFT_M_PER_SQRT_S**2 * TICK_S, 1e-8]
        )
        self._filter.predict(F=transition, Q=noise)

    def _keep_to_norm(self) -> None:
        """A riser is built within its norm, whatever pressure does."""
        spread = 3.0 * _RISER_SIGMA_M
        self._filter.x[_RISER] = np.clip(self._filter.x[_RISER], RISER_M - spread, RISER_M + spread)

    def _rate(self, from_s: float, to_s: float) -> tuple[float, float]:
        """Rate of climb over a window by least squares, and its sigma, m/s."""
        window = np.array([sample for sample in self._samples if from_s <= sample[0] <= to_s])
        if len(window) < 4:
            return 0.0, 1.0
        time_s, height = window.T
        centred = time_s - time_s.mean()
        rate = float(centred @ height / (centred @ centred))
        miss = height - height.mean() - rate * centred
        spread = float(np.sqrt(miss @ miss / (len(height) - 2)))
        self._noise_m += 0.02 * (spread - self._noise_m)
        return rate, self._noise_m / math.sqrt(float(centred @ centred))

    def _cadence(self, from_s: float, to_s: float) -> float:
        return sum(from_s <= step_s <= to_s for step_s in self._steps) / (to_s - from_s)

    def _mean(self, from_s: float, to_s: float) -> float:
        seen = [height for time_s, height in self._samples if from_s <= time_s <= to_s]
        return float(np.mean(seen)) if seen else self._samples[-1][1]

    def _bridge(self, time_s: float) -> None:
        """Over a gap anything may have been climbed: height follows the pressure, and is unsure."""
        gap_s = time_s - self._samples[-1][0]
        self._filter.P[_HEIGHT, _HEIGHT] += (0.5 * gap_s) ** 2
        self._samples.clear()
        self._next_tick = math.ceil((time_s - LAG_S) / TICK_S)

    def _forget(self, time_s: float) -> None:
        while self._samples and self._samples[0][0] < time_s - _KEPT_S:
            self._samples.popleft()
        while self._steps and self._steps[0] < time_s - _KEPT_S:
            self._steps.popleft()


def _fresh_filter() -> "KalmanFilter":
    from filterpy.kalman import KalmanFilter  # tens of megabytes: loaded only where there is a barometer

    kalman = KalmanFilter(dim_x=3, dim_z=1)
    kalman.x = np.zeros(3)
    kalman.P = np.diag([0.01, 0.09, _RISER_SIGMA_M**2])
    return kalman
