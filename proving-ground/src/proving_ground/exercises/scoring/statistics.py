"""How sure a mean is: Student's t interval, for paired differences and for repetitions with other seeds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Mean:
    """A mean of ``n`` values and half the width of its 95 % interval; None where n is too small to tell."""

    mean: float
    half_width: float | None
    n: int

    @property
    def is_beyond_noise(self) -> bool:
        """Whether zero lies outside the interval."""
        return self.half_width is not None and abs(self.mean) > self.half_width


def mean_of(values: Sequence[float]) -> Mean:
    """The mean of values that are taken as independent; ValueError if there is none."""
    if not values:
        raise ValueError("no values, no mean")
    n = len(values)
    mean = float(np.mean(values))
    if n < 2:
        return Mean(mean, None, n)
    spread = float(np.std(values, ddof=1)) / np.sqrt(n)
    return Mean(mean, float(t.ppf(0.5 + CONFIDENCE / 2.0, n - 1) * spread), n)
