"""How long a step is: selectable models of frequency, vertical motion and variance, each for level ground.

A quick turn shortens the step (METHODS B6), a slope its projection (A2); the person's own factor is `personal`'s. A
run's flight breaks the pendulum: runs go by frequency alone, with coefficients of their own.
"""

import math
from collections.abc import Callable

from bootprint.messages import Direction, MotionClass
from pdr_engine.body.length.network_weights import NETWORK
from pdr_engine.body.length.turns import stride_share
from pdr_engine.body.settings import LengthSettings, StepLength
from pdr_engine.body.steps.gait import Gait

SHORTEST_M, LONGEST_M = 0.1, 2.5
REFERENCE_LEG_M = 0.9
_LEAST_LEFT = 0.2  # of a step in the quickest turn
_MEMORY_STEPS = 200.0
_FIRST_EVIDENCE, _FIRST_STEPS = -0.6, 20.0  # a hand until told otherwise: the smaller factor
_SURE_EVIDENCE, _SURE_STEPS = 0.25, 60.0
# Midway between hands and trunks as recorded, and how far each is from there.
_SURGE, _SURGE_SPREAD = 0.54, 0.12
_SHARPNESS, _SHARPNESS_SPREAD = 1.5, 0.25


class Placement:
    """How much of the trunk's rise the unit shows, told from how it surges and how hard it is struck.

    A trunk surges more than half as hard as it bounces, and feels every heel strike (recorded on a chest: surge
    0.6 to 0.85, sharpness 1.6 to 1.7); an arm passes the bounce on, strengthened, but swallows surge and strikes
    (recorded in hands: 0.2 to 0.4 and 1.1 to 1.4).
    """

    def __init__(self, settings: LengthSettings) -> None:
        self._settings = settings
        self._evidence = self._strikes = _FIRST_EVIDENCE
        self._steps = _FIRST_STEPS

    def learn(self, gait: Gait) -> None:
        """Take another step in."""
        surge = (gait.surge_share - _SURGE) / _SURGE_SPREAD
        strikes = (gait.sharpness - _SHARPNESS) / _SHARPNESS_SPREAD
        self._steps = min(self._steps + 1.0, _MEMORY_STEPS)
        self._evidence += (_bounded(0.5 * (surge + strikes)) - self._evidence) / self._steps
        self._strikes += (_bounded(strikes) - self._strikes) / self._steps

    @property
    def on_trunk(self) -> bool:
        """Whether the unit is known to be fixed to the trunk: told so, or by many steps that leave no doubt.

        By strikes alone: at the small of the back a brisk walker's surge is no more than a hand's.
        """
        if self._settings.placement != "auto":
            return self._settings.placement == "trunk"
        return self._steps >= _SURE_STEPS and self._strikes > _SURE_EVIDENCE

    @property
    def pendulum_factor(self) -> float:
        """What to multiply the pendulum's length with."""
        hand, trunk = self._settings.hand_factor, self._settings.trunk_factor
        told = min(1.0, max(0.0, 0.5 + self._evidence))
        share = {"hand": 0.0, "trunk": 1.0, "auto": told}[self._settings.placement]
        return hand + share * (trunk - hand)


def _bounded(evidence: float) -> float:
    """One step's, which may be a stumble."""
    return min(1.0, max(-1.0, evidence))


def pendulum(gait: Gait, settings: LengthSettings, factor: float, runs: bool) -> float:
    """Zijlstra and Hof (2003): the stance leg is an inverted pendulum, the trunk rises h on an arc of radius l.

    Half the step's chord then is √(2 l h − h²).
    """
    rise = min(gait.rise_m, settings.leg_length_m)
    return factor * 2.0 * math.sqrt(2.0 * settings.leg_length_m * rise - rise**2)


def frequency(gait: Gait, settings: LengthSettings, factor: float, runs: bool) -> float:
    """METHODS A1: a + b · frequency, by class, scaled by leg length."""
    if runs:
        length = settings.run_offset_m + settings.run_slope_m_s * gait.frequency_hz
    else:
        length = settings.frequency_offset_m + settings.frequency_slope_m_s * gait.frequency_hz
    return max(SHORTEST_M, length * settings.leg_length_m / REFERENCE_LEG_M)


def weinberg(gait: Gait, settings: LengthSettings, factor: float, runs: bool) -> float:
    """Weinberg (2002), Analog Devices AN-602: the fourth root of the vertical acceleration's range."""
    return settings.weinberg_factor * float(gait.range_m_s2**0.25)


