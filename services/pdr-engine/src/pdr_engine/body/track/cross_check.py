"""The three azimuths of a step against each other, all the time (METHODS A10): who errs is rejected and counted.

That of satellites is of a stretch some seconds ago; the gyro carries it to now.
"""

import math

from pdr_engine.body.track.reliability import agreed

Angle = tuple[float, float]
"""An azimuth and its sigma, rad."""


class CrossCheck:
    """``rejected``: how often each source was."""

    def __init__(self) -> None:
        self.rejected = {"compass": 0, "gyro": 0, "gnss": 0}
        self._stretch_rad: float | None = None
        self._gyro_then_rad = 0.0

    def step(self, compass: Angle | None, gyro: Angle, satellites: Angle | None) -> tuple[str, ...]:
        """The names of those that the others contradict at a step."""
        sources = {"gyro": gyro}
        if compass is not None:
            sources["compass"] = compass
        if satellites is not None:
            sources["gnss"] = (self._carried(satellites[0], gyro[0]), satellites[1])
        consensus = agreed(sources, circle=True)
        names = () if consensus is None else consensus.rejected
        for name in names:
            self.rejected[name] += 1
        return names

    def _carried(self, stretch_rad: float, gyro_rad: float) -> float:
        if stretch_rad != self._stretch_rad:
            self._stretch_rad, self._gyro_then_rad = stretch_rad, gyro_rad
        return stretch_rad + math.remainder(gyro_rad - self._gyro_then_rad, math.tau)
