"""Who may be told now: where everyone is, and where they are believed to go."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio.content import Report
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.persistence import reached_s
from sa_hub.radio.picture import IntArray


@dataclass(frozen=True)
class Candidates:
    """Who may be told: reports, their slots, and where they are ``now_s``; arrays are (n,), degrees and m/s.

    ``samples`` (n, 5) are time, latitude, longitude and velocity as known; ``lasting`` (n, seconds) is the
    share of the velocity that lasts so long, see `Persistence.lasting`.
    """

    reports: Sequence[Report]
    slots: IntArray
    samples: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    now_s: float
    lasting: FloatArray

    def way_m(self, seconds: FloatArray) -> FloatArray:
        """(k, n, 2) m east and north that they are believed to go in each of k times."""
        age_s = self.now_s - self.time_s
        then_s = age_s + seconds[:, None]
        reach_s = reached_s(self.lasting, then_s) - reached_s(self.lasting, age_s)
        way: FloatArray = reach_s[:, :, None] * self.velocity
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
    reports: Sequence[Report], slots: IntArray, samples: FloatArray, lasting: FloatArray, now_s: float
) -> Candidates:
    """The reports, moved on to now by as much of their velocity as is ``lasting``."""
    time_s, latitude, longitude, east, north = samples.T
    reach_s = reached_s(lasting, now_s - time_s)
    latitude_now = np.clip(latitude + north * reach_s / METRES_PER_DEG, -90.0, 90.0)
    longitude_now = longitude + east * reach_s / (METRES_PER_DEG * cosines(latitude))
    return Candidates(reports, slots, samples, latitude_now, turn_deg(longitude_now), now_s, lasting)
