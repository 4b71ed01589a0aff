"""The chi-square distribution's quantile, for gates: of its closed form, without the modules of scipy.stats.

Every computer runs a fusion, and scipy's special functions would be a sixth of its memory.
"""

import math
from functools import lru_cache

_HALVINGS = 200  # more than a float has digits


def survival(value: float, degrees: int) -> float:
    """The probability that a chi-square variable of so many degrees of freedom exceeds ``value`` (not negative).

    Abramowitz and Stegun 26.4.4 (odd degrees) and 26.4.5 (even ones).
    """
    half = value / 2.0
    term, total = math.exp(-half), 0.0
    if degrees % 2:
        total, term = math.erfc(math.sqrt(half)), term * 2.0 * math.sqrt(half / math.pi)
    for number in range(degrees // 2):
        total += term
        term *= half / (number + (1.5 if degrees % 2 else 1.0))
    return total


@lru_cache(maxsize=256)
def chi_square_quantile(probability: float, degrees: int) -> float:
    """The value that a chi-square variable stays below with this probability, by bisection."""
    beyond = 1.0 - probability
    low, high = 0.0, float(degrees)
    while survival(high, degrees) > beyond:
        low, high = high, 2.0 * high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if survival(middle, degrees) > beyond else (low, middle)
    return high
