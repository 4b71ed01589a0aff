"""How a trunk is driven by one step: how often, how hard up and down, and towards where.

The trunk goes over the standing leg like an inverted pendulum: it speeds up while it sinks and slows down while it
rises (Cavagna and Margaria 1966; METHODS A3, B1: forward and vertical peaks in this order walking forward, in the
other walking backward, and lateral ones alike in side steps). So, of the horizontal acceleration, the part that
runs a quarter of a step *ahead* of the vertical one points where the body goes: the `surge`. Running is a bouncing
ball, where it points back. Only the step's own frequency is looked at, over one whole step: wherever the step
was cut out, and whatever the heel's shock does.
"""

from dataclasses import dataclass

import numpy as np

from pdr_engine.body.pieces import FloatArray, Stride

_LEAST_SAMPLES = 4
_LEAST_BOUNCE_M_S2 = 1e-6


@dataclass(frozen=True, slots=True)
class Surge:
    """One step's drive, in the level frame.

    ``bounce_m_s2``: amplitude of the vertical acceleration at the step's frequency ``frequency_hz``;
    ``ahead_m_s2``, ``left_m_s2``: the horizontal acceleration's amplitude that leads it by a quarter of a step;
    ``stir_m_s2``: RMS of the whole acceleration about its mean.
    """

    frequency_hz: float
    bounce_m_s2: float
    ahead_m_s2: float
    left_m_s2: float
    stir_m_s2: float


def surge_of(stride: Stride) -> Surge:
    """The drive of one step; all zero where there are too few samples to tell."""
    duration_s = (stride.end_ns - stride.start_ns) * 1e-9
    if len(stride.time_s) < _LEAST_SAMPLES or duration_s <= 0.0:
        return Surge(0.0, 0.0, 0.0, 0.0, 0.0)
    accel = stride.level_accel_m_s2 - stride.level_accel_m_s2.mean(axis=0)
    ahead, left, up = _fundamental(accel, stride.time_s / duration_s)
    bounce = abs(up)
    if bounce < _LEAST_BOUNCE_M_S2:
        return Surge(1.0 / duration_s, 0.0, 0.0, 0.0, _rms(accel))
    leading = np.array([ahead, left]) * np.conj(up) / bounce
    return Surge(1.0 / duration_s, float(bounce), float(leading[0].imag), float(leading[1].imag), _rms(accel))


def _fundamental(accel: FloatArray, phase: FloatArray) -> tuple[complex, complex, complex]:
    """Complex amplitudes of three axes (n, 3) at one turn a step; ``phase`` (n,) from 0 to 1."""
    wave = 2.0 * np.mean(accel * np.exp(-2j * np.pi * phase)[:, None], axis=0)
    return complex(wave[0]), complex(wave[1]), complex(wave[2])


def _rms(accel: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(accel**2, axis=1))))