def blend(gait: Gait, settings: LengthSettings, factor: float, runs: bool) -> float:
    """Pendulum and frequency, their logarithms averaged with weights by precision; of runs frequency alone."""
    if runs:
        return frequency(gait, settings, factor, runs)
    weight = settings.pendulum_weight
    return float(
        pendulum(gait, settings, factor, runs) ** weight
        * frequency(gait, settings, factor, runs) ** (1.0 - weight)
    )


def network(gait: Gait, settings: LengthSettings, factor: float, runs: bool) -> float:
    """METHODS C2, on level ground; see `StepLengths.on_slope`."""
    return NETWORK.length_m(gait.frequency_hz, gait.variance_m2_s4, 0.0)


_MODELS: dict[StepLength, Callable[[Gait, LengthSettings, float, bool], float]] = {
    "blend": blend,
    "pendulum": pendulum,
    "frequency": frequency,
    "weinberg": weinberg,
    "network": network,
}


class StepLengths:
    """The length of step after step of one person."""

    def __init__(self, model: StepLength, settings: LengthSettings) -> None:
        self._name, self._model = model, _MODELS[model]
        self._settings = settings
        self._placement = Placement(settings)

    def length(
        self,
        gait: Gait,
        turn_rate_rad_s: float,
        motion: MotionClass = "walking",
        direction: Direction = "forward",
    ) -> float:
        """On the level, m: by class, shortened by a turn."""
        settings = self._settings
        leg = settings.leg_length_m / REFERENCE_LEG_M
        if motion == "stairs":
            return settings.stair_step_m
        if motion == "crawling":
            return settings.crawl_step_m * leg
        if direction in ("left", "right"):
            return settings.side_step_m * leg
        return self._walking_length(gait, turn_rate_rad_s, motion == "running")

    def on_slope(self, level_m: float, gait: Gait, slope_rad: float) -> float:
        """A level step's length along a slope: only the network knows of it (C2's inclination)."""
        if self._name != "network" or not slope_rad:
            return level_m
        steep, level = (
            NETWORK.length_m(gait.frequency_hz, gait.variance_m2_s4, angle) for angle in (slope_rad, 0.0)
        )
        return level_m * steep / level

    def features(self, gait: Gait, slope_rad: float) -> tuple[float, ...]:
        """What a person's own weights refine: the network's hidden layer; nothing of other models."""
        if self._name != "network":
            return ()
        return NETWORK.layer(gait.frequency_hz, gait.variance_m2_s4, slope_rad)

    def refined(self, known: tuple[float, ...]) -> tuple[float, ...]:
        """A person's weights for `features`: the known ones if they are as many, else none of them differ yet."""
        count = len(NETWORK.hidden) if self._name == "network" else 0
        return known if len(known) == count else (0.0,) * count

    def learn(self, gait: Gait) -> None:
        """Take a step forward in, for where the unit is worn."""
        self._placement.learn(gait)

    @property
    def learned(self) -> float:
        """The factor in walking lengths that comes from what was learned of where the unit is worn."""
        share = {"pendulum": 1.0, "blend": self._settings.pendulum_weight}.get(self._name, 0.0)
        return float((self._placement.pendulum_factor / self._settings.hand_factor) ** share)

    @property
    def on_trunk(self) -> bool:
        """See `Placement`."""
        return self._placement.on_trunk

    def _walking_length(self, gait: Gait, turn_rate_rad_s: float, runs: bool) -> float:
        settings = self._settings
        length = self._model(gait, settings, self._placement.pendulum_factor, runs)
        length *= self._left_by_turn(turn_rate_rad_s)
        return min(max(length, SHORTEST_M), LONGEST_M)

    def _left_by_turn(self, turn_rate_rad_s: float) -> float:
        """What a turn leaves of a step (METHODS B6): corners take a little, a turn about on the spot most of it."""
        shortening = self._settings.turn_shortening_s
        if not shortening:
            return 1.0
        evenly = max(_LEAST_LEFT, 1.0 - shortening * abs(turn_rate_rad_s))
        return min(evenly, stride_share(turn_rate_rad_s, 1.0))


def projected(length_m: float, slope_rad: float) -> float:
    """METHODS A2: the part of a step along a slope that lies across the ground."""
    return length_m * math.cos(slope_rad)
