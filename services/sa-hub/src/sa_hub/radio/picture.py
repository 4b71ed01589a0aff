"""What receivers have, many of them side by side: beliefs of everyone, and which updates they can still resolve."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from bootprint.prediction import DAMPING_S, reaches_s
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
_COLUMNS: Final = ("time_s", "latitude", "longitude", "east", "north", "known", "missed_then", "refused")


@dataclass(frozen=True, slots=True)
class Spoken:
    """A frame on the air, as receivers take it: places of the soldiers in ``slots``, all arrays (n,).

    ``misses`` None: told in full, resolved by everyone. ``ours``: told by this hub, so later updates build on it.
    """

    slots: IntArray
    time_s: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    east: FloatArray
    north: FloatArray
    misses: int | None = None
    ours: bool = True


class Pictures:
    """``rows`` receivers' pictures of the soldiers in all slots; arrays are (rows, slots)."""

    def __init__(self, rows: int, slots: int = 0) -> None:
        shape = rows, slots
        self.time_s, self.latitude, self.longitude = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.east, self.north = np.zeros(shape), np.zeros(shape)
        self.known = np.zeros(shape, dtype=np.bool_)
        self.missed = np.zeros(rows, dtype=np.int64)
        self.missed_then = np.full(shape, -_NEVER)
        self.refused = np.zeros(shape, dtype=np.int64)

    @property
    def rows(self) -> int:
        """How many receivers."""
        return len(self.missed)

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        for name in _COLUMNS:
            fill = -_NEVER if name == "missed_then" else 0
            setattr(self, name, widened(getattr(self, name), slots, axis=1, fill=fill))

    def behind(self, slots: IntArray) -> IntArray:
        """(rows, n): how many of our frames each has missed or refused since it last took an entry of ours."""
        behind: IntArray = self.missed[:, None] - self.missed_then[:, slots] + self.refused[:, slots]
        return behind

    def hear(self, heard: BoolArray, spoken: Spoken, there: BoolArray | None = None) -> None:
        """A frame was on the air; those of ``heard`` (rows,) got it, others of ``there`` (None: all) missed it."""
        if spoken.ours:
            self.missed += ~heard if there is None else there & ~heard
        taken = np.repeat(heard[:, None], len(spoken.slots), axis=1)
        if spoken.misses is not None:
            resolves = self.behind(spoken.slots) <= spoken.misses
            self.refused[:, spoken.slots] += taken & ~resolves
            taken &= resolves
        if not spoken.ours:
            taken &= spoken.time_s > np.where(self.known, self.time_s, -np.inf)[:, spoken.slots]
        rows, entries = np.nonzero(taken)
        self._take(rows, entries, spoken)

    def _take(self, rows: IntArray, entries: IntArray, spoken: Spoken) -> None:
        slots = spoken.slots[entries]
        self.time_s[rows, slots] = spoken.time_s[entries]
        self.latitude[rows, slots] = spoken.latitude[entries]
        self.longitude[rows, slots] = spoken.longitude[entries]
        self.east[rows, slots] = spoken.east[entries]
        self.north[rows, slots] = spoken.north[entries]
        self.known[rows, slots] = True
        if spoken.ours:
            self.missed_then[rows, slots] = self.missed[rows]
            self.refused[rows, slots] = 0

    def copy(self, row: int, other: "Pictures", other_row: int) -> None:
        """Let a receiver have another's picture."""
        for name in (*_COLUMNS, "missed"):
            getattr(self, name)[row] = getattr(other, name)[other_row]

    def forget(self, slot: int) -> None:
        """Nobody knows this soldier."""
        self.known[:, slot] = False
        self.missed_then[:, slot] = -_NEVER

    def off_m(
        self, slots: IntArray, latitude: FloatArray, longitude: FloatArray, now_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """(rows, n) east and north, m, from where each receiver shows the soldiers to where they are."""
        reach_s = reaches_s(now_s - self.time_s[:, slots])
        start = self.latitude[:, slots]
        north = (latitude - start) * METRES_PER_DEG - self.north[:, slots] * reach_s
        turned = turn_deg(longitude - self.longitude[:, slots])
        return turned * METRES_PER_DEG * cosines(start) - self.east[:, slots] * reach_s, north

    def velocity_m_s(self, slots: IntArray, now_s: float) -> tuple[FloatArray, FloatArray]:
        """(rows, n) east and north, at which each receiver's symbols move now."""
        left = np.exp(-np.maximum(now_s - self.time_s[:, slots], 0.0) / DAMPING_S)
        return self.east[:, slots] * left, self.north[:, slots] * left


_NEVER: Final = 1 << 40
"""So many frames behind is who never had an entry."""


def widened(array: npt.NDArray[Any], length: int, axis: int, fill: float = 0) -> npt.NDArray[Any]:
    """``array`` with ``fill`` appended along an axis up to ``length``."""
    padding = [(0, 0)] * array.ndim
    padding[axis] = (0, max(0, length - array.shape[axis]))
    return np.pad(array, padding, constant_values=fill)
