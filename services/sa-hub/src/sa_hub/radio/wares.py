"""Who may be told now: where everyone is, and where they are believed to go."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.prediction import reaches_s
from sa_hub.radio.content import Report
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.picture import IntArray

BRIEF_S: Final = 1.5
"""Time constant of a velocity that does not last: of legs in a building."""


@dataclass(frozen=True)
class Candidates:
    """Who may be told: reports, their slots, and where they are ``now_s``; arrays are (n,), degrees and m/s.

    ``samples`` (n, 5) are time, latitude, longitude and velocity as known; ``lasting`` (n, 2) is the part of the
    velocity that will last.
    """

    reports: Sequence[Report]
    slots: IntArray
    samples: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    now_s: float
    lasting: FloatArray

    def way_m(self, seconds: float) -> FloatArray:
        """(n, 2) m east and north that they are believed to go in the next seconds."""
        age_s = self.now_s - self.time_s
        lasting_s = reaches_s(age_s + seconds) - reaches_s(age_s)
        briefly_s = brief_s(age_s + seconds) - brief_s(age_s)
        way: FloatArray = lasting_s[:, None] * self.lasting + briefly_s[:, None] * (
            self.velocity - self.lasting
        )
        return way

    @property
    def time_s(self) -> FloatArray:
        """The reports' times."""
        return self.samples[:, 0]

    @property
    def velocity(self) -> FloatArray:
        """(n, 2) east and north as known."""
        return self.samples[:, 3:5]

    @property
    def numbers(self) -> list[int]:
        """Whose reports they are."""
        return [report.number for report in self.reports]

    def span_m(self) -> float:
        """How far apart they lie, the longer way of north and east."""
        north = np.ptp(self.latitude) * METRES_PER_DEG
        east = np.ptp(self.longitude) * METRES_PER_DEG * float(cosines(self.latitude[:1])[0])
        return float(max(north, east))


def samples_of(reports: Sequence[Report], base_ns: int) -> FloatArray:
    """(n, 5) time s since ``base_ns``, latitude and longitude degrees, velocity east and north m/s."""
    rows = [
        (
            (each.time_ns - base_ns) / NS_PER_S,
            each.latitude_deg,
            each.longitude_deg,
            each.east_m_s,
            each.north_m_s,
        )
        for each in reports
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def candidates_of(
    reports: Sequence[Report], slots: IntArray, samples: FloatArray, shares: FloatArray, now_s: float
) -> Candidates:
    """The reports, moved on to now: the lasting ``shares`` of velocity by the rule, the rest briefly."""
    time_s, latitude, longitude, east, north = samples.T
    age_s = now_s - time_s
    reach_s = shares * reaches_s(age_s) + (1.0 - shares) * brief_s(age_s)
    latitude_now = np.clip(latitude + north * reach_s / METRES_PER_DEG, -90.0, 90.0)
    longitude_now = longitude + east * reach_s / (METRES_PER_DEG * cosines(latitude))
    lasting = samples[:, 3:5] * shares[:, None]
    return Candidates(reports, slots, samples, latitude_now, turn_deg(longitude_now), now_s, lasting)


def brief_s(elapsed_s: FloatArray) -> FloatArray:
    """As `reaches_s`, for a velocity that does not last."""
    brief: FloatArray = -BRIEF_S * np.expm1(-np.clip(elapsed_s, 0.0, None) / BRIEF_S)
    return brief
