"""How far the unit leans from how it is carried upright: who crawls has the trunk level.

Upright is how the unit was in the steps so far. One that is fixed to the trunk leans as the trunk does. Any other
may be put elsewhere by its bearer, who walks on; and a crawl bounces as a walk does, so the tilt of such a unit
says nothing. Whoever has crawled for very long has more likely put the unit elsewhere.
"""

import math

from pdr_engine.body.steps.attitude import Rows

_MEMORY_STEPS = 20.0
_UPRIGHT_RAD = math.radians(30.0)  # walking, running and climbing lean by less
_MOST_LEANING_STEPS = 400  # some 80 m on all fours


class Posture:
    """The usual vertical in device axes."""

    def __init__(self) -> None:
        self._up: tuple[float, float, float] | None = None
        self._leaning = 0

    def tilt_rad(self, rows: Rows, on_trunk: bool) -> float | None:
        """Take a step in; how far its vertical is from the usual one, None where that says nothing.

        ``on_trunk``: whether the unit is fixed to the trunk.
        """
        x, y, z = rows[2]
        if self._up is None or self._leaning > _MOST_LEANING_STEPS or not on_trunk:
            self._up, self._leaning = (x, y, z), 0
            return None
        a, b, c = self._up
        tilt = math.acos(max(-1.0, min(1.0, (a * x + b * y + c * z) / math.hypot(a, b, c))))
        if tilt < _UPRIGHT_RAD:
            share = 1.0 / _MEMORY_STEPS
            self._up = (a + share * (x - a), b + share * (y - b), c + share * (z - c))
            self._leaning = 0
        else:
            self._leaning += 1
        return tilt
