"""How a foot goes from one mid-stance to the next: spline curves over the stride's phase, and how they vary.

Six channels, of the sole's still point (under the ball of the foot) and of the foot's attitude, for a right foot:
``along`` the way from footfall to footfall (0 to 1), ``across`` it (m, left), ``height`` above the straight line
between both (m), ``pitch`` (rad, toe down), ``roll`` and ``yaw`` (rad) against what both footfalls have in common.
Cubic B-splines on even knots, value, rate and acceleration zero (or one, for ``along``) at both ends.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
CHANNELS = ("along", "across", "height", "pitch", "roll", "yaw")
ALONG, ACROSS, HEIGHT, PITCH, ROLL, YAW = range(6)
PIECES = 44
COEFFICIENTS = PIECES + 3
CREEP_SHARE = 0.12  # of a stride: width of the bump by which a foot creeps at mid-stance
HELD = 3  # coefficients at each end that hold value, rate and acceleration
FREE = COEFFICIENTS - 2 * HELD
MIRRORED = np.array([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])  # a left foot is a right foot in the mirror


@dataclass(frozen=True, slots=True)
class StrideShape:
    """A kind of stride.

    ``mean`` (6, FREE) at ``speed_m_s``, ``by_speed`` (6, FREE) per m/s, ``modes`` (m, 6, FREE): how strides differ
    from one another, one sigma each. ``lift_share``, ``land_share``: phases at which the foot leaves and meets the
    ground. ``creep`` and ``creep_sigma`` (6,): velocity (m/s, forward, left, up) and rate (rad/s, roll, pitch, yaw)
    of the still point at mid-stance, of a right foot.
    """

    speed_m_s: float
    slowest_m_s: float
    fastest_m_s: float
    rise_m: float
    length_m: float
    lift_share: float
    land_share: float
    mean: FloatArray
    by_speed: FloatArray
    modes: FloatArray
    creep: FloatArray
    creep_sigma: FloatArray

    def coefficients(self, speed_m_s: FloatArray, scores: FloatArray) -> FloatArray:
        """Free coefficients (n, 6, FREE) of strides of these speeds (n,) and scores (n, modes) in sigmas."""
        faster = np.clip(speed_m_s, self.slowest_m_s, self.fastest_m_s) - self.speed_m_s
        usual = self.mean + faster[:, None, None] * self.by_speed
        return np.asarray(usual + np.einsum("nm,mcf->ncf", scores, self.modes))


def whole(free: FloatArray) -> FloatArray:
    """All coefficients (n, 6, COEFFICIENTS) of strides with these free ones (n, 6, FREE)."""
    coefficients = np.zeros((*free.shape[:2], COEFFICIENTS))
    coefficients[:, :, HELD:-HELD] = free
    coefficients[:, ALONG, -HELD:] = 1.0
    return coefficients


def backwards(coefficients: FloatArray) -> FloatArray:
    """The same strides run back in time: what walking backward is (Winter et al. 1989).

    The way is turned round too, so what lay left of it lies right.
    """
    reverse = coefficients[:, :, ::-1].copy()
    reverse[:, ALONG] = 1.0 - reverse[:, ALONG]
    reverse[:, ACROSS] *= -1.0
    return reverse


def basis(phase: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """First of the four coefficients that count at each phase (n,) in [0, 1], and their weights (n, 4)."""
    place = np.clip(phase, 0.0, 1.0) * PIECES
    first = np.minimum(place.astype(np.int64), PIECES - 1)
    u = place - first
    weights = np.column_stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3])
    return first, weights / 6.0


def evaluated(coefficients: FloatArray, stride: npt.NDArray[np.int64], phase: FloatArray) -> FloatArray:
    """Channels (n, 6) of the strides with these indices (n,) at these phases (n,)."""
    first, weights = basis(phase)
    values = np.zeros((len(phase), coefficients.shape[1]))
    for offset in range(4):
        values += coefficients[stride, :, first + offset] * weights[:, offset, None]
    return values
