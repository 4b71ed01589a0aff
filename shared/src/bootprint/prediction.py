"""Where a soldier is believed to be some time after the last report: the one rule that senders and receivers share.

A hub sends when this prediction has become wrong, so whoever shows, scores or sends a track must predict alike.
People stop and turn, so a velocity is believed less the older it is: the prediction is damped, and comes to rest
``v · DAMPING_S`` ahead of the report.
"""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

DAMPING_S: Final = 60.0
"""Time constant τ after which a reported velocity has lost 63 % of its say."""


def moved_m(east_m_s: float, north_m_s: float, elapsed_s: float) -> tuple[float, float]:
    """East and north, m, believed to be gone since a report with this velocity: v τ (1 − e^(−t/τ)).

    ``elapsed_s`` may be negative (a picture asked for before the report's stamp): then linear, since e^(−t/τ) would
    run away.
    """
    reach_s = elapsed_s if elapsed_s <= 0.0 else -DAMPING_S * math.expm1(-elapsed_s / DAMPING_S)
    return east_m_s * reach_s, north_m_s * reach_s


def reaches_s(elapsed_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The same rule for many: seconds by which each velocity is to be multiplied, of the shape of ``elapsed_s``."""
    return np.where(
        elapsed_s <= 0.0, elapsed_s, -DAMPING_S * np.expm1(-np.maximum(elapsed_s, 0.0) / DAMPING_S)
    )
