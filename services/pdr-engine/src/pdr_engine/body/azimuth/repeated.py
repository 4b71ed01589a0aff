"""A compass where somebody has walked before (METHODS B5): the place's deviation is taken off its readings.

The place is that of the newest good satellite fix and the steps since; while it is known to a cell of the map the
deviations of this walk are learned, too, for the next one. On the way they are what the compass differs from the
azimuth that gyro and compass together tell.
"""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pdr_engine.body.azimuth.compass import Reading
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.azimuth.deviation_map import CELL_M, PRIOR_SIGMA_RAD, DeviationMap
from pdr_engine.body.azimuth.heading import Heading

WORST_ACCURACY_M = 5.0
_STEPS_SHARE = 0.02  # of the way since the fix, by which the place may be off
_CELLS = 4.0  # by how many cells the place may be off
_SURE_RAD = 0.2  # sigma of an azimuth from which deviations are learned


class Repeated:
    """Corrects readings by the map's deviations and adds to them; nothing before the first fix."""

    def __init__(self, cells: Iterable[Deviation] = ()) -> None:
        self._before = DeviationMap(cells)
        self._now = DeviationMap(cells)
        self._place_m = np.zeros(2)
        self._sigma_m = math.inf

    def fix(self, east_m: float, north_m: float, accuracy_m: float) -> None:
        """A satellite fix in a frame that is the same on every walk."""
        if accuracy_m <= min(WORST_ACCURACY_M, self._sigma_m):
            self._place_m, self._sigma_m = np.array([east_m, north_m]), accuracy_m

    def walk(self, length_m: float, azimuth_rad: float) -> None:
        """A step as it is published."""
        self._place_m = self._place_m + length_m * np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
        self._sigma_m += _STEPS_SHARE * length_m

    @property
    def placed(self) -> bool:
        """Whether the place is known well enough for the map."""
        return self._sigma_m < _CELLS * CELL_M

    def corrected(self, reading: Reading) -> Reading:
        """What earlier walks say that the compass would read without this place's iron."""
        if not self.placed:
            return reading
        deviation, left_rad = self._before.deviation_rad(self._place_m)
        return replace(
            reading,
            azimuth_rad=(reading.azimuth_rad - deviation) % math.tau,
            lasting_variance=reading.lasting_variance * (left_rad / PRIOR_SIGMA_RAD) ** 2,
        )

    def learn(self, reading: Reading, heading: Heading) -> None:
        """A reading as it was, and the azimuth that was told in the end."""
        if self.placed and heading.sigma_rad < _SURE_RAD:
            self._now.learn(self._place_m, reading.azimuth_rad, heading.azimuth_rad)

    def cells(self) -> list[Deviation]:
        """The map for the next walk."""
        return self._now.cells()
