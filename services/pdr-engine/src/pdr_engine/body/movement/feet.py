"""Where a step leads, by class and direction (METHODS A3, B1): the part between "how long" and "which way".

A step's direction is told from the trunk's drive in axes whose x points ahead; so nothing is told of it before it
is known which way the unit points (`pdr_engine.body.azimuth.ahead`): people are taken to go forward until then.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Direction, MotionClass
from pdr_engine.body.movement.classes import (
    ClassName,
    Climb,
    Movement,
    MovementClassifier,
    direction_of,
    motion_of,
)
from pdr_engine.body.movement.direction import DIRECTIONS, LAG
from pdr_engine.body.movement.settlement import Settlement
from pdr_engine.body.movement.side_step import SideStepRotation
from pdr_engine.body.pieces import FloatArray, Stride

_ON_STAIRS = 0.5  # the least probability


@dataclass(frozen=True, slots=True)
class Settled:
    """What an earlier step, that ended at ``time_ns``, turns out to have been by the steps since."""

    time_ns: int
    name: ClassName

    @property
    def motion(self) -> MotionClass:
        """The class by its name on the bus."""
        return motion_of(self.name)

    @property
    def direction(self) -> Direction:
        """Which way the feet went."""
        return direction_of(self.name)


class Feet:
    """A person's steps, one after the other: first `judge`, then `go`."""

    def __init__(self) -> None:
        self._classifier = MovementClassifier()
        self._rotation = SideStepRotation()
        self._settlement = Settlement()
        self._told: deque[tuple[int, int, Movement]] = deque(maxlen=LAG + 1)

    def judge(
        self, stride: Stride, yaw_rad: float, climb: Climb | None, tilt_rad: float | None, facing_known: bool
    ) -> Movement:
        """The class of a step; ``yaw_rad`` amid it, counter-clockwise, not wrapped."""
        movement = self._classifier.update(stride, climb, tilt_rad, facing_known)
        self._rotation.update(movement.direction, yaw_rad, stride.end_ns * 1e-9)
        self._told.append((stride.start_ns, stride.end_ns, movement))
        return movement

    def settled(self, climb_at: Callable[[int], Climb | None]) -> Settled | None:
        """The step `LAG` before the one just judged, if there were as many.

        ``climb_at``: what stairs there were at a time, as is known now. Runs and crawls stand as they were told.
        """
        if len(self._told) <= LAG:
            return None
        start_ns, end_ns, movement = self._told[0]
        if movement.motion not in ("walking", "stairs"):
            return Settled(end_ns, movement.name)
        climb = climb_at((start_ns + end_ns) // 2)
        if climb is None and movement.motion == "stairs":
            return Settled(end_ns, movement.name)
        direction = self._classifier.directions.settled(LAG)
        if climb is not None and climb.stairs > _ON_STAIRS and direction == "forward":
            return Settled(end_ns, "stairs_up" if climb.up else "stairs_down")
        return Settled(end_ns, direction)

    def go(
        self, movement: Movement, facing_rad: float, length_m: Callable[[Direction], float]
    ) -> tuple[float, float]:
        """Length, m, and azimuth to publish for the step just judged of one who faces so.

        ``length_m``: how long the step is if it goes there. What earlier steps turned out to be is put right.
        """
        directions = self._classifier.directions
        if movement.name in DIRECTIONS:
            ways = {way: self._vector(way, facing_rad, length_m(way)) for way in DIRECTIONS}
        else:
            ways = dict.fromkeys(DIRECTIONS, self._vector("forward", facing_rad, length_m("forward")))
        east, north = self._settlement.step(ways, directions).tolist()
        length = math.hypot(east, north)
        return length, math.atan2(east, north) if length > 0.0 else facing_rad

    def _vector(self, way: Direction, facing_rad: float, length_m: float) -> FloatArray:
        azimuth = facing_rad + self._rotation.correction_rad(way)
        return length_m * np.array([math.sin(azimuth), math.cos(azimuth)])
