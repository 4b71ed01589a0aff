"""Which way the body goes, step by step: forward, backward, left or right, with probabilities (METHODS A3, B1).

A hidden Markov model over the four directions. What a step shows is the direction of its surge (`surge`), taken
together with the step before: the trunk's twist shakes a unit that is worn off its axis to and fro, and side steps
come in unlike pairs. Its noise is learned from the person's own steps: a phone in the hand shakes more than a unit
on a belt. People keep their direction as they walk, change it where they stop, and mostly go forward.
"""

import math
from collections import deque
from dataclasses import astuple

import numpy as np

from bootprint.messages import Direction
from pdr_engine.body.movement.surge import Surge
from pdr_engine.body.pieces import FloatArray

DIRECTIONS: tuple[Direction, ...] = ("forward", "backward", "left", "right")
# What turns a surge (ahead, left) of a step in each direction to that of a step forward: (4, 2, 2).
_TURNS = np.array(
    [
        [[1.0, 0.0], [0.0, 1.0]],
        [[-1.0, 0.0], [0.0, -1.0]],
        [[0.0, 1.0], [-1.0, 0.0]],
        [[0.0, -1.0], [1.0, 0.0]],
    ]
)
LAG = 4  # steps after which a direction is settled
_NOTHING = np.ones(len(DIRECTIONS))  # the likelihood of a step that shows nothing
USUAL = np.array([0.88, 0.04, 0.04, 0.04])
_CHANGE_AFTER_PAUSE = 0.5  # a step
_FORGET_UNTOLD = 0.5  # a step: who goes aside or back shows it at every step
_DECIDED = 0.6
_PAUSE_NS = 700_000_000
_FULL_SURGE = 0.7  # of the person's own going forward: from there the direction counts, not the size
_SURGE_M_S2, _LEAST_SURGE_M_S2, _MOST_SURGE_M_S2 = 0.7, 0.4, 1.2  # chest, belt and hand, in any walk
_MOST_SKEW_RAD = math.radians(35.0)
_SURGE_MEMORY_STEPS, _SURE = 30.0, 0.95
_NOISE, _LEAST_NOISE, _NOISE_MEMORY_STEPS = 0.5, 0.25, 15.0  # of the full surge, each component
_LEAST_SHARE = 0.45  # of the person's surge forward: a step with less shows no direction
_BOUNCE_M_S2, _JOLT = 4.0, 1.6
_ODD_SHARE, _ODD = 0.15, 0.8  # steps that are like no other: stumbles, gestures
_LEAST_BOUNCE_M_S2, _MOST_TURN_RAD = 0.6, math.radians(20.0)  # beyond them a step tells nothing
_SLOWEST_HZ, _FASTEST_HZ = 1.0, 2.8


def _transition(change: float) -> FloatArray:
    """Probabilities (4, 4) from row to column: with probability ``change`` people go on as they usually do."""
    return np.asarray((1.0 - change) * np.eye(len(USUAL)) + change * USUAL)


WALKING = _transition(0.006)


