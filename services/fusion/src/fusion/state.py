"""The state vector in named blocks, so that nobody counts indices.

Each foot has four numbers: east, north, up (m) of its last stance, and yaw (rad, counter-clockwise from east) of
the axis its steps call "forward". That axis is the *sensor's*, as mounted: yaw is not where the toes point.
Until the soldier is placed, the frame is the "boots frame" instead of ENU: it begins at the first foot's first
stance, and its x axis is that foot's forward axis there.

Behind the feet's poses stand the errors that all steps of a foot share (scale, slope, turn), in units of the sigma
that its steps name, then the width (m) at which the feet pass each other, and each foot's error of its compass.
Then comes who walks beside the feet, a camera: a pose as a foot's, from when it is first taken in. And whatever
else is compared with the walk, a map of rooms, has an offset (east, north m, turn rad) attached.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bootprint.messages import Vector3

Array = npt.NDArray[np.float64]
FOOT_SIZE = 4
COMMON_SIZE = 3
OFFSET_SIZE = 3
DETACHED = ""


def xyz(values: Array) -> Vector3:
    """Three numbers of an array."""
    return float(values[0]), float(values[1]), float(values[2])


@dataclass(frozen=True, slots=True)
class FootBlock:
    """Where the numbers of one foot, or of who walks beside the feet, stand in the state vector."""

    place: str
    start: int
    common_start: int = -1  # of a foot only

    @property
    def all(self) -> slice:
        """East, north, up (m), yaw (rad)."""
        return slice(self.start, self.start + FOOT_SIZE)

    @property
    def position(self) -> slice:
        """East, north, up, m."""
        return slice(self.start, self.start + 3)

    @property
    def yaw(self) -> int:
        """Yaw of the step frame, rad counter-clockwise from east."""
        return self.start + 3

    @property
    def common(self) -> slice:
        """Shared errors of this foot's steps: scale, slope, turn, each in units of its sigma."""
        return slice(self.common_start, self.common_start + COMMON_SIZE)


@dataclass(frozen=True, slots=True)
class Layout:
    """The blocks of a whole state vector."""

    blocks: tuple[FootBlock, ...]  # of the feet
    beside: tuple[FootBlock, ...] = ()  # of who walks beside them
    attached: tuple[tuple[str, int], ...] = ()  # names of offsets, and where they start

    @classmethod
    def of(cls, feet: Sequence[str]) -> "Layout":
        """One block per foot, in this order."""
        behind = FOOT_SIZE * len(feet)
        return cls(
            tuple(
                FootBlock(place, FOOT_SIZE * index, behind + COMMON_SIZE * index)
                for index, place in enumerate(feet)
            )
        )

    def with_beside(self, place: str) -> "Layout":
        """The same with one more beside the feet, behind everything else."""
        return Layout(self.blocks, (*self.beside, FootBlock(place, self.size)), self.attached)

    def with_attached(self, name: str) -> "Layout":
        """The same with one more offset, where one was detached or behind everything else."""
        free = next((at for each, at in self.attached if each == DETACHED), None)
        if free is None:
            return Layout(self.blocks, self.beside, (*self.attached, (name, self.size)))
        return self._renamed(free, name)

    def without(self, name: str) -> "Layout":
        """The same with an offset detached; others stay where they are."""
        block = self.attached_of(name)
        return self if block is None else self._renamed(block.start, DETACHED)

    def _renamed(self, start: int, name: str) -> "Layout":
        renamed = tuple((name if at == start else each, at) for each, at in self.attached)
        return Layout(self.blocks, self.beside, renamed)

    def attached_of(self, name: str) -> slice | None:
        """East, north (m), turn (rad) of that offset, if it is attached."""
        return next((slice(at, at + OFFSET_SIZE) for each, at in self.attached if each == name), None)

    @property
    def walkers(self) -> tuple[FootBlock, ...]:
        """All that have a pose."""
        return (*self.blocks, *self.beside)

    @property
    def width(self) -> int:
        """Distance between the lines on which two feet pass each other, left of right, m."""
        return (FOOT_SIZE + COMMON_SIZE) * len(self.blocks)

    def compass(self, block: FootBlock) -> int:
        """What calibration left of a foot's magnetometer, in units of its sigma."""
        return self.width + 1 + self.blocks.index(block)

    @property
    def feet_size(self) -> int:
        """Length of the feet's part, which comes first."""
        return self.width + 1 + len(self.blocks)

    @property
    def size(self) -> int:
        """Length of the state vector."""
        return self.feet_size + FOOT_SIZE * len(self.beside) + OFFSET_SIZE * len(self.attached)
