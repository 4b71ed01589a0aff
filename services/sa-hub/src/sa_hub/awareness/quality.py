"""How well a net keeps the picture right: what each new report showed the prediction to have been wrong by.

A sender speaks when the prediction has become wrong. How wrong that is (by its budget), and how much more where
frames get lost, a receiver sees from the reports themselves: each shows the error of the prediction just before.
"""

import math
from collections import deque
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.display import RADIUS_95, Held, free_sigma_m
from bootprint.geodesy import ground_offset
from bootprint.prediction import moved_m
from sa_hub.radio.content import Report

_REMEMBERED: Final = 64
_LEAST: Final = 16
_SHARE: Final = 0.95
_EVERY: Final = 8
"""Reports after which the figures are drawn up anew."""


class NetQuality:
    """Of one net, over the last reports of all its soldiers."""

    def __init__(self) -> None:
        self.held: Held | None = None
        self._errors_m: deque[float] = deque(maxlen=_REMEMBERED)
        self._silences_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._new = 0

    def observe(self, before: Report, report: Report, arrived_ns: int) -> None:
        """A soldier's report that arrived now, and the one it follows, which was fresh until then.

        What happened while the new one was on its way is not known: it counts as free.
        """
        under_way_m = RADIUS_95 * free_sigma_m((arrived_ns - report.time_ns) / NS_PER_S)
        self._errors_m.append(math.hypot(innovation_m(before, report), under_way_m))
        self._silences_s.append((arrived_ns - before.time_ns) / NS_PER_S)
        self._new += 1
        if len(self._errors_m) >= _LEAST and self._new >= _EVERY:
            self._new = 0
            self.held = Held(_upper(self._errors_m) / RADIUS_95, _upper(self._silences_s))


def innovation_m(before: Report, report: Report) -> float:
    """How far from where ``before`` let believe, horizontally, ``report`` found the soldier."""
    east_m, north_m = ground_offset(
        (before.latitude_deg, before.longitude_deg), (report.latitude_deg, report.longitude_deg)
    )
    elapsed_s = (report.time_ns - before.time_ns) / NS_PER_S
    moved_east_m, moved_north_m = moved_m(before.east_m_s, before.north_m_s, elapsed_s)
    return math.hypot(east_m - moved_east_m, north_m - moved_north_m)


def _upper(values: deque[float]) -> float:
    """What 95 % of the values do not exceed."""
    return sorted(values)[math.ceil(_SHARE * len(values)) - 1]
