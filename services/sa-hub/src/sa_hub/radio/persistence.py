"""How long velocities last, found from the way that each soldier has just gone, and whether to tell them.

On a street who walks goes on walking; in a house a leg ends after seconds, and a velocity told at its begin carries
the symbol through the wall. How far a soldier gets along a velocity in so many seconds is the regression of ways
gone on the velocity at their begin. The velocity that is told is as much of it as so lasts until the next report.

Whether its bits are worth it shows in the same ways: from each second on, how long would a report with a velocity
have been near enough, and how long one without, that tells a place ahead instead? The one is told that needs fewer
bits a second.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from bootprint.prediction import reaches_s
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.picture import BoolArray, IntArray, widened

MEMORY_S: Final = 60.0
LONGEST_S: Final = 16
"""Ways are followed for so long."""
STANDING_M_S: Final = 0.3
_SAMPLE_S: Final = 1.0
_PRIOR_M2_S2: Final = 0.1
"""Of a velocity that nothing is known of yet, all lasts; the first ways soon outweigh that."""
_PRIOR_S: Final = 0.1
"""For so long reports were near enough to begin with, and still are."""
_STALE_S: Final = 20.0
_WEIGHT: Final = _SAMPLE_S / MEMORY_S
MOMENTS: Final = np.array([1.0, 3.0, 5.0]) / 6.0
"""Of the time until the next report: the middles of its thirds."""


@dataclass(frozen=True, slots=True)
class Standard:
    """What reports are measured by: near enough below ``near_m``, and to last ``ahead_s``.

    Each takes ``bits``, and ``velocity_bits`` of them are for the velocity.
    """

    near_m: float
    ahead_s: float
    bits: float
    velocity_bits: float


class Persistence:
    """What lasts of each slot's velocity, and for how long reports without it and with it have been near enough."""

    def __init__(self) -> None:
        self._latest_s = np.empty(0)
        self._samples = np.empty((0, LONGEST_S, 5))  # newest first: time, latitude, longitude, east, north
        self._kept = np.empty(0, dtype=np.int64)
        self._borne = np.empty((0, LONGEST_S))
        self._told = np.empty((0, LONGEST_S))
        self._near_s = np.empty((0, 2))  # without a velocity, and with it
        self._ended = np.empty((0, 2))

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        self._latest_s = widened(self._latest_s, slots, axis=0, fill=-(1 << 40))
        self._samples = widened(self._samples, slots, axis=0)
        self._kept = widened(self._kept, slots, axis=0)
        self._borne = widened(self._borne, slots, axis=0, fill=_PRIOR_M2_S2)
        self._told = widened(self._told, slots, axis=0, fill=_PRIOR_M2_S2)
        self._near_s = widened(self._near_s, slots, axis=0, fill=_PRIOR_S)
        self._ended = widened(self._ended, slots, axis=0)

    def see(self, slots: IntArray, samples: FloatArray, standard: Standard) -> None:
        """(n, 5) time s, latitude and longitude degrees, velocity east and north m/s, as known here."""
        waited_s = samples[:, 0] - self._latest_s[slots]
        due = np.abs(waited_s) >= 0.95 * _SAMPLE_S
        if not due.any():
            return
        slots, samples, waited_s = slots[due], samples[due], waited_s[due]
        self._kept[slots[(waited_s > _STALE_S) | (waited_s < 0.0)]] = 0
        self._compare(slots, samples)
        self._race(slots, samples, standard)
        self._samples[slots, 1:] = self._samples[slots, :-1]
        self._samples[slots, 0] = samples
        self._kept[slots] = np.minimum(self._kept[slots] + 1, LONGEST_S)
        self._latest_s[slots] = samples[:, 0]

    def _compare(self, slots: IntArray, now: FloatArray) -> None:
        """Take in the ways since all samples, and the velocity then."""
        then = self._samples[slots]
        elapsed_s, east_m, north_m = _ways(then, now[:, None])
        lag = np.rint(elapsed_s / _SAMPLE_S).astype(np.int64) - 1
        there = (np.arange(LONGEST_S) < self._kept[slots, None]) & (lag >= 0) & (lag < LONGEST_S)
        rows, columns = np.nonzero(there)
        at = slots[rows], lag[rows, columns]
        then = then[rows, columns]
        borne = (then[:, 3] * east_m[there] + then[:, 4] * north_m[there]) / reaches_s(elapsed_s[there])
        told = then[:, 3] ** 2 + then[:, 4] ** 2
        self._borne[at] += _WEIGHT * (borne - self._borne[at])
        self._told[at] += _WEIGHT * (told - self._told[at])

    def _race(self, slots: IntArray, now: FloatArray, standard: Standard) -> None:
        """From the oldest sample on: how long are reports near enough, one without a velocity and one with it?"""
        then = self._samples[slots, -1]
        able = (self._kept[slots] == LONGEST_S) & (np.hypot(then[:, 3], then[:, 4]) >= STANDING_M_S)
        if not able.any():
            return
        slots, then = slots[able], then[able]
        path = np.concatenate([self._samples[slots, -2::-1], now[able, None]], axis=1)
        elapsed_s, east_m, north_m = _ways(then[:, None], path)
        lasting = self.lasting(slots)
        for told, share in enumerate((np.zeros(len(slots)), self._told_share(slots, lasting, standard))):
            ahead_s = _told_ahead_s(lasting, share, standard.ahead_s)
            shown_s = ahead_s[:, None] + share[:, None] * reaches_s(elapsed_s)
            off_m = np.hypot(east_m - then[:, 3:4] * shown_s, north_m - then[:, 4:5] * shown_s)
            near_s, ended = _near_s(off_m, elapsed_s, standard.near_m)
            self._near_s[slots, told] += _WEIGHT * (near_s - self._near_s[slots, told])
            self._ended[slots, told] += _WEIGHT * (ended - self._ended[slots, told])

    def lasting(self, slots: IntArray) -> FloatArray:
        """(n, LONGEST_S) what share of each velocity lasts for 1, 2, … s."""
        shares: FloatArray = np.clip(self._borne[slots] / np.maximum(self._told[slots], 1e-3), 0.0, 1.0)
        return shares

    def shares(self, slots: IntArray, standard: Standard) -> FloatArray:
        """(n,) what to multiply each velocity by before it is told; 0 where it is not worth its bits."""
        ended_per_s = self._ended[slots] / self._near_s[slots]
        is_worth = ended_per_s[:, 1] * standard.bits <= ended_per_s[:, 0] * (
            standard.bits - standard.velocity_bits
        )
        return np.where(is_worth, self._told_share(slots, self.lasting(slots), standard), 0.0)

    def _told_share(self, slots: IntArray, lasting: FloatArray, standard: Standard) -> FloatArray:
        """(n,) that lasts until the next report: for as long as reports with a velocity have been near enough."""
        until_s = self._near_s[slots, 1] / np.maximum(self._ended[slots, 1], 1e-3)
        return _share(lasting, np.maximum(until_s, standard.ahead_s))


