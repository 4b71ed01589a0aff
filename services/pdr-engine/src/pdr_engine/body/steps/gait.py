"""What one step looks like: its frequency, how the trunk rises and falls, and which way it pushes ahead.

All is taken over the last two steps (a left and a right one), at the step frequency: the first Fourier component of
the accelerations over a whole number of periods. So neither heel strikes nor the trunk's sway at half that
frequency count, and no filter has to settle.
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import Float64Array


@dataclass(frozen=True, slots=True)
class Gait:
    """One step's figures.

    ``rise_m``: the trunk's lowest to highest, of the fundamental. ``range_m_s2``: largest less smallest vertical
    acceleration in the step itself. ``variance_m2_s4``: of the vertical acceleration. ``push`` (2,): along and
    across the reference axis, m²/s⁴; it points ahead. ``surge_share``: the horizontal acceleration's RMS in its
    strongest direction over the vertical one's.
    """

    interval_s: float
    rise_m: float
    range_m_s2: float
    variance_m2_s4: float
    push: tuple[float, float]
    surge_share: float

    @property
    def sharpness(self) -> float:
        """The vertical acceleration's range over that of its fundamental: 1 without heel strikes."""
        fundamental = 0.5 * self.rise_m * (2.0 * math.pi / self.interval_s) ** 2
        return self.range_m_s2 / (2.0 * fundamental) if fundamental > 0.0 else 1.0

    @property
    def frequency_hz(self) -> float:
        """Steps a second."""
        return 1.0 / self.interval_s


def gait_of(time_s: Float64Array, accel_m_s2: Float64Array, interval_s: float, own: slice) -> Gait:
    """The gait in ``accel_m_s2`` (n, 3), level, z up, at ``time_s`` (n,): one step or two, each of ``interval_s``.

    ``own`` is the part that belongs to the last of them. A trunk that moves as cos ωt at height h/2 accelerates
    by ω²h/2: the rise is twice the fundamental's amplitude over ω². Walking ahead, the surge's acceleration leads
    the vertical one by a quarter of a step (inverted pendulum), so the component of the horizontal acceleration in
    phase with the vertical one's derivative, i ω A_z, points ahead.
    """
    omega = 2.0 * math.pi / interval_s
    centred = accel_m_s2 - accel_m_s2.mean(axis=0)
    fundamental = 2.0 / len(time_s) * (np.exp(-1j * omega * (time_s - time_s[0])) @ centred)
    push = np.real(fundamental[:2] * np.conj(1j * fundamental[2]))
    vertical = accel_m_s2[own, 2]
    return Gait(
        interval_s=interval_s,
        rise_m=2.0 * abs(fundamental[2]) / omega**2,
        range_m_s2=float(np.ptp(vertical)),
        variance_m2_s4=float(np.var(vertical)),
        push=(float(push[0]), float(push[1])),
        surge_share=_surge_share(centred),
    )


def _surge_share(centred_m_s2: Float64Array) -> float:
    """The strongest horizontal direction's RMS over the vertical one's, of accelerations (n, 3) without mean."""
    x, y, z = centred_m_s2.T
    xx, yy, xy, zz = float(x @ x), float(y @ y), float(x @ y), float(z @ z)
    strongest = 0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy))
    return math.sqrt(strongest / zz) if zz > 0.0 else 0.0
