"""From the azimuth of the unit to that of the way: 180° backward, ±90° aside, and how the body turns in side steps.

Whoever steps aside turns the body a little, by up to 20°, towards where they go (METHODS A3, B1). How much is this
person's own; it is learned from how the gyro's heading changes where side steps begin and where they end. A change
is what a line through the headings before and one through those after it are apart, both rising as the gyro drifts
(least squares); what several changes tell, a scalar Kalman filter takes together.
"""

import math
from typing import NamedTuple

from bootprint.messages import Direction

MOST_ROTATION_RAD = math.radians(20.0)
USUAL_ROTATION_RAD = math.radians(6.0)  # until it has been seen
_USUAL_SIGMA_RAD = math.radians(10.0)
_HABIT_SIGMA_RAD = math.radians(1.0)  # by which it differs from one bout of side steps to the next
_TURN_SIGMA_RAD = math.radians(1.5)  # of what people turn besides, where they change direction
_TWIST_SIGMA_RAD = math.radians(2.0)  # of a step's heading: the trunk twists to and fro
_DRIFT_SIGMA_RAD_S = math.radians(0.3)  # of the gyro
_LEAST_STEPS, _MOST_STEPS = 4, 26  # averaged on a side of a change, and kept
_SETTLING_STEPS = 2  # on both sides of a change: the body turns, and a change is seen late
_CREDIBLE_RAD = math.radians(30.0)  # whose body turns by more has really turned
_SIDE: dict[Direction, int] = {"forward": 0, "backward": 0, "left": 1, "right": -1}


class _Heading(NamedTuple):
    time_s: float
    heading_rad: float


class _Known(NamedTuple):
    rotation_rad: float
    variance: float


class _Bout(NamedTuple):
    """Steps in one direction: which side that is, how many, their mean time and heading; sums of squares and
    products of the deviations from these."""

    side: int
    steps: int
    time_s: float
    heading_rad: float
    square_s2: float
    product_rad_s: float


class SideStepRotation:
    """Azimuth corrections by direction. ``rotation_rad`` (at least 0): the body's, towards where it steps.

    ``observations``: from how many changes of direction it was learned.
    """

    def __init__(self, rotation_rad: float = USUAL_ROTATION_RAD) -> None:
        rotation_rad = min(max(rotation_rad, 0.0), MOST_ROTATION_RAD)
        self._known = self._before_change = _Known(rotation_rad, _USUAL_SIGMA_RAD**2)
        self.observations = 0
        self._direction: Direction = "forward"
        self._headings: list[_Heading] = []  # of the last steps since the direction changed
        self._steps = 0  # since then
        self._before: _Bout | None = None  # the last one that was long enough

    @property
    def rotation_rad(self) -> float:
        """As it is known now."""
        return self._known.rotation_rad

    def correction_rad(self, direction: Direction) -> float:
        """What to add to the unit's azimuth (clockwise) to have the way's."""
        aside = 0.5 * math.pi - self.rotation_rad
        return {"forward": 0.0, "backward": math.pi, "left": -aside, "right": aside}[direction]

    def update(self, direction: Direction, heading_rad: float, time_s: float) -> None:
        """Take a step in: its direction and the gyro's heading amid it, counter-clockwise, *not* wrapped."""
        if direction != self._direction:
            self._change(direction)
        self._steps += 1
        self._headings = [*self._headings, _Heading(time_s, heading_rad)][-_MOST_STEPS:]
        now = self._bout(self._headings[_SETTLING_STEPS:])
        if self._before is not None and now is not None and self._steps <= _MOST_STEPS:
            self._learn(self._before, now)

    def _change(self, direction: Direction) -> None:
        """A direction that lasted for a step or two was a halt, or misread: what was before counts on."""
        self._before = self._bout(self._headings[:-_SETTLING_STEPS]) or self._before
        self._before_change = self._known
        self._direction, self._headings, self._steps = direction, [], 0

    def _bout(self, headings: list[_Heading]) -> _Bout | None:
        """Of the last of these steps in the direction at hand, as many left as right; None if they are too few."""
        steps = len(headings) // 2 * 2
        if steps < _LEAST_STEPS:
            return None
        time_s, heading_rad = (sum(column) / steps for column in zip(*headings[-steps:], strict=True))
        apart = [(at_s - time_s, heading - heading_rad) for at_s, heading in headings[-steps:]]
        square = sum(since_s**2 for since_s, _ in apart)
        product = sum(since_s * turned for since_s, turned in apart)
        return _Bout(_SIDE[self._direction], steps, time_s, heading_rad, square, product)

    def _learn(self, before: _Bout, now: _Bout) -> None:
        """From a change between a side step and a way straight ahead or back, as far as it is seen by now."""
        square = before.square_s2 + now.square_s2 + (_TWIST_SIGMA_RAD / _DRIFT_SIGMA_RAD_S) ** 2
        drift_rad_s = (before.product_rad_s + now.product_rad_s) / square
        since_s = now.time_s - before.time_s
        towards, turned = now.side - before.side, now.heading_rad - before.heading_rad - drift_rad_s * since_s
        if abs(towards) != 1 or abs(turned) > _CREDIBLE_RAD:
            return
        self.observations += self._steps == _SETTLING_STEPS + _LEAST_STEPS
        usual = self._before_change
        variance = usual.variance + _HABIT_SIGMA_RAD**2
        shares = 1.0 / before.steps + 1.0 / now.steps + since_s**2 / square
        gain = variance / (variance + _TURN_SIGMA_RAD**2 + _TWIST_SIGMA_RAD**2 * shares)
        found = usual.rotation_rad + gain * (turned * towards - usual.rotation_rad)
        self._known = _Known(min(max(found, 0.0), MOST_ROTATION_RAD), (1.0 - gain) * variance)
