"""Height from a barometer that knows how one walks (METHODS A8).

Pressure is treated by how height is won (`climb`): on the level it is weather and moves a drift state; on slopes
and in lifts height follows it; on stairs every step adds a riser, whose height is a state too, learned within its
norm, and a storey is as high as it is told to be (`height_filter`). That filter runs `LAG_S` behind, when it is
clear what the way was; `height_m` is for now. Satellite or known heights correct height against drift.
"""

import math
from bisect import bisect
from collections import deque
from typing import NamedTuple

import numpy as np

from pdr_engine.body.altitude.climb import TICK_S, Belief, Tick, Way, advance, smoothed
from pdr_engine.body.altitude.height_filter import HeightFilter
from pdr_engine.body.altitude.vertical import VerticalChannel
from pdr_engine.body.movement.classes import Climb
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.settings import AltitudeSettings

_LAG_TICKS = 5
LAG_S = _LAG_TICKS * TICK_S
_NS_PER_S = 1_000_000_000
_GAP_S = 10.0  # without pressure: what happened is unknown
_STEP_AGE_S = 1.2  # since a step's end: later nobody walks
_SLOPE_WINDOW_S, _LEAST_IN_WINDOW = 2.0, 3
# Of a tick's mean: at first, and learned on the level; what climbs is no noise.
_NOISE_M, _LEAST_SIGMA_M, _NOISE_SHARE, _SURELY_LEVEL, _MOST_MISS = 0.08, 0.01, 0.03, 0.9, 2.5
SEA_LEVEL_PA, _SCALE_M, _EXPONENT = 101_325.0, 44_330.77, 0.190263  # ISO 2533, up to 11 km

_LEAST_NOISE_M = 0.12  # draughts and a unit's own wander last longer than a tick


def pressure_height_m(pressure_pa: float) -> float:
    """Height above sea level at which the standard atmosphere has this pressure."""
    return float(_SCALE_M * (1.0 - (pressure_pa / SEA_LEVEL_PA) ** _EXPONENT))


class _Sample(NamedTuple):
    """Seconds since the first, height by pressure alone, and as `VerticalChannel` holds it."""

    time_s: float
    pressure_m: float
    held_m: float


