"""The personal navigation system with GPS, by an error-state Kalman filter (METHODS C4).

Error states: position (2), velocity (2), azimuth and step length; the speed is ``s = f·l``. Measured is
``P_PNS − P_GPS``, only while GPS is reliable. Position errors grow by the errors of azimuth and step length,
``δP' = δv``, ``δv = δl·f·u(α) + s·δα·∂u/∂α`` with u the unit vector of the azimuth, and a velocity of their own
(a first-order process) for what neither explains. Errors are taken out of the track after every measurement.
"""

import math
from dataclasses import dataclass

import numpy as np

from pdr_engine.body.pieces import FloatArray

_PLACE, _VELOCITY, _AZIMUTH, _LENGTH = slice(0, 2), slice(2, 4), 4, 5
_SIZE = 6


@dataclass(frozen=True, slots=True)
class PnsGpsSettings:
    """One sigma each. At the start: ``azimuth_rad``, ``length_share`` of the step length. As one goes: white noise
    of a step's place ``step_m``, of the azimuth rad/√s, of the length's share /√s, and of a velocity that fades in
    ``velocity_s``.

    A fix counts as reliable from ``least_satellites`` on, up to ``most_accuracy_m``, and within ``gate_sigmas`` of
    where the track is; ``most_refused`` refusals in a row are not believed. Successive fixes err alike: each
    counts as ``alike`` fixes were one.
    """

    azimuth_rad: float = math.radians(10.0)
    length_share: float = 0.1
    velocity_m_s: float = 0.05
    velocity_s: float = 30.0
    step_m: float = 0.05
    azimuth_rad_sqrt_s: float = math.radians(0.02)
    length_share_sqrt_s: float = 0.0005
    least_satellites: int = 5
    most_accuracy_m: float = 15.0
    gate_sigmas: float = 4.0
    most_refused: int = 20
    alike: float = 5.0


class PnsGps:
    """Track of steps corrected by reliable fixes, east, north from the first place (2,), m."""

    def __init__(self, place_m: FloatArray, sigma_m: float, settings: PnsGpsSettings | None = None) -> None:
        from filterpy.kalman import KalmanFilter  # tens of megabytes: loaded only by who filters

        self.settings = settings or PnsGpsSettings()
        self.place_m = place_m.astype(np.float64)
        self.azimuth_error_rad = 0.0  # what is added to azimuths
        self.length_factor = 1.0  # by what lengths are multiplied
        self.taken = self.refused = 0
        self._refused_in_row = 0
        self._velocity_m_s = np.zeros(2)
        self._filter = KalmanFilter(dim_x=_SIZE, dim_z=2)
        self._filter.x = np.zeros(_SIZE)
        s = self.settings
        sigmas = [sigma_m, sigma_m, s.velocity_m_s, s.velocity_m_s, s.azimuth_rad, s.length_share]
        self._filter.P = np.diag(np.square(sigmas))

    @property
    def covariance_m2(self) -> FloatArray:
        """Of the place, (2, 2)."""
        return np.asarray(self._filter.P[_PLACE, _PLACE])

    def step(self, length_m: float, azimuth_rad: float, duration_s: float) -> FloatArray:
        """A step on; the place (2,) then."""
        azimuth = azimuth_rad + self.azimuth_error_rad
        length = self.length_factor * length_m
        along = np.array([math.sin(azimuth), math.cos(azimuth)])
        self.place_m = self.place_m + length * along + self._velocity_m_s * duration_s
        self._velocity_m_s *= math.exp(-duration_s / self.settings.velocity_s)
        self._filter.predict(F=self._transition(length, along, duration_s), Q=self._noise(duration_s))
        return self.place_m

    def fix(self, place_m: FloatArray, accuracy_m: float, satellites: int | None) -> bool:
        """A fix, where it was measured now; whether it was reliable and taken."""
        s = self.settings
        if accuracy_m > s.most_accuracy_m or (satellites is not None and satellites < s.least_satellites):
            return False
        noise = s.alike * max(accuracy_m, 0.5) ** 2 * np.eye(2) / 2.0
        residual = place_m - self.place_m
        total = self.covariance_m2 + noise
        off = math.sqrt(float(residual @ np.linalg.solve(total, residual)))
        if off > s.gate_sigmas:
            self.refused += 1
            self._refused_in_row += 1
            if self._refused_in_row < s.most_refused:
                return False
            self._filter.P[_PLACE, _PLACE] += float(residual @ residual) * np.eye(2)
        self._refused_in_row = 0
        self.taken += 1
        self._filter.update(residual, R=noise, H=np.eye(2, _SIZE))
        self._correct()
        return True

    def _transition(self, length_m: float, along: FloatArray, duration_s: float) -> FloatArray:
        """δP grows by the errors of velocity, azimuth (clockwise) and length, over a step."""
        transition = np.eye(_SIZE)
        transition[_PLACE, _VELOCITY] = duration_s * np.eye(2)
        transition[_PLACE, _AZIMUTH] = length_m * np.array([along[1], -along[0]])
        transition[_PLACE, _LENGTH] = length_m * along
        transition[_VELOCITY, _VELOCITY] = math.exp(-duration_s / self.settings.velocity_s) * np.eye(2)
        return transition

    def _noise(self, duration_s: float) -> FloatArray:
        s = self.settings
        driving = s.velocity_m_s**2 * (1.0 - math.exp(-2.0 * duration_s / s.velocity_s))
        return np.diag(
            [
                s.step_m**2,
                s.step_m**2,
                driving,
                driving,
                s.azimuth_rad_sqrt_s**2 * duration_s,
                s.length_share_sqrt_s**2 * duration_s,
            ]
        )

    def _correct(self) -> None:
        """Take the errors out of the track and begin again with none."""
        error = self._filter.x
        self.place_m = self.place_m + error[_PLACE]
        self._velocity_m_s = self._velocity_m_s + error[_VELOCITY]
        self.azimuth_error_rad = math.remainder(self.azimuth_error_rad + float(error[_AZIMUTH]), math.tau)
        self.length_factor *= 1.0 + float(error[_LENGTH])
        self._filter.x = np.zeros(_SIZE)
