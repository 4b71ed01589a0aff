"""How a body-worn unit sits, and how long its wearer's steps are: one angle, and a factor for each kind of step.

Boots and satellites teach both. Satellites teach pdr-engine too, and what it knows by then is in the steps that it
tells (`taught_scale`, `taught_turn_rad`). Learned here is what the unit's *own* steps are off by, without that, or
the same error would be mended twice; until something has been learned here, pdr-engine's word counts. What walking
shows says nothing of runs, crawls and steps aside: each has another model of step length.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import BodyStep
from fusion.config import BodyConfig
from fusion.state import Array

_ASIDE = ("left", "right")


@dataclass(slots=True)
class Learned:
    """A number with its variance, learned from readings that each err by ``reading``; it wanders by ``wander``."""

    value: float
    variance: float
    reading: float
    wander: float
    heard: int = 0

    def hear(self, innovation: float) -> None:
        """One more reading, by how much it is above the value (a scalar Kalman filter)."""
        self.variance += self.wander**2
        gain = self.variance / (self.variance + self.reading**2)
        self.value += gain * innovation
        self.variance *= 1.0 - gain
        self.heard += 1


class Wearing:
    """Of one soldier's unit."""

    def __init__(self, config: BodyConfig) -> None:
        self._config = config
        self._turn = Learned(0.0, config.turn_sigma_rad**2, config.turn_reading_rad, config.turn_wander_rad)
        self._scales: dict[str, Learned] = {}
        self._taught_turn_rad = 0.0

    def meet(self, step: BodyStep) -> None:
        """Hear of the next step: what pdr-engine has been taught holds until something is learned here."""
        self._taught_turn_rad = step.taught_turn_rad
        if not self._turn.heard:
            self._turn.value = -step.taught_turn_rad
        scale = self._scale(kind(step))
        if not scale.heard:
            scale.value = step.taught_scale

    def hear(self, of_kind: str, angle_rad: float, ratio: float) -> None:
        """By how much steps should lead elsewhere, counter-clockwise, and how much longer, than `by_itself`."""
        if 0.5 < ratio < 2.0:
            scale = self._scale(of_kind)
            self._turn.hear(wrap_angle(angle_rad - self._turn.value))
            scale.hear(ratio - scale.value)

    def way(self, step: BodyStep) -> Array:
        """Where a step led, (2,) m, east and north, by all that is known."""
        yaw = 0.5 * math.pi - step.azimuth_rad + step.taught_turn_rad + self._turn.value
        length_m = self._scale(kind(step)).value * step.length_m / step.taught_scale
        return length_m * np.array([math.cos(yaw), math.sin(yaw)])

    def scale_variance(self, of_kind: str) -> float:
        """Of the factor on steps of a kind."""
        return self._scale(of_kind).variance

    @property
    def turn_variance(self) -> float | None:
        """Of the angle; None before anything was learned of it."""
        return self._turn.variance if self._turn.heard else None

    @property
    def turned(self) -> tuple[float, float]:
        """The angle, counter-clockwise, from the yaws that the unit tells to the boots', and its sigma, rad."""
        return wrap_angle(self._turn.value + self._taught_turn_rad), math.sqrt(self._turn.variance)

    def _scale(self, of_kind: str) -> Learned:
        config = self._config
        fresh = Learned(1.0, config.scale_sigma**2, config.scale_reading, config.scale_wander)
        return self._scales.setdefault(of_kind, fresh)


def kind(step: BodyStep) -> str:
    """Steps of a kind err alike in length."""
    return "aside" if step.direction in _ASIDE else step.motion


def by_itself(step: BodyStep) -> Array:
    """Where a step led, (2,) m, east and north, before satellites had taught pdr-engine anything."""
    azimuth_rad = step.azimuth_rad - step.taught_turn_rad
    return step.length_m / step.taught_scale * np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
