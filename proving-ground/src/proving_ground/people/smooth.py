"""Curves through knots whose rate and acceleration are continuous, and small smooth bricks for motion."""

import numpy as np
import numpy.typing as npt

from proving_ground.people.legs import FloatArray


def glide(share: FloatArray) -> FloatArray:
    """0 to 1 with zero rate and acceleration at both ends (minimum jerk, Flash and Hogan 1985)."""
    u = np.clip(share, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


def cruise(share: FloatArray, ramp: FloatArray) -> FloatArray:
    """0 to 1 as a lift goes: even speed between ramps that take this share (≤ 0.5) at both ends.

    A ramp's speed is a smooth step, 3w² − 2w³: the quintic that `SmoothCurve` puts between rest and even speed.
    """
    u = np.clip(share, 0.0, 1.0)
    from_end = np.minimum(u, 1.0 - u)
    w = np.minimum(from_end / ramp, 1.0)
    way = (ramp * (w**3 - 0.5 * w**4) + np.maximum(from_end - ramp, 0.0)) / (1.0 - ramp)
    return np.where(u > 0.5, 1.0 - way, way)


def bump(time_s: FloatArray, width_s: FloatArray) -> FloatArray:
    """An odd bump of slope 1 at zero that has died away within six widths, s."""
    return np.asarray(time_s * np.exp(-0.5 * (time_s / width_s) ** 2))


def ring(since_s: FloatArray, frequency_hz: FloatArray | float, onset_s: float, decay_s: float) -> FloatArray:
    """Displacement (m) of a ring that shakes with 1 m/s², times since its soft onset ≥ 0."""
    begun = (since_s / onset_s) ** 3
    turn = 2.0 * np.pi * frequency_hz
    return np.asarray(begun / (1.0 + begun) * np.exp(-since_s / decay_s) * np.sin(turn * since_s) / turn**2)


class SmoothCurve:
    """Quintic Hermite pieces through knots: ``values`` and ``rates`` (k, m) at ``time_s`` (k,), no acceleration.

    Constant beyond both ends.
    """

    def __init__(self, time_s: FloatArray, values: FloatArray, rates: FloatArray) -> None:
        self._time_s = time_s
        step = np.diff(time_s)[:, None]
        rise = values[1:] - values[:-1]
        leave, arrive = rates[:-1] * step, rates[1:] * step
        self._terms = (
            values[:-1],
            leave,
            10.0 * rise - 6.0 * leave - 4.0 * arrive,
            -15.0 * rise + 8.0 * leave + 7.0 * arrive,
            6.0 * rise - 3.0 * leave - 3.0 * arrive,
        )

    def __call__(self, time_s: FloatArray) -> FloatArray:
        """Values (n, m) at these times (n,)."""
        index, share = _place(self._time_s, time_s)
        u = share[:, None]
        value, leave, third, fourth, fifth = (np.take(term, index, axis=0) for term in self._terms)
        return np.asarray(value + u * leave + u**3 * (third + u * (fourth + u * fifth)))


def _place(knots_s: FloatArray, time_s: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    index = np.clip(np.searchsorted(knots_s, time_s, side="right") - 1, 0, len(knots_s) - 2)
    share = (time_s - knots_s[index]) / (knots_s[index + 1] - knots_s[index])
    return index, np.clip(share, 0.0, 1.0)


class Tremble:
    """A wandering of m coordinates with these sigmas (m,): sinusoids within a band, random in phase.

    Amplitudes fall with frequency to the power of ``fall``: 1 as sway does, 2 for even accelerations.
    """

    _TONES = 4

    def __init__(
        self,
        sigmas: FloatArray,
        rng: np.random.Generator,
        band_hz: tuple[float, float] = (0.1, 1.2),
        fall: float = 1.0,
    ) -> None:
        frequency_hz = np.geomspace(*band_hz, self._TONES) * rng.uniform(0.8, 1.2, self._TONES)
        self._turn = 2.0 * np.pi * frequency_hz
        weight = rng.normal(size=(2, self._TONES, len(sigmas))) / frequency_hz[:, None] ** fall
        self._sine, self._cosine = weight * (np.sqrt(2.0) * sigmas / np.linalg.norm(weight, axis=(0, 1)))

    def __call__(self, time_s: FloatArray) -> FloatArray:
        """Deviations (n, m) at these times (n,)."""
        angle = time_s[:, None] * self._turn
        # Not "@": threads of a linear-algebra library are no help on matrices this narrow.
        sine, cosine = np.einsum("nt,tm->nm", np.sin(angle), self._sine), np.cos(angle)
        return np.asarray(sine + np.einsum("nt,tm->nm", cosine, self._cosine))
