"""What a receiver's speed and course tell: by Doppler, free of its position's slow errors (METHODS D9).

Between two fixes a second apart the receiver says how far it has gone, and so do the boots. The angle between the
two ways is the heading that boots do not know: metres of walking tell it, where positions that err together for
tens of seconds want tens of metres. Once a soldier is placed the same comparison holds the heading up to the door.
"""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.geodesy import wrap_angle
from bootprint.messages import GnssFix
from fusion.boots import Boots
from fusion.config import VelocityConfig
from fusion.filter import Measurement
from fusion.state import Array

LONGEST_S = 2.5  # between two fixes whose mean velocity stands for the way between
_LEAST_SPEED_M_S = 0.5  # a course of less is noise
_LEAST_WAY_M = 0.5
_SLOPPY_M = 0.1  # of a way by boots: sway, and poses a tenth of a second apart
_LAGGING_RAD = (
    0.35  # a receiver smooths, or coasts on: where boots have turned by more its course is of before
)


@dataclass(frozen=True, slots=True)
class Way:
    """From one fix to the next: (2,) m by the receiver in ENU, by boots in their frame; sigma of an axis, m."""

    told: Array
    walked: Array
    sigma_m: float


@dataclass
class Courses:
    """Takes the fixes of all receivers: what they tell of a heading."""

    config: VelocityConfig
    counters: Counter[str]
    _last: dict[str, tuple[int, Array]] = field(default_factory=dict)  # time and velocity, by receiver
    _fits: dict[str, "CourseFit"] = field(default_factory=dict)
    _walked: dict[str, Array] = field(default_factory=dict)  # the way before, (2,) m, by receiver

    def hear(self, boots: Boots, source: str, fix: GnssFix) -> tuple[float, float] | None:
        """Hold the heading of boots in ENU; of others the turn into ENU and its sigma, once it is known, rad."""
        way = self._way(boots, source, fix)
        if boots.in_enu:
            if way is not None:
                hold_heading(boots, way, self.config, self.counters)
            return None
        fit = self._fits.setdefault(source, CourseFit(self.config))
        if way is not None:
            fit.add(way)
        return fit.turn

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._last.clear()

    def _way(self, boots: Boots, source: str, fix: GnssFix) -> Way | None:
        """Since the receiver's fix before; None if that is too long ago, or one of them told no course."""
        velocity, last = velocity_m_s(fix), self._last.pop(source, None)
        alive = boots.alive(fix.time_ns)
        if velocity is None or not alive:
            return None
        self._last[source] = fix.time_ns, velocity
        lasted_s = 0.0 if last is None else (fix.time_ns - last[0]) / NS_PER_S
        if last is None or not 0.0 < lasted_s <= LONGEST_S:
            return None
        walked = (boots.place_at(fix.time_ns, alive) - boots.place_at(last[0], alive))[:2]
        before = self._walked.get(source)
        self._walked[source] = walked
        if before is None or _between(before, walked) > _LAGGING_RAD:
            return None
        return Way(0.5 * lasted_s * (velocity + last[1]), walked, self._sigma_m_s(fix) * lasted_s)

    def _sigma_m_s(self, fix: GnssFix) -> float:
        """Few satellites, low ones: what spoils a position spoils the velocity as much."""
        spoilt = (fix.horizontal_accuracy_m or 0.0) / self.config.clear_accuracy_m
        return max(fix.speed_accuracy_m_s or 0.0, self.config.sigma_m_s * max(1.0, spoilt))


def _between(one: Array, other: Array) -> float:
    """The angle between two ways, rad."""
    return abs(math.atan2(one[0] * other[1] - one[1] * other[0], float(one @ other)))


def velocity_m_s(fix: GnssFix) -> Array | None:
    """East and north (2,); None if the receiver tells none, or is too slow for a course."""
    if fix.speed_m_s is None or fix.course_rad is None or fix.speed_m_s < _LEAST_SPEED_M_S:
        return None
    return fix.speed_m_s * np.array([math.sin(fix.course_rad), math.cos(fix.course_rad)])


@dataclass
class CourseFit:
    """The turn from the boots frame into ENU, out of ways told by Doppler: least squares over all of them.

    With τ the ways told, w those walked, the turn is atan2(Σ w×τ, Σ w·τ), of variance σ²/Σ|w|²; what the ways do
    not agree about is counted into σ.
    """

    config: VelocityConfig
    dot: float = 0.0
    cross: float = 0.0
    told_m2: float = 0.0
    walked_m2: float = 0.0
    variances_m2: list[float] = field(default_factory=list)

    def add(self, way: Way) -> None:
        """One more way."""
        self.dot += float(way.walked @ way.told)
        self.cross += float(way.walked[0] * way.told[1] - way.walked[1] * way.told[0])
        self.told_m2 += float(way.told @ way.told)
        self.walked_m2 += float(way.walked @ way.walked)
        self.variances_m2.append(way.sigma_m**2 + _SLOPPY_M**2)

    @property
    def turn(self) -> tuple[float, float] | None:
        """Yaw and its sigma, rad; None before it is known to `VelocityConfig.placement_sigma_deg`."""
        count = len(self.variances_m2)
        if count < self.config.fewest or self.walked_m2 <= 0.0:
            return None
        left_m2 = self.told_m2 + self.walked_m2 - 2.0 * math.hypot(self.dot, self.cross)
        variance = max(float(np.mean(self.variances_m2)), left_m2 / (2.0 * count - 1.0))
        sigma = math.sqrt(self.config.repeats * variance / self.walked_m2 + self.config.lasting_rad**2)
        if sigma > math.radians(self.config.placement_sigma_deg):
            return None
        return math.atan2(self.cross, self.dot), sigma


def hold_heading(boots: Boots, way: Way, config: VelocityConfig, counters: Counter[str]) -> None:
    """Correct the yaw of the boots by one way, if they walked."""
    feet = [foot.block for foot in boots.everybody() if foot.active]
    walked_m = float(np.hypot(*way.walked))
    if not feet or walked_m < _LEAST_WAY_M:
        return
    angle = math.atan2(way.told[1], way.told[0]) - math.atan2(way.walked[1], way.walked[0])
    jacobian = np.zeros((1, boots.filter.state.size))
    for block in feet:
        jacobian[0, block.yaw] = 1.0 / len(feet)
    if float(jacobian[0] @ boots.filter.covariance @ jacobian[0]) <= config.lasting_rad**2:
        return  # courses tell no better
    noise = np.array([[(way.sigma_m**2 + _SLOPPY_M**2) / walked_m**2]])
    found = boots.correct(
        Measurement(
            "course",
            np.array([wrap_angle(angle)]),
            jacobian,
            config.repeats * noise,
            gate_noise=noise,
            gate_probability=config.gate_probability,
            directs=True,
        )
    )
    counters["courses_accepted" if found.accepted else "courses_rejected"] += 1
