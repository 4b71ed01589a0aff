"""What a trunk gains and loses of speed from step to step, and which change of direction that fits.

Whoever walks on keeps the speed: over whole steps the accelerations cancel out. Whoever turns from a walk ahead to
a step aside loses a walk's speed ahead and gains a little aside; to go backward takes more than to stop. So speeds
and their differences tell a change at its first step, before the surges of two steps have shown it.
"""

from collections import deque

import numpy as np

from pdr_engine.body.pieces import FloatArray, Stride

# Of people who go forward, backward, left and right, unhurried; ahead and to the left (4, 2).
SPEEDS_M_S = np.array([[1.25, 0.0], [-0.8, 0.0], [0.0, 0.4], [0.0, -0.4]])
_STEPS = 3  # in which a change of direction is done
_SIGMA_M_S = 0.3  # of the change over so many: sway, speeds unlike the usual ones, tilt errors
_STOPS, _TURNS_THERE = 0.02, 0.5  # a step that somebody stops or starts; that the direction changes there
_ANYTHING = 0.005  # the density, as a share of the most, of what nobody thought of
_FOLLOWED_STEPS = 30.0  # for which a lasting acceleration is taken for a tilt of the unit
_MOST_TILT_M_S2 = 0.3


class Impetus:
    """Speed gained over the last steps, and what it says of changes of direction."""

    def __init__(self) -> None:
        self._gained: deque[FloatArray] = deque(maxlen=_STEPS)
        self._tilt_m_s2: FloatArray = np.zeros(2)

    def restart(self) -> None:
        """A step is missing: nobody knows what was gained since."""
        self._gained.clear()

    def take(self, stride: Stride) -> None:
        """The next step."""
        duration_s = (stride.end_ns - stride.start_ns) * 1e-9
        mean_m_s2 = stride.level_accel_m_s2[:, :2].mean(axis=0)
        self._gained.append((mean_m_s2 - self._tilt_m_s2) * duration_s)
        off = np.clip(mean_m_s2, -_MOST_TILT_M_S2, _MOST_TILT_M_S2) - self._tilt_m_s2
        self._tilt_m_s2 = self._tilt_m_s2 + off / _FOLLOWED_STEPS

    def transition(self, walking: FloatArray, usual: FloatArray) -> FloatArray | None:
        """Likelihoods (4, 4) of what was gained for going from row to column, each times how likely that is.

        ``walking`` (4, 4): how likely that is while the speed is kept; ``usual`` (4,): how people go on after a
        stop. None until enough steps in a row are known.
        """
        if len(self._gained) < _STEPS:
            return None
        gained = np.sum(self._gained, axis=0)
        goes_on, stops, starts = _fit(gained), _fit(gained + SPEEDS_M_S), _fit(gained - SPEEDS_M_S)
        changes = _fit(gained - SPEEDS_M_S[None, :] + SPEEDS_M_S[:, None])
        there = (stops[:, None] + starts[None, :] + changes) / 3.0
        onward = (1.0 - _TURNS_THERE) * np.eye(len(usual)) + _TURNS_THERE * usual
        return np.asarray((1.0 - _STOPS) * goes_on * walking + _STOPS * onward * there)


def _fit(miss_m_s: FloatArray) -> FloatArray:
    """Likelihoods (…,) of misses (…, 2), as shares of the most."""
    square = np.sum(miss_m_s**2, axis=-1) / _SIGMA_M_S**2
    return np.asarray((1.0 - _ANYTHING) * np.exp(-0.5 * square) + _ANYTHING)
