"""Where a step leads, by class and direction (METHODS A3, B1): the part between "how long" and "which way".

A step's direction is told from the trunk's drive in axes whose x points ahead; so nothing is told of it before it
is known which way the unit points (`pdr_engine.body.azimuth.ahead`): people are taken to go forward until then.
"""

import math
from collections.abc import Callable

import numpy as np

from bootprint.messages import Direction
from pdr_engine.body.movement.classes import Climb, Movement, MovementClassifier
from pdr_engine.body.movement.direction import DIRECTIONS
from pdr_engine.body.movement.settlement import Settlement
from pdr_engine.body.movement.side_step import SideStepRotation
from pdr_engine.body.pieces import FloatArray, Stride


class Feet:
    """A person's steps, one after the other: first `judge`, then `go`."""

    def __init__(self) -> None:
        self._classifier = MovementClassifier()
        self._rotation = SideStepRotation()
        self._settlement = Settlement()

    def judge(
        self, stride: Stride, yaw_rad: float, climb: Climb | None, tilt_rad: float | None, facing_known: bool
    ) -> Movement:
        """The class of a step; ``yaw_rad`` amid it, counter-clockwise, not wrapped."""
        movement = self._classifier.update(stride, climb, tilt_rad, facing_known)
        self._rotation.update(movement.direction, yaw_rad)
        return movement

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
