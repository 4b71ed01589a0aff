"""Height of the unit from barometer and accelerometer: without the one's noise, and without the other's drift.

The vertical acceleration is integrated twice and held by the barometer, as Sabatini and Genovese (2014) do: what
starts to climb is seen by its acceleration before the noise of pressure lets it be seen. The gains are those of the
critically damped g-h-k filter (Brookner 1998, fading memory), which any rate of samples suits.
"""

import math

_RATE_PER_S = 0.5  # of the loop: the barometer tells what is slower, the accelerometer what is faster
_LONGEST_S = 0.1  # between accelerations: in a longer gap nothing is known of them
_GRAVITY_M_S2 = 9.80665
_NS = 1e-9


class VerticalChannel:
    """``height_m`` by pressure, ``velocity_m_s`` upward, and the accelerometer's ``bias_m_s2``."""

    def __init__(self) -> None:
        self.height_m: float | None = None
        self.velocity_m_s = self.bias_m_s2 = 0.0
        self._cell_ns: int | None = None
        self._pressure_ns = 0

    def accelerate(self, time_ns: int, force_m_s2: float) -> None:
        """The mean vertical specific force of the time since the last call."""
        before_ns, self._cell_ns = self._cell_ns, time_ns
        if before_ns is None or self.height_m is None:
            return
        step_s = (time_ns - before_ns) * _NS
        if not 0.0 < step_s < _LONGEST_S:
            self.velocity_m_s = 0.0
            return
        acceleration = force_m_s2 - _GRAVITY_M_S2 - self.bias_m_s2
        self.height_m += (self.velocity_m_s + 0.5 * acceleration * step_s) * step_s
        self.velocity_m_s += acceleration * step_s

    def hold(self, time_ns: int, height_m: float) -> float:
        """A height by pressure; the unit's height by both."""
        since_s = (time_ns - self._pressure_ns) * _NS
        self._pressure_ns = time_ns
        if self.height_m is None or since_s > 1.0 / _RATE_PER_S:
            self.height_m, self.velocity_m_s = height_m, 0.0
            return height_m
        keep = math.exp(-_RATE_PER_S * since_s)
        miss = height_m - self.height_m
        self.height_m += (1.0 - keep**3) * miss
        self.velocity_m_s += 1.5 * (1.0 - keep) ** 2 * (1.0 + keep) * miss / since_s
        self.bias_m_s2 -= (1.0 - keep) ** 3 * miss / since_s**2
        return self.height_m
