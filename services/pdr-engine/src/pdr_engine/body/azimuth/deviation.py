"""One cell of the map of compass deviations, as it is kept on disk."""

from typing import NamedTuple


class Deviation(NamedTuple):
    """A cell's east and north number, sums of sine and cosine of its deviations, and of how many ``steps``."""

    east: int
    north: int
    sine: float
    cosine: float
    steps: int
