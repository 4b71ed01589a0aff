"""Compass deviation by place, from one walk to the next (METHODS B5): it belongs to the place, not to the time.

A grid of cells; each keeps the mean of what the compass differed there from a better azimuth, and corrects by it as
far as it has been seen to be steady.
"""

import math
from collections.abc import Iterable

from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.pieces import FloatArray

CELL_M = 4.0
PRIOR_SIGMA_RAD = math.radians(6.0)  # deviations nobody has seen
_STEP_SIGMA_RAD = math.radians(10.0)  # of one step's


class DeviationMap:
    """Deviations seen, `Deviation` by `Deviation`; what `cells` gives makes the same map again."""

    def __init__(self, cells: Iterable[Deviation] = ()) -> None:
        self._cells = {(cell.east, cell.north): cell for cell in cells}

    def learn(self, place_m: FloatArray, compass_rad: float, better_rad: float) -> None:
        """A step at a place (2,) east, north: the compass's azimuth and a better one."""
        east, north = _key(place_m)
        deviation = compass_rad - better_rad
        known = self._cells.get((east, north), Deviation(east, north, 0.0, 0.0, 0))
        self._cells[east, north] = known._replace(
            sine=known.sine + math.sin(deviation),
            cosine=known.cosine + math.cos(deviation),
            steps=known.steps + 1,
        )

    def deviation_rad(self, place_m: FloatArray) -> tuple[float, float]:
        """What to take off a compass azimuth at a place (2,), and the sigma of what is left then.

        The mean is drawn to zero as far as it rests on few steps (Bayes, both normal).
        """
        known = self._cells.get(_key(place_m))
        if known is None:
            return 0.0, PRIOR_SIGMA_RAD
        variance = _STEP_SIGMA_RAD**2 / known.steps
        share = PRIOR_SIGMA_RAD**2 / (PRIOR_SIGMA_RAD**2 + variance)
        return share * math.atan2(known.sine, known.cosine), math.sqrt(share * variance)

    def cells(self) -> list[Deviation]:
        """All there is, in order."""
        return [self._cells[key] for key in sorted(self._cells)]


def _key(place_m: FloatArray) -> tuple[int, int]:
    return math.floor(place_m[0] / CELL_M), math.floor(place_m[1] / CELL_M)
