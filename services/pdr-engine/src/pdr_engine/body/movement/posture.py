"""How far the unit leans from how it is carried upright: who crawls has the trunk level.

Upright is how the unit was in the steps so far. One that is known to be fixed to the trunk (`placement`) leans as
the trunk does. Any other may be put elsewhere by its bearer, who walks on; and a crawl bounces as a walk does, so
the tilt of such a unit says nothing.
"""

import math

from pdr_engine.body.steps.attitude import Rows

_MEMORY_STEPS = 20.0
_UPRIGHT_RAD = math.radians(30.0)  # walking, running and climbing lean by less


class Posture:
    """The usual vertical in device axes."""

    def __init__(self, fixed: bool) -> None:
        self._fixed = fixed
        self._up: tuple[float, float, float] | None = None

    def tilt_rad(self, rows: Rows) -> float | None:
        """Take a step in; how far its vertical is from the usual one, None where that says nothing."""
        if not self._fixed:
            return None
        x, y, z = rows[2]
        if self._up is None:
            self._up = (x, y, z)
        a, b, c = self._up
        tilt = math.acos(max(-1.0, min(1.0, (a * x + b * y + c * z) / math.hypot(a, b, c))))
        if tilt < _UPRIGHT_RAD:
            share = 1.0 / _MEMORY_STEPS
            self._up = (a + share * (x - a), b + share * (y - b), c + share * (z - c))
        return tilt
