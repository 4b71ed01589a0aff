"""From the azimuth of the unit to that of the way: 180° backward, ±90° aside, and how the body turns in side steps.

Whoever steps aside turns the body a little, by up to 20°, towards where they go (METHODS A3, B1). How much is this
person's own; it is learned from how the gyro's heading changes where side steps begin and where they end.
"""

import math

from bootprint.messages import Direction

MOST_ROTATION_RAD = math.radians(20.0)
USUAL_ROTATION_RAD = math.radians(6.0)  # until it has been seen
_AVERAGED_STEPS = 4  # an even number: the trunk twists to and fro
_SETTLING_STEPS = 2  # on both sides of a change: the body turns, and a change is seen late
_NEEDED = _SETTLING_STEPS + _AVERAGED_STEPS
_SHARE = 0.34  # of a new observation
_CREDIBLE_RAD = math.radians(30.0)  # whose body turns by more has really turned
_SIDE: dict[Direction, int] = {"forward": 0, "backward": 0, "left": 1, "right": -1}


class SideStepRotation:
    """Azimuth corrections by direction. ``rotation_rad`` (at least 0): the body's, towards where it steps.

    ``observations``: from how many changes of direction it was learned.
    """

    def __init__(self, rotation_rad: float = USUAL_ROTATION_RAD) -> None:
        self.rotation_rad = min(max(rotation_rad, 0.0), MOST_ROTATION_RAD)
        self.observations = 0
        self._direction: Direction = "forward"
        self._headings: list[float] = []  # of the last steps since the direction changed
        self._steps = 0  # since then
        self._before: tuple[int, float] | None = None  # side and mean heading before it changed

    def correction_rad(self, direction: Direction) -> float:
        """What to add to the unit's azimuth (clockwise) to have the way's."""
        aside = 0.5 * math.pi - self.rotation_rad
        return {"forward": 0.0, "backward": math.pi, "left": -aside, "right": aside}[direction]

    def update(self, direction: Direction, heading_rad: float) -> None:
        """Take a step in: its direction and the gyro's heading amid it, counter-clockwise, *not* wrapped."""
        if direction != self._direction:
            enough = len(self._headings) >= _NEEDED
            self._before = (
                (_SIDE[self._direction], _mean(self._headings[:_AVERAGED_STEPS])) if enough else None
            )
            self._direction, self._headings, self._steps = direction, [], 0
        self._headings = [*self._headings, heading_rad][-_NEEDED:]
        self._steps += 1
        if self._steps == _NEEDED and self._before is not None:
            self._learn(*self._before, _mean(self._headings[_SETTLING_STEPS:]))

    def _learn(self, side: int, before_rad: float, now_rad: float) -> None:
        """From a change between a side step and a way straight ahead or back."""
        towards, turned = _SIDE[self._direction] - side, now_rad - before_rad
        if abs(towards) != 1 or abs(turned) > _CREDIBLE_RAD:
            return
        seen = min(max(turned * towards, 0.0), MOST_ROTATION_RAD)
        self.observations += 1
        self.rotation_rad += max(_SHARE, 1.0 / self.observations) * (seen - self.rotation_rad)


def _mean(headings: list[float]) -> float:
    return sum(headings) / len(headings)