class Altimeter:
    """Height of a body-worn barometer, m above whatever `reference` said, or above where it began.

    Call `step` for each step as it ends and `pressure` for each sample; times in ns, each in order.
    """

    def __init__(self, settings: AltitudeSettings | None = None) -> None:
        self._settings = settings or AltitudeSettings()
        self._filter = self._begun_at(0.0)
        self._samples: deque[_Sample] = deque()
        self._steps: deque[float] = deque()
        self._zero_ns: int | None = None
        self._next_tick = 0
        self._noise_m = _NOISE_M
        self._means: deque[_Sample | None] = deque(maxlen=_LAG_TICKS)  # of the ticks not settled yet
        self._before: Belief | None = None  # up to the newest settled tick, by nothing later
        self._since: list[tuple[Belief, FloatArray]] = []  # of the ticks after it, with their likelihoods
        self._settled: Belief | None = None  # the same, by all that is known
        self._now: Belief | None = None
        self.reference_ns: int | None = None  # of the last height from outside

    def step(self, time_ns: int) -> None:
        """A step ended."""
        if self._zero_ns is not None:
            self._steps.append((time_ns - self._zero_ns) / _NS_PER_S)

    def pressure(self, time_ns: int, pressure_pa: float, channel: VerticalChannel | None = None) -> None:
        """Take a sample in; what is not a pressure, or older than the last, is left out.

        ``channel``: the unit's, which knows its accelerations.
        """
        if not (math.isfinite(pressure_pa) and pressure_pa > 0.0):
            return
        height = pressure_height_m(pressure_pa)
        if self._zero_ns is None:
            self._zero_ns = time_ns
            self._filter = self._begun_at(height)
        time_s = (time_ns - self._zero_ns) / _NS_PER_S
        if self._samples and time_s <= self._samples[-1].time_s:
            return
        if self._samples and time_s - self._samples[-1].time_s > _GAP_S:
            self._bridge(time_s)
        while (self._next_tick + 1) * TICK_S <= time_s:
            self._tick()
        held = height if channel is None else channel.hold(time_ns, height)
        self._samples.append(_Sample(time_s, height, held))

    def reference(self, time_ns: int, height_m: float, sigma_m: float) -> None:
        """A height from satellites or from a known place, one sigma."""
        if self._zero_ns is None:
            return
        # The height of now is that of the tick and what was climbed since.
        since_m = self.height_m - self._filter.height_m
        self._filter.reference(height_m - since_m, sigma_m)
        self.reference_ns = time_ns

    @property
    def height_m(self) -> float:
        """Height now: that of `LAG_S` ago, and what pressure says was climbed since unless that was level."""
        lagged = self._filter.height_m
        if not self._samples or self._now is None or self._now.way == "level":
            return lagged
        settled_s = self._settled_s
        return (
            lagged
            + self._mean(self._samples[-1].time_s - 0.3, math.inf)
            - self._mean(settled_s - 0.3, settled_s + 0.3)
        )

    @property
    def settled_height_m(self) -> float:
        """Height `LAG_S` ago, by all that was known since."""
        return self._filter.height_m

    @property
    def sigma_m(self) -> float:
        """Of the height, against the last reference."""
        return self._filter.sigma_m

    @property
    def riser_m(self) -> float:
        """The stairs' riser as learned."""
        return self._filter.riser_m

    @property
    def way(self) -> Way:
        """How height is won now."""
        return "level" if self._now is None else self._now.way

    @property
    def settled_way(self) -> Way:
        """How height was won `LAG_S` ago, by all that was known since."""
        return "level" if self._settled is None else self._settled.way

    def climb(self, height_m: float | None) -> Climb:
        """What stairs the last seconds show, for the movement class of the step that ends now.

        ``height_m``: the channel's, about a tick later than the middle of the last whole tick.
        """
        if self._now is None or self._zero_ns is None:
            return Climb(0.0, False)
        if height_m is None or not self._steps:
            return self._now.climb
        belief, _ = advance(self._now, Tick(height_m, self._noise_m, self._cadence_hz(self._steps[-1])))
        return belief.climb

    def climb_at(self, time_ns: int) -> Climb | None:
        """What stairs there were then, by all that is known by now; None if that is longer ago than `LAG_S`."""
        if self._zero_ns is None:
            return None
        tick = math.floor((time_ns - self._zero_ns) / _NS_PER_S / TICK_S)
        index = tick - (self._next_tick - len(self._since))
        if not 0 <= index < len(self._since):
            return None
        belief, _ = self._since[index]
        return smoothed(belief, [likelihood for _, likelihood in self._since[index + 1 :]]).climb

    @property
    def slope_rate_m_s(self) -> float:
        """How fast a slope rises that is walked on now; 0 on anything else."""
        if self.way != "slope":
            return 0.0
        newest_s = self._next_tick * TICK_S
        window = [
            (sample.time_s, sample.held_m)
            for sample in self._samples
            if sample.time_s >= newest_s - _SLOPE_WINDOW_S
        ]
        return _rate(np.array(window)) if len(window) > _LEAST_IN_WINDOW else 0.0

    @property
    def _settled_s(self) -> float:
        """The middle of the newest settled tick."""
        return (self._next_tick - _LAG_TICKS - 0.5) * TICK_S

    def _begun_at(self, pressure_m: float) -> HeightFilter:
        return HeightFilter(pressure_m, self._settings.storey_m, self._settings.storey_sigma_m)

    def _tick(self) -> None:
        """A tick is over: the belief about now, and the height of the tick that is settled by it."""
        oldest = self._means[0] if len(self._means) == _LAG_TICKS else None
        begin_s = self._next_tick * TICK_S
        seen = [sample for sample in self._samples if sample.time_s >= begin_s]
        mean = _Sample(*np.mean(seen, axis=0).tolist()) if seen else None
        if len(self._means) == _LAG_TICKS and self._before is not None:
            self._before, _ = advance(self._before, self._as_tick(0))
        self._means.append(mean)
        self._next_tick += 1
        if self._before is None:
            if mean is None:
                return
            self._before = Belief.at(mean.held_m, self._noise_m)
        self._look_back()
        if len(self._means) == _LAG_TICKS:
            self._settle(oldest)
        self._forget()

    def _look_back(self) -> None:
        """From the settled tick to now, by the steps as they are known by now."""
        assert self._before is not None
        self._learn_noise()
        belief, self._since = self._before, []
        for index in range(len(self._means)):
            belief, likelihood = advance(belief, self._as_tick(index))
            self._since.append((belief, likelihood))
        self._now = belief
        self._settled = smoothed(self._before, [likelihood for _, likelihood in self._since])

    def _learn_noise(self) -> None:
        """From what the newest tick differs by from the level that was walked on."""
        newest = self._means[-1]
        if newest is None or self._now is None or self._now.probability["level"] < _SURELY_LEVEL:
            return
        miss = min(abs(newest.held_m - float(self._now.height_m[0])), _MOST_MISS * self._noise_m)
        variance = self._noise_m**2 + _NOISE_SHARE * (miss**2 - self._noise_m**2)
        self._noise_m = max(math.sqrt(variance), _LEAST_SIGMA_M)

    def _as_tick(self, index: int) -> Tick:
        """One of the ticks that are not settled yet, the oldest first."""
        at_s = (self._next_tick - len(self._means) + index + 0.5) * TICK_S
        mean = self._means[index]
        return Tick(None if mean is None else mean.held_m, self._noise_m, self._cadence_hz(at_s))

    def _settle(self, mean: _Sample | None) -> None:
        """The height filter a tick on."""
        at_s, half = self._settled_s, 0.5 * TICK_S
        steps = sum(at_s - half <= step_s < at_s + half for step_s in self._steps)
        way = self.settled_way
        risers = variance = 0.0
        if self._settled is not None and self._may_be_stairs(self._settled):
            risers, variance = (steps * one for one in self._settled.risers_a_step)
        self._filter.predict(way, risers, variance)
        if mean is not None:
            self._filter.pressure(mean.pressure_m, max(self._noise_m, _LEAST_NOISE_M))
        self._filter.follow_climb(way)

    def _may_be_stairs(self, belief: Belief) -> bool:
        """Who hardly walks on the level has climbed some of the risers already."""
        way = belief.way
        return way == "stairs" or (way == "level" and belief.probability["level"] < _SURELY_LEVEL)

    def _cadence_hz(self, at_s: float) -> float:
        """Of the step that was under way, or had just ended, with the one before; 0 where nobody walked."""
        if len(self._steps) < 2:
            return 0.0
        index = min(max(bisect(self._steps, at_s), 1), len(self._steps) - 1)
        begin_s, end_s = self._steps[index - 1], self._steps[index]
        lasting_s = end_s - begin_s
        if lasting_s > _STEP_AGE_S or not begin_s - lasting_s <= at_s <= end_s + _STEP_AGE_S:
            return 0.0
        before_s = begin_s - self._steps[index - 2] if index > 1 else math.inf
        return 2.0 / (before_s + lasting_s) if before_s < _STEP_AGE_S else 1.0 / lasting_s

    def _mean(self, from_s: float, to_s: float) -> float:
        seen = [sample.held_m for sample in self._samples if from_s <= sample.time_s <= to_s]
        return float(np.mean(seen)) if seen else self._samples[-1].held_m

    def _bridge(self, time_s: float) -> None:
        """Over a gap anything may have been climbed: height follows the pressure, and is unsure."""
        gap_s = time_s - self._samples[-1].time_s
        self._filter.lose(0.5 * gap_s)
        self._samples.clear()
        self._means.clear()
        self._before = self._settled = self._now = None
        self._since.clear()
        self._next_tick = math.ceil(time_s / TICK_S)

    def _forget(self) -> None:
        oldest_s = (self._next_tick - 2 * _LAG_TICKS) * TICK_S
        while self._samples and self._samples[0].time_s < oldest_s:
            self._samples.popleft()
        while self._steps and self._steps[0] < oldest_s:
            self._steps.popleft()


def _rate(samples: FloatArray) -> float:
    """Rate of climb by least squares, m/s, of rows (s, m)."""
    time_s, height = samples.T
    centred = time_s - time_s.mean()
    return float(centred @ height / (centred @ centred))
