"""Whether iron or currents bend the field at a step: how strong, steep and steady it is, and what the gyro says.

Five signs, each with a density of its values in a clean and in a bent field, and a hidden Markov model over both:
the RMS of the strength over three steps (METHODS A6, the source's threshold is 3 µT), the compass's turn against
the gyro's (B7, its example 20 °/s), strength and dip against the earth's or the walk's own, and the azimuth against
the one that the gyro has carried on.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from bootprint.geomagnetism import EarthField
from pdr_engine.body.pieces import FloatArray

STEADY_STEPS = 3
SOURCE_STRENGTH_RMS_UT = 3.0  # A6's threshold
SOURCE_RATE_RAD_S = math.radians(20.0)  # B7's example
_BEND, _MEND = 0.03, 0.06  # probabilities that a step is the first in a bent, or again in a clean field
_LEAST_PROBABILITY = 1e-4
_DOUBT, _WORTHLESS_RAD = 4.0, math.radians(90.0)
_CALIBRATED_UT, _CALIBRATED_RAD = 3.0, math.radians(5.0)  # what a compass's own iron leaves, or a first step
_CORRELATED_STEPS = 6.0  # that tell the same about the habit
# Unevenness: of so many steps; it begins as if this many had shown what is told beforehand.
_MEMORY_STEPS, _FIRST_STEPS = 100.0, 10.0
_MOST_UNEVENNESS, _LEAST_STRENGTH_UT = 0.5, 1.0
_LEAST_LEARNING, _HABIT_SHARE = 0.05, 0.3


@dataclass(frozen=True, slots=True)
class Sign:
    """A sign's sigma in a clean and in a bent field; ``unseen``: how often a bent field does not show in it."""

    clean: float
    bent: float
    unseen: float

    def evidence(self, value: float, doubt: float = 0.0) -> float:
        """Logarithm of how much likelier a value is in a bent field; ``doubt`` is added to both sigmas."""
        clean = _density(value, math.hypot(self.clean, doubt))
        bent = _density(value, math.hypot(self.bent, doubt))
        return math.log((self.unseen * clean + (1.0 - self.unseen) * bent) / clean)


STRENGTH_RMS_UT = Sign(1.2, 5.0, 0.5)
TURN_RATE_RAD_S = Sign(math.radians(6.0), math.radians(25.0), 0.6)
STRENGTH_UT = Sign(2.0, 9.0, 0.3)
DIP_RAD = Sign(math.radians(2.5), math.radians(10.0), 0.3)
AZIMUTH_RAD = Sign(math.radians(8.0), math.radians(30.0), 0.3)
_MOST_EVIDENCE = 6.0  # in nats, of one sign at one step


@dataclass(frozen=True, slots=True)
class Field:
    """One step's field: mean ``strength_ut`` and its samples' mean square deviation, ``dip_rad``, ``azimuth_rad``.

    The azimuth is from magnetic north, clockwise, of the frame's forward axis.
    """

    strength_ut: float
    strength_variance_ut2: float
    dip_rad: float
    azimuth_rad: float


def field_of(level_field_ut: FloatArray) -> Field:
    """Of a step's samples (n, 3) in the level frame ahead, left, up."""
    ahead, left, up = level_field_ut.mean(axis=0)
    strengths = np.linalg.norm(level_field_ut, axis=1)
    return Field(
        strength_ut=float(strengths.mean()),
        strength_variance_ut2=float(strengths.var()),
        dip_rad=math.atan2(-up, math.hypot(ahead, left)),
        azimuth_rad=math.atan2(left, ahead),
    )


@dataclass(frozen=True, slots=True)
class Verdict:
    """``probability`` that the field is bent; the signs' evidence in nats by name, for those who ask why."""

    probability: float
    evidence: dict[str, float]

    def sigma_rad(self, clean_sigma_rad: float) -> float | None:
        """Of an azimuth that has this sigma in a clean field; None where it is not worth taking."""
        sigma = clean_sigma_rad * (1.0 + _DOUBT * self.probability / (1.0 - self.probability))
        return sigma if sigma < _WORTHLESS_RAD else None

    @property
    def disturbed(self) -> bool:
        """More likely than not."""
        return self.probability > 0.5


