"""Movement class of each step, with probabilities (METHODS A3, B1): what to add to its azimuth, which step model.

Nine classes: standing, forward, backward, left, right, running, stairs up and down, crawling. The direction comes
from the trunk's surge, running from its bounce and cadence, stairs from the height won a step (`Climb`), crawling
from how far the trunk leans. Whoever runs, climbs or crawls is taken to go forward.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from bootprint.messages import Direction, MotionClass
from pdr_engine.body.movement.direction import DIRECTIONS, USUAL, WALKING, DirectionFilter
from pdr_engine.body.movement.impetus import Impetus
from pdr_engine.body.movement.surge import Surge, surge_of
from pdr_engine.body.pieces import FloatArray, Stride

ClassName = Literal[
    "standing",
    "forward",
    "backward",
    "left",
    "right",
    "running",
    "stairs_up",
    "stairs_down",
    "crawling",
]
_MOTION: dict[ClassName, MotionClass] = {
    "standing": "standing",
    "running": "running",
    "stairs_up": "stairs",
    "stairs_down": "stairs",
    "crawling": "crawling",
}
_STILL_M_S2, _STILL_SPREAD_M_S2 = 0.35, 0.06  # of the acceleration's RMS
# A body that flies falls with 1 g, so its bounce is about that at least, and nobody runs slowly.
_RUN_BOUNCE_M_S2, _BOUNCE_SPREAD_M_S2 = 8.5, 1.2
_RUN_HZ, _HZ_SPREAD = 2.25, 0.12
_RUN_MEMORY, _MOST_RUN_EVIDENCE = 0.5, 2.5
_CLIMBS_ASIDE = 0.1  # as often as forward
_CRAWL_TILT_RAD, _TILT_SPREAD_RAD = math.radians(50.0), math.radians(6.0)


@dataclass(frozen=True, slots=True)
class Climb:
    """What the height says of the way: ``stairs`` probability of stairs, ``up`` whether it rises."""

    stairs: float
    up: bool


def motion_of(name: ClassName) -> MotionClass:
    """The class by its name on the bus."""
    return _MOTION.get(name, "walking")


def direction_of(name: ClassName) -> Direction:
    """Which way the feet go in a class."""
    return name if name in ("backward", "left", "right") else "forward"


@dataclass(frozen=True, slots=True)
class Movement:
    """A step's class. ``probability`` of all classes adds up to one; ``direction`` is that of the feet."""

    name: ClassName
    direction: Direction
    probability: Mapping[ClassName, float]
    surge: Surge

    @property
    def motion(self) -> MotionClass:
        """The class by its name on the bus."""
        return motion_of(self.name)


class MovementClassifier:
    """Classes of a person's steps, one after the other."""

    def __init__(self) -> None:
        self.directions = DirectionFilter()
        self._impetus = Impetus()
        self._last_end_ns: int | None = None
        self._run_evidence = -_MOST_RUN_EVIDENCE

    def update(
        self,
        stride: Stride,
        climb: Climb | None = None,
        tilt_rad: float | None = None,
        facing_known: bool = True,
    ) -> Movement:
        """Take one step in. ``tilt_rad``: how far the unit leans from how it is carried upright, if known.

        ``facing_known``: whether the stride's x is known to be the person's ahead; if not, steps go forward.
        """
        surge = surge_of(stride)
        standing = _logistic((_STILL_M_S2 - surge.stir_m_s2) / _STILL_SPREAD_M_S2)
        running = self._running(surge)
        crawling = 0.0 if tilt_rad is None else _logistic((tilt_rad - _CRAWL_TILT_RAD) / _TILT_SPREAD_RAD)
        if running > 0.5 or not facing_known:
            self.directions.forward(stride.end_ns)
        else:
            gained = self._gained(stride)
            self.directions.update(surge, stride.turn_rad, stride.start_ns, stride.end_ns, gained)
        probability = self._shared(standing, running, crawling, climb)
        name = self._decided(probability)
        return Movement(name, direction_of(name), probability, surge)

    def _gained(self, stride: Stride) -> FloatArray | None:
        if stride.start_ns != self._last_end_ns:
            self._impetus.restart()
        self._last_end_ns = stride.end_ns
        self._impetus.take(stride)
        return self._impetus.transition(WALKING, USUAL)

    def _running(self, surge: Surge) -> float:
        """Probability of a run: bounce *and* cadence, over some steps, for a jolt has the one or the other."""
        bounce = (surge.bounce_m_s2 - _RUN_BOUNCE_M_S2) / _BOUNCE_SPREAD_M_S2
        cadence = (surge.frequency_hz - _RUN_HZ) / _HZ_SPREAD
        shown = max(-_MOST_RUN_EVIDENCE, min(bounce, cadence, _MOST_RUN_EVIDENCE))
        self._run_evidence = _RUN_MEMORY * self._run_evidence + shown
        return _logistic(self._run_evidence)

    def _shared(
        self, standing: float, running: float, crawling: float, climb: Climb | None
    ) -> dict[ClassName, float]:
        """One probability among the classes, by what is decided first: still, low, fast, climbing, direction."""
        shares: dict[ClassName, float] = {"standing": standing}
        left = 1.0 - standing
        shares["crawling"] = left * crawling
        left *= 1.0 - crawling
        shares["running"] = left * running
        left *= 1.0 - running
        stairs = 0.0 if climb is None else self._ahead_only(climb.stairs)
        up = climb is not None and climb.up
        shares["stairs_up"], shares["stairs_down"] = (
            left * stairs * float(up),
            left * stairs * float(not up),
        )
        left *= 1.0 - stairs
        for name, share in zip(DIRECTIONS, self.directions.probability.tolist(), strict=True):
            shares[name] = left * share
        return shares

    def _ahead_only(self, stairs: float) -> float:
        """Stairs are climbed forward: their probability, given that of going any other way."""
        forward = float(self.directions.probability[0])
        likely = stairs * (forward + _CLIMBS_ASIDE * (1.0 - forward))
        return likely / (likely + 1.0 - stairs) if likely > 0.0 else 0.0

    def _decided(self, probability: Mapping[ClassName, float]) -> ClassName:
        """The likeliest class; among the directions the one to go by."""
        walking = sum(probability[name] for name in DIRECTIONS)
        others = {name: share for name, share in probability.items() if name not in DIRECTIONS}
        best = max(others, key=lambda name: others[name])
        return self.directions.decided if walking > others[best] else best


def _logistic(value: float) -> float:
    return 1.0 / (1.0 + math.exp(-max(-40.0, min(40.0, value))))