def reached_s(lasting: FloatArray, seconds: FloatArray) -> FloatArray:
    """(…, n) as `reaches_s`, for velocities of which the shares ``lasting`` (n, LONGEST_S) last."""
    reached: FloatArray = _share(lasting, seconds) * reaches_s(seconds)
    return reached


def _told_ahead_s(lasting: FloatArray, share: FloatArray, ahead_s: float) -> FloatArray:
    """(n,) s of velocity by which a report that tells a ``share`` of it tells who goes on ahead of where he is."""
    moments_s = ahead_s * MOMENTS
    reached = [
        (_share(lasting, at_s) - share) * reach_s
        for at_s, reach_s in zip(moments_s, reaches_s(moments_s), strict=True)
    ]
    ahead: FloatArray = np.mean(reached, axis=0)
    return ahead


def _share(lasting: FloatArray, seconds: FloatArray | float) -> FloatArray:
    """(…, n) between the shares of whole seconds; what lasts longest goes on; ``seconds`` (…, n)."""
    at = np.clip(np.asarray(seconds) / _SAMPLE_S, 1.0, LONGEST_S) - 1.0
    below = np.minimum(at.astype(np.int64), LONGEST_S - 2)
    rows, more = np.arange(len(lasting)), at - below
    share: FloatArray = (1.0 - more) * lasting[rows, below] + more * lasting[rows, below + 1]
    return share


def _ways(then: FloatArray, now: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Seconds, m east and m north from one sample to another, by broadcasting."""
    elapsed_s = now[..., 0] - then[..., 0]
    north_m = (now[..., 1] - then[..., 1]) * METRES_PER_DEG
    east_m = turn_deg(now[..., 2] - then[..., 2]) * METRES_PER_DEG * cosines(now[..., 1])
    return elapsed_s, east_m, north_m


def _near_s(off_m: FloatArray, elapsed_s: FloatArray, near_m: float) -> tuple[FloatArray, BoolArray]:
    """(n,) for how long errors (n, K) at these times are below ``near_m``, and whether that has ended."""
    far: BoolArray = off_m > near_m
    ended = np.logical_or.reduce(far, axis=1)
    rows, first = np.arange(len(off_m)), np.where(ended, far.argmax(axis=1), -1)
    before = np.maximum(first - 1, 0)
    step_m = np.maximum(off_m[rows, first] - off_m[rows, before], 1e-9)
    part = np.where(ended, np.clip((near_m - off_m[rows, before]) / step_m, 0.0, 1.0), 1.0)
    near_s: FloatArray = elapsed_s[rows, before] + part * (elapsed_s[rows, first] - elapsed_s[rows, before])
    return np.where(ended, near_s, elapsed_s[:, -1]), ended
