"""Random processes in time and random fields over places: what wanders in sensors, weather and buildings."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from proving_ground.motion import FloatArray

_FLICKER_TIMES_S = (10.0, 100.0, 1000.0)
_FLICKER_SHARE = 1.3  # sigma of each over the floor of the sum's Allan deviation; measured, as the tests do
_WAVES = 64


def gauss_markov(
    count: int,
    period_s: float,
    sigma: float,
    correlation_s: float,
    rng: np.random.Generator,
    columns: int = 1,
) -> FloatArray:
    """First-order Gauss-Markov processes in steady state, (count, columns): x' = -x/τ + w."""
    keep = np.exp(-period_s / correlation_s)
    drive = rng.normal(0.0, sigma * np.sqrt(1.0 - keep**2), (count, columns))
    drive[:1] = rng.normal(0.0, sigma, (1, columns))
    return np.asarray(lfilter([1.0], [1.0, -keep], drive, axis=0), dtype=np.float64)


def flicker(
    count: int, period_s: float, instability: float, rng: np.random.Generator, columns: int = 3
) -> FloatArray:
    """Bias that wanders like 1/f noise, (count, columns): Gauss-Markov processes a decade apart, summed.

    ``instability`` is what data sheets call in-run bias stability: the Allan deviation's floor is about
    0.664 times it, over some 5 to 500 s (IEEE Std 952-1997, annex C).
    """
    sigma = _FLICKER_SHARE * 0.664 * instability
    wander = np.zeros((count, columns))
    for time_s in _FLICKER_TIMES_S:
        wander += gauss_markov(count, period_s, sigma, time_s, rng, columns)
    return wander


def coarse(time_s: FloatArray, period_s: float) -> FloatArray:
    """Grid times that span ``time_s`` with this period: slow processes are drawn there and interpolated."""
    if not time_s.size:
        return np.zeros(2)
    first, last = np.floor(time_s.min() / period_s), np.ceil(time_s.max() / period_s)
    return np.asarray(np.arange(first, last + 2.0) * period_s, dtype=np.float64)


def interpolated(time_s: FloatArray, grid_s: FloatArray, values: FloatArray) -> FloatArray:
    """Columns of ``values`` (k, c) on the grid, linearly interpolated: (n, c)."""
    return np.column_stack([np.interp(time_s, grid_s, column) for column in values.T])


@dataclass(frozen=True)
class RandomField:
    """A smooth Gaussian field of unit variance over points (n, d): random cosine waves (Rahimi and Recht 2007).

    The same point always has the same value, whoever asks: ``directions`` (waves, d) rad/m, ``phases`` (waves, c).
    """

    directions: FloatArray
    phases: FloatArray

    @staticmethod
    def drawn(scales: npt.ArrayLike, columns: int, seed: int) -> "RandomField":
        """A field whose correlation along axis i falls as exp(-½(distance/scales[i])²); c independent columns."""
        rng = np.random.default_rng(seed)
        lengths = np.asarray(scales, dtype=np.float64)
        directions = rng.normal(0.0, 1.0, (_WAVES, lengths.size)) / lengths
        return RandomField(directions, rng.uniform(0.0, 2.0 * np.pi, (_WAVES, columns)))

    def at(self, points: FloatArray) -> FloatArray:
        """The field's values (n, c)."""
        turns = points @ self.directions.T
        weight = np.sqrt(2.0 / len(self.phases))
        # cos(a + b) = cos a cos b - sin a sin b: two products for all columns at once.
        return np.asarray(
            weight * (np.cos(turns) @ np.cos(self.phases) - np.sin(turns) @ np.sin(self.phases))
        )
