"""METHODS B3: the trunk swings with every stride; what is left without it is where the person goes.

Either the mean over a left and a right step, or the approximation of a sym8 wavelet at level 5: at 50 cells a
second that keeps what is slower than 0.8 Hz.
"""

from typing import Any

import numpy as np

from bootprint.messages import Float64Array

WAVELET, LEVEL = "sym8", 5
SPAN = 512  # cells, 10 s: more than the filter's reach at this level


def approximation(values: Float64Array, wavelet: str = WAVELET, level: int = LEVEL) -> Float64Array:
    """(n,) values without the details of the first ``level`` levels.

    The ends are continued by their own slope, so that a turn that is going on is not bent back.
    """
    import pywt  # loaded only by who selects it

    coefficients: list[Any] = pywt.wavedec(values, wavelet, mode="smooth", level=level)
    rough = [coefficients[0], *(np.zeros_like(detail) for detail in coefficients[1:])]
    return np.asarray(pywt.waverec(rough, wavelet, mode="smooth"))[: len(values)]
