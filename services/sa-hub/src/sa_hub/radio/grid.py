"""The lattice that updates are told on: rows as everywhere, columns widened so that cells are about square.

Where the realm lies decides how much wider a column is than a row is high, so all hubs of a realm agree, and a
number of cells is as many metres east as north.
"""

import math
from typing import Final

from bootprint.config import Origin
from sa_hub.radio import quantise as q

_WIDEST: Final = 7  # doublings: at 89.6° of latitude


class Grid:
    """Rows and columns of one realm at any resolution."""

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        cosine = max(math.cos(math.radians(origin.latitude_deg)), 2.0**-_WIDEST)
        self._wider = round(math.log2(1.0 / cosine))

    def row(self, latitude_deg: float, resolution: int) -> int:
        """The row of a latitude."""
        return q.latitude_index(latitude_deg, resolution)

    def column(self, longitude_deg: float, resolution: int) -> int:
        """The column of a longitude."""
        return q.longitude_index(longitude_deg, resolution + self._wider)

    def column_deg(self, resolution: int) -> float:
        """Width of a column, degrees of longitude."""
        return q.cell_deg(resolution + self._wider)

    def row_nearest(self, low: int, bits: int, latitude_deg: float, resolution: int) -> int:
        """The row with these low bits whose middle is nearest to a latitude; it may lie beyond a pole."""
        return _nearest(low, bits, latitude_deg / q.cell_deg(resolution))

    def column_nearest(self, low: int, bits: int, longitude_deg: float, resolution: int) -> int:
        """The column with these low bits whose middle is nearest to a longitude, across the antimeridian too."""
        nearest = _nearest(low, bits, longitude_deg / self.column_deg(resolution))
        return q.wrap(nearest, q.LONGITUDE_BITS - resolution - self._wider)

    def centre_deg(self, row: int, column: int, resolution: int) -> tuple[float, float]:
        """Latitude and longitude of a cell's middle."""
        return (
            q.cell_centre_deg(row, resolution),
            q.cell_centre_deg(column, resolution + self._wider),
        )


def _nearest(low: int, bits: int, cells: float) -> int:
    """The number with these low bits that, plus a half, is nearest to ``cells``."""
    modulus = 1 << bits
    return low + modulus * round((cells - 0.5 - low) / modulus)