class Habit:
    """What the walk's own field is in one sign: a mean with its variance, learned from clean steps.

    The model's value is where it starts, for a compass is never calibrated perfectly. A little is learned from
    every step, so that a detector that is wrong about all of them comes round in some minutes.
    """

    def __init__(self, start: float | None, sigma: float, step_sigma: float) -> None:
        self.mean = start
        self.variance = sigma**2
        self._step_variance = step_sigma**2

    def learn(self, value: float, clean: float) -> None:
        """Take a step's value in, of a step that is clean with this probability."""
        if self.mean is None:
            self.mean = value
        weight = max(clean, _LEAST_LEARNING)
        gain = weight * self.variance / (self.variance + _CORRELATED_STEPS * self._step_variance)
        self.mean += gain * (value - self.mean)
        floor = (_HABIT_SHARE**2) * self._step_variance
        self.variance = max((1.0 - gain) * self.variance, floor)

    def evidence(self, sign: Sign, value: float) -> float:
        """For a bent field, given how well the habit is known."""
        return 0.0 if self.mean is None else sign.evidence(value - self.mean, math.sqrt(self.variance))


class DisturbanceDetector:
    """Judges the field step by step. ``earth``: the model's field; without it the walk's own is all there is.

    ``unevenness``: what is expected of it to begin with.
    """

    def __init__(self, earth: EarthField | None = None, unevenness: float = 0.0) -> None:
        self.probability = 0.3
        self._strength = Habit(
            None if earth is None else earth.strength_ut, _CALIBRATED_UT, STRENGTH_UT.clean
        )
        self._dip = Habit(None if earth is None else earth.dip_rad, _CALIBRATED_RAD, DIP_RAD.clean)
        self._recent: deque[Field] = deque(maxlen=STEADY_STEPS)
        self._uneven, self._uneven_steps = unevenness**2, _FIRST_STEPS

    def update(
        self,
        field: Field,
        turn_rad: float,
        duration_s: float,
        gyro_azimuth: tuple[float, float] | None = None,
    ) -> Verdict:
        """Judge a step. ``turn_rad``: the gyro's, clockwise; ``gyro_azimuth``: the carried one and its sigma."""
        evidence = {"steadiness": STRENGTH_RMS_UT.evidence(self._strength_rms_ut(field))}
        if self._recent:
            turned = math.remainder(field.azimuth_rad - self._recent[-1].azimuth_rad - turn_rad, math.tau)
            evidence["rate"] = TURN_RATE_RAD_S.evidence(turned / max(duration_s, 1e-3))
        evidence["strength"] = self._strength.evidence(STRENGTH_UT, field.strength_ut)
        evidence["dip"] = self._dip.evidence(DIP_RAD, field.dip_rad)
        if gyro_azimuth is not None:
            apart = math.remainder(field.azimuth_rad - gyro_azimuth[0], math.tau)
            evidence["azimuth"] = AZIMUTH_RAD.evidence(apart, gyro_azimuth[1])
        self._recent.append(field)
        self._judge(min(max(sum(evidence.values()), -_MOST_EVIDENCE), _MOST_EVIDENCE))
        self._learn_unevenness(field)
        self._strength.learn(field.strength_ut, 1.0 - self.probability)
        self._dip.learn(field.dip_rad, 1.0 - self.probability)
        return Verdict(self.probability, evidence)

    def _learn_unevenness(self, field: Field) -> None:
        """Before the habits take this field in: what it is off them."""
        if self._strength.mean is None or self._dip.mean is None:
            return
        strength = (field.strength_ut - self._strength.mean) / max(self._strength.mean, _LEAST_STRENGTH_UT)
        off = min(strength**2 + (field.dip_rad - self._dip.mean) ** 2, _MOST_UNEVENNESS**2)
        self._uneven_steps = min(self._uneven_steps + 1.0, _MEMORY_STEPS)
        self._uneven += (off - self._uneven) / self._uneven_steps

    @property
    def unevenness(self) -> float:
        """RMS of what the field lately was off its habit, as a share of its strength: so much an azimuth errs, rad.

        It begins with what buildings have.
        """
        return math.sqrt(self._uneven)

    def _strength_rms_ut(self, field: Field) -> float:
        """Deviation of all samples of the last three steps from their mean (A6)."""
        steps = [*self._recent, field][-STEADY_STEPS:]
        means = np.array([step.strength_ut for step in steps])
        return float(np.sqrt(means.var() + np.mean([step.strength_variance_ut2 for step in steps])))

    def _judge(self, evidence: float) -> None:
        prior = self.probability * (1.0 - _MEND) + (1.0 - self.probability) * _BEND
        odds = prior / (1.0 - prior) * math.exp(evidence)
        self.probability = min(max(odds / (1.0 + odds), _LEAST_PROBABILITY), 1.0 - _LEAST_PROBABILITY)


def _density(value: float, sigma: float) -> float:
    return math.exp(-0.5 * min((value / sigma) ** 2, 200.0)) / sigma