class DirectionFilter:
    """Probabilities of `DIRECTIONS` after each step.

    ``surge_m_s2`` (2,), ahead and left, is what the person shows going forward, learned within bounds: a unit in
    the hand does not point exactly where its bearer goes. The other directions show the same, turned.
    """

    def __init__(self) -> None:
        self.probability: FloatArray = USUAL.copy()
        self.surge_m_s2: FloatArray = np.array([_SURGE_M_S2, 0.0])
        self.noise = _NOISE
        self._last_end_ns: int | None = None
        self._halted = True
        # Of the last steps: probabilities, likelihoods (4, 4) of how they came from those before, and likelihood.
        self._past: deque[tuple[FloatArray, FloatArray, FloatArray]] = deque(maxlen=LAG + 1)
        self._bounce_m_s2 = _BOUNCE_M_S2
        self._before: Surge | None = None  # of the step that this one joins

    def update(
        self, surge: Surge, turn_rad: float, start_ns: int, end_ns: int, gained: FloatArray | None = None
    ) -> FloatArray:
        """Take one walked step in; the probabilities (4,) of its direction.

        ``gained`` (4, 4): how well the speed gained fits going from row to column, see `Impetus`.
        """
        paused = self._paused(start_ns)
        change = _transition(_CHANGE_AFTER_PAUSE) if paused else (WALKING if gained is None else gained)
        before = self._before if start_ns == self._last_end_ns else None
        self._last_end_ns, self._before = end_ns, surge
        together = surge if before is None else _together(before, surge)
        plain = _is_plain(surge, together, turn_rad)
        self._halted = not plain and not paused
        if not plain:
            return self._step(change, _NOTHING)
        surge = together
        if not self._tells(surge):
            return self._step(_transition(_FORGET_UNTOLD), _NOTHING)
        seen = _TURNS @ np.array([surge.ahead_m_s2, surge.left_m_s2])
        misses = self._misses(seen)
        self._step(change, self._likelihood(misses, float(np.sum(seen[0] ** 2))))
        self._learn(seen, float(misses.min()))
        return self.probability

    def _step(self, change: FloatArray, likelihood: FloatArray) -> FloatArray:
        """One step of the model: ``change`` (4, 4) from row to column."""
        posterior = (self.probability @ change) * likelihood
        self.probability = posterior / posterior.sum()
        self._past.append((self.probability, change, likelihood))
        return self.probability

    @property
    def decided(self) -> Direction:
        """The direction to go by, as far as is known now."""
        return _decide(self.probability)

    def forward(self, end_ns: int) -> FloatArray:
        """Take a step in that can only have gone forward (a run)."""
        self._last_end_ns, self._halted = end_ns, False
        return self._step(_transition(1.0), np.array([1.0, 0.0, 0.0, 0.0]))

    def settled(self, lag: int) -> Direction:
        """The direction of the step ``lag`` (at most `LAG`) steps ago, by all steps since; now for lag 0."""
        past = list(self._past)
        told = np.ones(len(DIRECTIONS))  # likelihood of what came after, by direction
        for _, change, likelihood in past[len(past) - lag :][::-1]:
            told = change @ (likelihood * told)
        smoothed = past[-1 - lag][0] * told
        return _decide(smoothed / smoothed.sum())

    def _paused(self, start_ns: int) -> bool:
        return self._halted or self._last_end_ns is None or start_ns - self._last_end_ns > _PAUSE_NS

    def _tells(self, surge: Surge) -> bool:
        """Whether a step has a surge to speak of, and is no jolt: a shuffle or a gesture has no direction."""
        self._bounce_m_s2 += (surge.bounce_m_s2 - self._bounce_m_s2) / _SURGE_MEMORY_STEPS
        jolt = surge.bounce_m_s2 > max(_JOLT * self._bounce_m_s2, _BOUNCE_M_S2)
        least = _LEAST_SHARE * float(np.hypot(*self.surge_m_s2))
        return not jolt and math.hypot(surge.ahead_m_s2, surge.left_m_s2) > least

    def _misses(self, seen: FloatArray) -> FloatArray:
        """How far the step is from each direction (4,), squared: of surges no longer than the unit vector."""
        own = float(np.hypot(*self.surge_m_s2))
        longest = np.maximum(np.linalg.norm(seen, axis=1), _FULL_SURGE * own)
        return np.asarray(np.sum((seen / longest[:, None] - self.surge_m_s2 / own) ** 2, axis=1))

    def _likelihood(self, misses: FloatArray, square: float) -> FloatArray:
        """Of the step in each direction (4,); a share of the steps may show anything."""
        usual = np.exp(-0.5 * misses / self.noise**2) / self.noise**2
        odd = math.exp(-0.5 * min(square, 1.0) / _ODD**2) / _ODD**2
        return np.asarray((1.0 - _ODD_SHARE) * usual + _ODD_SHARE * odd)

    def _learn(self, seen: FloatArray, least_miss: float) -> None:
        """The noise, by the direction that fits the step best; the surge, where the direction is sure."""
        variance = self.noise**2 + (0.5 * least_miss - self.noise**2) / _NOISE_MEMORY_STEPS
        self.noise = max(math.sqrt(variance), _LEAST_NOISE)
        best = int(self.probability.argmax())
        if self.probability[best] < _SURE:
            return
        mean = self.surge_m_s2 + (seen[best] - self.surge_m_s2) / _SURGE_MEMORY_STEPS
        size = float(np.clip(np.hypot(*mean), _LEAST_SURGE_M_S2, _MOST_SURGE_M_S2))
        skew = float(np.clip(math.atan2(mean[1], mean[0]), -_MOST_SKEW_RAD, _MOST_SKEW_RAD))
        self.surge_m_s2 = size * np.array([math.cos(skew), math.sin(skew)])


def _decide(probability: FloatArray) -> Direction:
    """Forward unless another direction is much more likely, for a wrong one costs most."""
    best = int(probability.argmax())
    return DIRECTIONS[best] if probability[best] > _DECIDED else "forward"


def _together(one: Surge, other: Surge) -> Surge:
    """The mean of a left and a right step."""
    pairs = zip(astuple(one), astuple(other), strict=True)
    return Surge(*(0.5 * (a + b) for a, b in pairs))


def _is_plain(surge: Surge, together: Surge, turn_rad: float) -> bool:
    """Whether a step is a plain one: not a shuffle, a halt or a turn on the spot; one of a pair may be quick."""
    return (
        surge.bounce_m_s2 > _LEAST_BOUNCE_M_S2
        and abs(turn_rad) < _MOST_TURN_RAD
        and surge.frequency_hz > _SLOWEST_HZ
        and together.frequency_hz < _FASTEST_HZ
    )
