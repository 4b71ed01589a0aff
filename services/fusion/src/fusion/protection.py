"""How far off the position may be, even if something was wrong that no check has noticed (METHODS A9).

Beside satellites the question is: what if the receiver has lied all along? Then the truth is where the oldest
shadow is (`fusion.shadows`), give or take its error. Without satellites it is: what if the heading has been
disturbed by as much as nobody would notice, ever since the last place that was known by itself?
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.geodesy import major_axis_sigma_m
from bootprint.messages import Vector3
from fusion.chi_square import chi_square_quantile
from fusion.models import body
from fusion.shadows import Shadows
from fusion.state import Array

_UNNOTICED_RAD = math.radians(2.0)


@dataclass(frozen=True, slots=True)
class Protection:
    """``radius_m`` holds the truth with 95 %, the effect ``external_m`` of an unnoticed disturbance included."""

    radius_m: float
    external_m: float


def radius_m(covariance: Array) -> float:
    """Of a circle that holds 95 % of a Gaussian error, its long axis all round, m."""
    sigma = major_axis_sigma_m(float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1]))
    return math.sqrt(chi_square_quantile(0.95, 2)) * sigma


class Protector:
    """Remembers the last absolute place."""

    def __init__(self, shadows: Shadows) -> None:
        self._shadows = shadows
        self._known: Vector3 | None = None

    def know(self, enu: Vector3) -> None:
        """Satellites or a person have told the place, by itself."""
        self._known = enu

    def protect(self, enu: Vector3, covariance: Array, now_ns: int, *, by_satellites: bool) -> Protection:
        """Of a position with this covariance (3, 3)."""
        inner = radius_m(covariance)
        if by_satellites:
            self.know(enu)
        external = self._if_satellites_lie(enu, inner, now_ns) if by_satellites else self._if_turned(enu)
        return Protection(inner + external, external)

    def _if_satellites_lie(self, enu: Vector3, inner_m: float, now_ns: int) -> float:
        oldest = next(iter(self._shadows), None)
        if oldest is None:
            return 0.0
        stands, state = oldest.boots.stands(now_ns), oldest.boots.filter.state
        jacobian = body.position_jacobian(state, stands)[:2]
        apart = float(np.hypot(*(np.array(enu[:2]) - body.position(state, stands)[:2])))
        reach = apart + radius_m(jacobian @ oldest.boots.filter.covariance @ jacobian.T)
        return max(0.0, reach - inner_m)

    def _if_turned(self, enu: Vector3) -> float:
        if self._known is None:
            return 0.0
        return _UNNOTICED_RAD * math.hypot(enu[0] - self._known[0], enu[1] - self._known[1])
