"""The state vector in named blocks, so that nobody counts indices.

Each foot has four numbers: east, north, up (m) of its last stance, and yaw (rad, counter-clockwise from east) of
the axis its steps call "forward". That axis is the *sensor's*, as mounted: yaw is not where the toes point.
Until the soldier is placed, the frame is the "boots frame" instead of ENU: it begins at the first foot's first
stance, and its x axis is that foot's forward axis there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
FOOT_SIZE = 4


@dataclass(frozen=True, slots=True)
class FootBlock:
    """Where one foot's numbers stand in the state vector."""

    place: str
    start: int

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


@dataclass(frozen=True, slots=True)
class Layout:
    """The blocks of a whole state vector."""

    blocks: tuple[FootBlock, ...]

    @classmethod
    def of(cls, feet: Sequence[str]) -> "Layout":
        """One block per foot, in this order."""
        return cls(tuple(FootBlock(place, FOOT_SIZE * index) for index, place in enumerate(feet)))

    @property
    def size(self) -> int:
        """Length of the state vector."""
        return FOOT_SIZE * len(self.blocks)
