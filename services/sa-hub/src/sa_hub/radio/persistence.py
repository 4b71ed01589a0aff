"""How much of a soldier's velocity will still be true when the next report comes: found from the way just gone.

On a street who walks goes on walking; in a house a leg ends after seconds, and a velocity told at its begin carries
the symbol through the wall. So a velocity is told as the share of it that the soldier's own last half minute has
borne out: the regression of ways gone over some seconds on the velocity at their begin. A share too small to help
is not told at all, which saves its bits, too.
"""

from typing import Final

import numpy as np

from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.picture import IntArray, widened

MEMORY_S: Final = 30.0
LEAST_SHARE: Final = 0.8
LONGEST_S: Final = 8
"""Ways are compared over as long as reports are apart, up to this."""
_SAMPLE_S: Final = 1.0
_PRIOR_M2_S2: Final = 0.1
"""Of a velocity that nothing is known of yet, all lasts; the first ways soon outweigh that."""
_STALE_S: Final = 20.0


class Persistence:
    """The share of each slot's velocity that lasts ``horizon_s``."""

    def __init__(self) -> None:
        self._latest_s = np.empty(0)
        self._samples = np.empty((0, LONGEST_S, 5))  # newest first: time, latitude, longitude, east, north
        self._kept = np.empty(0, dtype=np.int64)
        self._borne = np.empty(0)
        self._told = np.empty(0)

    def widen(self, slots: int) -> None:
        """Make room for so many soldiers."""
        self._latest_s = widened(self._latest_s, slots, axis=0, fill=-(1 << 40))
        self._samples = widened(self._samples, slots, axis=0)
        self._kept = widened(self._kept, slots, axis=0)
        self._borne = widened(self._borne, slots, axis=0, fill=_PRIOR_M2_S2)
        self._told = widened(self._told, slots, axis=0, fill=_PRIOR_M2_S2)

    def see(self, slots: IntArray, samples: FloatArray, horizon_s: float) -> None:
        """(n, 5) time s, latitude and longitude degrees, velocity east and north m/s, as known here."""
        waited_s = samples[:, 0] - self._latest_s[slots]
        due = np.abs(waited_s) >= 0.95 * _SAMPLE_S
        slots, samples, waited_s = slots[due], samples[due], waited_s[due]
        self._kept[slots[(waited_s > _STALE_S) | (waited_s < 0.0)]] = 0
        ago = min(max(round(horizon_s / _SAMPLE_S), 1), LONGEST_S)
        able = self._kept[slots] >= ago
        self._compare(slots[able], samples[able], ago)
        self._samples[slots, 1:] = self._samples[slots, :-1]
        self._samples[slots, 0] = samples
        self._kept[slots] = np.minimum(self._kept[slots] + 1, LONGEST_S)
        self._latest_s[slots] = samples[:, 0]

    def _compare(self, slots: IntArray, now: FloatArray, ago: int) -> None:
        """Take in the way since ``ago`` samples and the velocity then."""
        then = self._samples[slots, ago - 1]
        elapsed_s = np.maximum(now[:, 0] - then[:, 0], _SAMPLE_S)
        north = (now[:, 1] - then[:, 1]) * METRES_PER_DEG / elapsed_s
        east = turn_deg(now[:, 2] - then[:, 2]) * METRES_PER_DEG * cosines(then[:, 1]) / elapsed_s
        weight = _SAMPLE_S / MEMORY_S
        borne = then[:, 3] * east + then[:, 4] * north
        told = then[:, 3] ** 2 + then[:, 4] ** 2
        self._borne[slots] += weight * (borne - self._borne[slots])
        self._told[slots] += weight * (told - self._told[slots])

    def shares(self, slots: IntArray) -> FloatArray:
        """(n,) what to multiply each velocity by before it is told."""
        shares: FloatArray = np.clip(self._borne[slots] / np.maximum(self._told[slots], 1e-3), 0.0, 1.0)
        return np.where(shares < LEAST_SHARE, 0.0, shares)
