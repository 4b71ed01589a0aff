"""What this hub itself told of each soldier, newest first: what its next update may be told against.

A receiver resolves an update from whichever of these entries it heard last. So the modulus must be wide enough for
the prediction from every entry that it may have stayed with.
"""

from typing import Final

import numpy as np

from bootprint.prediction import reaches_s
from sa_hub.radio import quantise as q
from sa_hub.radio.content import Report
from sa_hub.radio.details import DETAILS, details_code
from sa_hub.radio.grid import Grid
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.picture import BoolArray, IntArray, Spoken, widened

STEADY_M_S: Final = 0.3
"""A velocity that has changed by less need not be told again: about what rounding makes of it."""
_SAME_M_S: Final = 1e-6
DEPTH: Final = 15
"""Entries kept: one more than a receiver may miss."""
MARGIN_CELLS: Final = 0.51
"""A place lies anywhere in its cell, whose middle is told; a hundredth is for rounding."""


class History:
    """The newest entries of each slot; ``told`` is the newest as receivers have it, by slot."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self.told: dict[int, Report] = {}
        self._time_s = np.empty((0, DEPTH))
        self._latitude = np.empty((0, DEPTH))
        self._longitude = np.empty((0, DEPTH))
        self._east = np.empty((0, DEPTH))
        self._north = np.empty((0, DEPTH))
        self._details = np.empty((0, DEPTH, DETAILS), dtype=np.int64)
        self._whole = False
        self._kept = np.empty(0, dtype=np.int64)
        self._anew = np.empty(0, dtype=np.bool_)

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        for name in ("_time_s", "_latitude", "_longitude", "_east", "_north", "_details"):
            setattr(self, name, widened(getattr(self, name), slots, axis=0))
        self._kept = widened(self._kept, slots, axis=0)
        self._anew = widened(self._anew, slots, axis=0)

    def spoke(self, spoken: Spoken, reports: tuple[Report, ...]) -> None:
        """These were told."""
        slots = spoken.slots
        for array, newest in (
            (self._time_s, spoken.time_s),
            (self._latitude, spoken.latitude),
            (self._longitude, spoken.longitude),
            (self._east, spoken.east),
            (self._north, spoken.north),
            (self._details, [details_code(report, None) for report in reports] or np.empty((0, DETAILS))),
        ):
            array[slots, 1:] = array[slots, :-1]
            array[slots, 0] = newest
        self._kept[slots] = np.minimum(self._kept[slots] + 1, DEPTH)
        self._anew[slots] = False
        self.told.update(zip(slots.tolist(), reports, strict=True))

    def forget(self, slot: int) -> None:
        """Tell this soldier in full next; receivers may stay with what was told before, so that still counts."""
        self._anew[slot] = True
        self.told.pop(slot, None)

    def clear(self) -> None:
        """As if nobody had been told, but receivers may stay with entries that are gone here."""
        self._kept[:] = 0
        self._whole = False
        self.told.clear()

    def epoch_begins(self) -> None:
        """The first frame of all was sent: what is kept from now on is all that receivers can have."""
        self._whole = True

    def details_differ(self, slots: IntArray, details: IntArray) -> BoolArray:
        """(n, DEPTH, DETAILS) whether each detail is other than in any of the newest 1, 2, … entries.

        ``details`` (n, DETAILS) are their `details_code` now.
        """
        differ = self._details[slots] != details[:, None, :]
        differ &= self._exists(slots)[:, :, None]
        return np.logical_or.accumulate(differ, axis=1)

    def as_told(self, slots: IntArray, velocity: FloatArray) -> FloatArray:
        """(n, 2) the velocity to tell: the one told last where this one is near enough, so that it stays steady."""
        told = np.column_stack([self._east[slots, 0], self._north[slots, 0]])
        near = np.hypot(*(velocity - told).T) < STEADY_M_S
        kept: FloatArray = np.where((near & self._exists(slots)[:, 0])[:, None], told, velocity)
        return kept

    def steady(self, slots: IntArray, velocity: FloatArray) -> BoolArray:
        """(n, DEPTH) whether each of the newest 1, 2, … entries told the same velocity, near enough to this one.

        ``velocity`` (n, 2) is what would be told, m/s.
        """
        east, north = self._east[slots], self._north[slots]
        same = np.hypot(east - east[:, :1], north - north[:, :1]) < _SAME_M_S
        near = np.hypot(velocity[:, 0] - east[:, 0], velocity[:, 1] - north[:, 0]) < STEADY_M_S
        steady: BoolArray = np.logical_and.accumulate(same | ~self._exists(slots), axis=1) & near[:, None]
        return steady

    def cells_off(
        self, slots: IntArray, latitude: FloatArray, longitude: FloatArray, now_s: float
    ) -> FloatArray:
        """(n, DEPTH) how far off, in finest cells, prediction is from the worst of the newest 1, 2, … entries.

        Infinite where receivers may have another one, or none. ``latitude`` and ``longitude`` (n,) are where the
        soldiers are to be told, degrees.
        """
        reach_s = reaches_s(now_s - self._time_s[slots])
        start = self._latitude[slots]
        north_deg = self._north[slots] * reach_s / METRES_PER_DEG
        east_deg = self._east[slots] * reach_s / (METRES_PER_DEG * cosines(start))
        rows = np.abs(latitude[:, None] - start - north_deg) / q.cell_deg(0)
        columns = np.abs(turn_deg(longitude[:, None] - self._longitude[slots] - east_deg))
        off = np.maximum(rows, columns / self._grid.column_deg(0))
        gone = (self._kept[slots] == 0) | (not self._whole)
        off = np.where(self._exists(slots), off, np.where(gone, np.inf, 0.0)[:, None])
        off[self._anew[slots]] = np.inf
        return np.maximum.accumulate(off, axis=1)

    def _exists(self, slots: IntArray) -> BoolArray:
        """(n, DEPTH) whether so many entries were told."""
        exists: BoolArray = np.arange(DEPTH) < self._kept[slots, None]
        return exists


def allowed_cells(resolution: int, reach_bits: int) -> float:
    """How far off, in finest cells, a prediction may be so that the modulus resolves it."""
    return ((1 << (reach_bits - 1)) - MARGIN_CELLS) * (1 << resolution)
