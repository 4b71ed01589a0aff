"""Azimuth by gyro across what disturbs the compass, and the gyro's bias from the compass where it is good (A7).

A bridge is told each step by the gyro (`advance`), good azimuths (`compass`) and breaks of the stream (`lose`).
Three ways to update the bias, after the PNM's chapters 4.4 and 4.5: taken whole (`PlainBridge`), by an exponential
filter (`ExponentialBridge`), by a Kalman filter (`KalmanBridge`, the default). All of them go step by step.
Azimuths and their changes are clockwise, a bias is what the measured rate has too much.
"""

import math
from dataclasses import dataclass

import numpy as np

from pdr_engine.body.azimuth.compass import UNKNOWN_RAD, Reading
from pdr_engine.body.azimuth.heading import Heading, wrapped
from pdr_engine.body.settings import HeadingSettings
from pdr_engine.body.steps.grid import CELL_S

LONGEST_S = 120.0  # for which the source trusts a bridge
QUICK_TURN_RAD_S = 0.5


@dataclass(frozen=True, slots=True)
class BridgeSettings:
    """What is known of gyro and compass, one sigma.

    ``gyro_noise_rad_s``: of one sample. ``bias_sigma_rad_s``: before anything is known. ``alpha``: weight of a new
    bias (exponential). ``decay``: by which the bias's deviation from its mean falls in a step, the source's a.
    ``drive_rad2_s2``: variance a step of what drives that deviation; the source's 0.05 (°)²/s is that of its
    directional gyro of 2002, a MEMS gyro's bias wanders by some hundredths of a degree a second.
    ``mean_drive_rad2_s2``: how much the bias's mean wanders, variance a second.
    """

    gyro_noise_rad_s: float = math.radians(0.15)
    bias_sigma_rad_s: float = math.radians(0.2)
    alpha: float = 0.1
    decay: float = 0.05
    drive_rad2_s2: float = math.radians(0.01) ** 2
    mean_drive_rad2_s2: float = math.radians(0.0002) ** 2


SOURCE_DRIVE_RAD2_S2 = 0.05 * math.radians(1.0) ** 2


class PlainBridge:
    """The bias that brings the gyro onto the compass is believed (eq. 4.4 to 4.11).

    ``Δb = (φ_gyro − φ_compass)/ΔT``, ``σ_b² = 2σ_c²/ΔT² + σ_ω²/n``; m samples later the azimuth's variance is
    ``σ_c² + m·Δt²·σ_ω² + m²·Δt²·σ_b²``.
    """

    _LEAST_INTERVAL_S = 30.0  # between two updates: bias errors go with its inverse

    def __init__(self, azimuth_rad: float, sigma_rad: float, settings: BridgeSettings | None = None) -> None:
        self.settings = settings or BridgeSettings()
        self.azimuth_rad, self.bias_rad_s, self.since_s = azimuth_rad, 0.0, 0.0
        self.bias_variance = self.settings.bias_sigma_rad_s**2
        self._start_variance = sigma_rad**2
        self._samples = 0

    @property
    def sigma_rad(self) -> float:
        """Of the azimuth, by the propagation above."""
        if not self._samples:
            return math.sqrt(self._start_variance)
        step_s = self.since_s / self._samples
        white = self._samples * step_s**2 * self.settings.gyro_noise_rad_s**2
        return math.sqrt(self._start_variance + white + self.since_s**2 * self.bias_variance)

    def advance(self, turn_rad: float, duration_s: float, samples: int) -> None:
        """A step on by the gyro."""
        self.azimuth_rad = wrapped(self.azimuth_rad + turn_rad - self.bias_rad_s * duration_s)
        self.since_s += duration_s
        self._samples += samples

    def compass(self, azimuth_rad: float, sigma_rad: float) -> None:
        """Update, unless the last was just before."""
        if self.since_s < self._LEAST_INTERVAL_S:
            return
        found = wrapped(self.azimuth_rad - azimuth_rad) / self.since_s
        white = self.settings.gyro_noise_rad_s**2 / max(self._samples, 1)
        variance = 2.0 * sigma_rad**2 / self.since_s**2 + white
        self._take(found, variance, azimuth_rad, sigma_rad)
        self.since_s, self._samples = 0.0, 0

    def lose(self, sigma_rad: float) -> None:
        """Of the azimuth; the interval for the bias begins anew."""
        self._start_variance = self.sigma_rad**2 + sigma_rad**2
        self.since_s, self._samples = 0.0, 0

    def unbias(self, rate_rad_s: float) -> None:
        """See `heading.Source`; the interval so far told of the bias before, so another begins."""
        self.bias_rad_s += rate_rad_s
        self.lose(0.0)

    def _take(self, found: float, variance: float, azimuth_rad: float, sigma_rad: float) -> None:
        self.bias_rad_s += found
        self.bias_variance = variance
        self.azimuth_rad, self._start_variance = wrapped(azimuth_rad), sigma_rad**2


