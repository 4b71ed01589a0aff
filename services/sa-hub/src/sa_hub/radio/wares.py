"""Who may be told now and what it is worth: where everyone is, and how wrong receivers' pictures of them are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.prediction import reaches_s
from sa_hub.radio.content import Report
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines
from sa_hub.radio.picture import IntArray, Pictures

HORIZON_S: Final = 1.0
"""A velocity that is wrong counts as the error that it makes within this time."""
CURVE: Final = 1.6
"""Worth grows a little faster than the error: one symbol 20 m off is worse than three 10 m off."""
BRIEF_S: Final = 2.0
"""Time constant of a velocity that does not last: of legs in a building."""
UNKNOWN_M: Final = 20.0
SILENCE_WORTH: Final = 0.3


@dataclass(frozen=True)
class Candidates:
    """Who may be told: reports, their slots, and where they are ``now_s``; arrays are (n,), degrees and m/s.

    ``samples`` (n, 5) are time, latitude, longitude and velocity as known; the velocity to tell may be less.
    """

    reports: Sequence[Report]
    slots: IntArray
    samples: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    now_s: float

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
    return Candidates(reports, slots, samples, latitude_now, (longitude_now + 180.0) % 360.0 - 180.0, now_s)


def brief_s(elapsed_s: FloatArray) -> FloatArray:
    """As `reaches_s`, for a velocity that does not last."""
    brief: FloatArray = -BRIEF_S * np.expm1(-np.clip(elapsed_s, 0.0, None) / BRIEF_S)
    return brief


def worth(
    who: Candidates, told: FloatArray, pictures: Pictures, enough_m: float, heartbeat_s: float
) -> FloatArray:
    """(rows, n) of telling each soldier to each receiver. ``told`` (n, 2): the velocity that would be told."""
    east, north = pictures.off_m(who.slots, who.latitude, who.longitude, who.now_s)
    shown_east, shown_north = pictures.velocity_m_s(who.slots, who.now_s)
    off_m = np.hypot(
        east + HORIZON_S * (told[:, 0] - shown_east), north + HORIZON_S * (told[:, 1] - shown_north)
    )
    known = pictures.known[:, who.slots]
    error_m = np.where(known, np.maximum(off_m - enough_m, 0.0), UNKNOWN_M)
    silence = np.maximum(who.time_s - pictures.time_s[:, who.slots], 0.0) / heartbeat_s
    value: FloatArray = error_m**CURVE + np.where(known, SILENCE_WORTH * silence**2, 0.0)
    return value
