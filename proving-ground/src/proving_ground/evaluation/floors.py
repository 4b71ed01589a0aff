"""Floors that an estimator told against those of the truth."""

from dataclasses import dataclass

import numpy as np

from proving_ground.evaluation.alignment import FloatArray
from sensor_gateway.recordings.run import Truth


@dataclass(frozen=True, slots=True)
class Floors:
    """From ``time_s`` (n,) on, floor ``number`` (n,), counted from wherever the estimator began."""

    time_s: FloatArray
    number: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """What was known at these times (k,); before the first the first."""
        index = np.searchsorted(self.time_s, time_s, side="right") - 1
        return np.asarray(self.number[np.maximum(index, 0)])


def floors_right_pct(floors: Floors | None, truth: Truth | None) -> float | None:
    """Share of the truth's points with a floor at which the one told was right, both counted from the first.

    None if either knows no floors.
    """
    if floors is None or truth is None or truth.floor is None:
        return None
    known = np.isfinite(truth.floor)
    if not known.any():
        return None
    told, right = floors.at(truth.time_s[known]), truth.floor[known]
    return 100.0 * float(np.mean(told - told[0] == right - right[0]))