class ExponentialBridge(PlainBridge):
    """A new bias counts by a share: ``b ← (1−α)·b + α·b_new``, ``σ_b² ← (1−α)²σ_b² + α²σ_bnew²`` (eq. 4.12 ff.)."""

    def _take(self, found: float, variance: float, azimuth_rad: float, sigma_rad: float) -> None:
        alpha = self.settings.alpha
        before = self.sigma_rad**2
        self.bias_rad_s += alpha * found
        self.bias_variance = (1.0 - alpha) ** 2 * self.bias_variance + alpha**2 * variance
        correction = alpha * wrapped(azimuth_rad - self.azimuth_rad)
        self.azimuth_rad = wrapped(self.azimuth_rad + correction)
        self._start_variance = (1.0 - alpha) ** 2 * before + alpha**2 * sigma_rad**2


class KalmanBridge:
    """Azimuth, and bias as a first-order Gauss–Markov process indexed by steps (eq. 4.5), by a Kalman filter.

    The source's process falls back to zero, that is to the bias found before the walk. Here it falls back to a
    mean that is a third, nearly constant state, so that minutes of good compass count for a bridge of minutes.
    """

    def __init__(self, azimuth_rad: float, sigma_rad: float, settings: BridgeSettings | None = None) -> None:
        from filterpy.kalman import KalmanFilter  # tens of megabytes: loaded only by who bridges

        self.settings = settings or BridgeSettings()
        self.since_s = 0.0
        self._filter = KalmanFilter(dim_x=3, dim_z=1)
        self._filter.x = np.array([azimuth_rad, 0.0, 0.0])
        steady = self.settings.drive_rad2_s2 / (2.0 * self.settings.decay)
        self._filter.P = np.diag([sigma_rad**2, steady, self.settings.bias_sigma_rad_s**2])

    @property
    def azimuth_rad(self) -> float:
        """Azimuth, −π to π."""
        return wrapped(float(self._filter.x[0]))

    @property
    def sigma_rad(self) -> float:
        """Of the azimuth."""
        return math.sqrt(float(self._filter.P[0, 0]))

    @property
    def bias_rad_s(self) -> float:
        """Mean and deviation together."""
        return float(self._filter.x[1] + self._filter.x[2])

    def advance(self, turn_rad: float, duration_s: float, samples: int) -> None:
        """A step on by the gyro."""
        keep = math.exp(-self.settings.decay)
        transition = np.array([[1.0, -duration_s, -duration_s], [0.0, keep, 0.0], [0.0, 0.0, 1.0]])
        white = self.settings.gyro_noise_rad_s**2 * duration_s**2 / max(samples, 1)
        noise = np.diag([white, self.settings.drive_rad2_s2, self.settings.mean_drive_rad2_s2 * duration_s])
        self._filter.predict(F=transition, Q=noise)
        self._filter.x[0] += turn_rad
        self.since_s += duration_s

    def compass(self, azimuth_rad: float, sigma_rad: float) -> None:
        """Update."""
        near = float(self._filter.x[0]) + wrapped(azimuth_rad - float(self._filter.x[0]))
        self._filter.update(np.array([near]), R=sigma_rad**2, H=np.array([[1.0, 0.0, 0.0]]))
        self.since_s = 0.0

    def lose(self, sigma_rad: float) -> None:
        """Of the azimuth."""
        self._filter.P[0, 0] += sigma_rad**2

    def unbias(self, rate_rad_s: float) -> None:
        """See `heading.Source`."""
        self._filter.x[2] += rate_rad_s


BRIDGES: dict[str, type[PlainBridge] | type[KalmanBridge]] = {
    "kalman": KalmanBridge,
    "exponential": ExponentialBridge,
    "plain": PlainBridge,
}


class Bridged:
    """A bridge as a source of azimuths (`heading.Source`): compass while it is clean, the gyro for the rest.

    Quick turns are the gyro's, too. Only the Kalman filter takes a doubtful azimuth for what it is worth.
    """

    def __init__(self, kind: str, settings: HeadingSettings) -> None:
        self._kind = BRIDGES[kind]
        self._settings = settings
        self._bridge: PlainBridge | KalmanBridge | None = None

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """See `heading.Source`."""
        if self._bridge is None:
            azimuth = reading.azimuth_rad if reading else 0.0
            self._bridge = self._kind(azimuth, self._settings.first_sigma_rad if reading else UNKNOWN_RAD)
        else:
            self._bridge.advance(-turn_rad, step_s, max(1, round(step_s / CELL_S)))
            if reading is not None and self._takes(reading, turn_rad, step_s):
                self._bridge.compass(reading.azimuth_rad, self._sigma_rad(reading))
        return Heading(self._bridge.azimuth_rad % math.tau, min(UNKNOWN_RAD, self._bridge.sigma_rad))

    def lose(self, sigma_rad: float) -> None:
        """See `heading.Source`."""
        if self._bridge is not None:
            self._bridge.lose(sigma_rad)

    def unbias(self, rate_rad_s: float) -> None:
        """See `heading.Source`."""
        if self._bridge is not None:
            self._bridge.unbias(rate_rad_s)

    def _sigma_rad(self, reading: Reading) -> float:
        """The Kalman filter averages steps, whose errors are alike; the others take single readings."""
        return math.sqrt(reading.alike_variance) if self._kind is KalmanBridge else reading.sigma_rad

    def _takes(self, reading: Reading, turn_rad: float, step_s: float) -> bool:
        if abs(turn_rad) > QUICK_TURN_RAD_S * step_s:
            return False
        return reading.trusted if self._kind is KalmanBridge else not reading.disturbed
