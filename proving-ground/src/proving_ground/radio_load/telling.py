"""What a soldier's fusion would say of a walk: late, with errors that wander, a stride's mean as velocity.

The figures are those of positions that this project's fusion gave on simulated walks of the library (`exercise run
--mode inprocess`, urban-patrol and building-clearing, seed 1): increments of the error over 1 to 60 s, the
velocity's lag behind the truth and what is left of it then, the time from a stamp to its publication.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from proving_ground.sensors.randomness import gauss_markov

FloatArray = npt.NDArray[np.float64]
PERIOD_S: Final = 0.2
"""Between positions: fusion publishes five a second."""
DELAY_S: Final = 0.5
"""From a position's stamp to its publication."""
_STRIDE_S: Final = 1.0
_LAG_S: Final = 0.5
_STANDING_M_S: Final = 0.15
_VELOCITY_SIGMA_M_S: Final = 0.05
_VELOCITY_CORRELATION_S: Final = 0.4


@dataclass(frozen=True)
class Telling:
    """How a fusion errs: a Gauss-Markov error (each axis), and now and then a jump when a fix is believed again."""

    error_m: float
    correlation_s: float
    jumps_per_s: float = 0.0
    jump_m: float = 0.0


OUTDOORS: Final = Telling(error_m=1.8, correlation_s=300.0, jumps_per_s=1.0 / 300.0, jump_m=1.5)
"""Boots and a receiver among houses."""
INDOORS: Final = Telling(error_m=0.6, correlation_s=300.0)
"""Boots alone, for a quarter of an hour."""


def told(walk_m: FloatArray, telling: Telling, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Positions (T, 3) and velocities (T, 2) m/s that fusion tells of a walk (T, 3), every `PERIOD_S`."""
    place = walk_m.copy()
    place[:, :2] += _error_m(len(walk_m), telling, rng)
    return place, _stride_velocity(walk_m[:, :2], rng)


def _error_m(count: int, telling: Telling, rng: np.random.Generator) -> FloatArray:
    wander = gauss_markov(count, PERIOD_S, telling.error_m, telling.correlation_s, rng, columns=2)
    jumps = np.zeros((count, 2))
    when = rng.random(count) < telling.jumps_per_s * PERIOD_S
    jumps[when] = rng.normal(0.0, telling.jump_m, (int(when.sum()), 2))
    # A jump is forgotten as the rest of the error is.
    kept = np.exp(-PERIOD_S / telling.correlation_s)
    for index in np.flatnonzero(when):
        wander[index:] += jumps[index] * kept ** np.arange(count - index)[:, None]
    return wander


def _stride_velocity(walk_m: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The mean over the last full stride, zero when nearly standing."""
    count, stride, lag = len(walk_m), round(_STRIDE_S / PERIOD_S), round(_LAG_S / PERIOD_S)
    index = np.arange(count)
    newest, oldest = np.maximum(index - lag, 0), np.maximum(index - lag - stride, 0)
    velocity = (walk_m[newest] - walk_m[oldest]) / _STRIDE_S
    moving = np.hypot(velocity[:, 0], velocity[:, 1]) >= _STANDING_M_S
    noise = gauss_markov(count, PERIOD_S, _VELOCITY_SIGMA_M_S, _VELOCITY_CORRELATION_S, rng, columns=2)
    return np.where(moving[:, None], velocity + noise, 0.0)
