"""The personal navigation system with GPS, by an error-state Kalman filter (METHODS C4).

Error states: position (2), velocity (2), azimuth and step length; the speed is ``s = f·l``. Measured is
``P_PNS − P_GPS``, only while GPS is reliable. Position errors grow by the errors of azimuth and step length,
``δP' = δv``, ``δv = δl·f·u(α) + s·δα·∂u/∂α`` with u the unit vector of the azimuth, and a velocity of their own
(a first-order process) for what neither explains. Errors are taken out of the track after every measurement.

Two pairs of states more than the source has. A fix errs much as the one a second before: its error is a first-order
process of its own, in units of what the receiver states, so that minutes of fixes never tell more of the heading
than their wander lets them. And iron on the person turns a compass by ``b·sin α + c·cos α`` (a ship's semicircular
deviation): streets to the north and to the east need not be off by the same angle.
"""

import math
from dataclasses import dataclass

import numpy as np

from pdr_engine.body.pieces import FloatArray

_PLACE, _VELOCITY, _AZIMUTH, _LENGTH = slice(0, 2), slice(2, 4), 4, 5
_WANDER, _DEVIATION = slice(6, 8), slice(8, 10)
_SIZE = 10
_LEAST_ACCURACY_M = 0.5


@dataclass(frozen=True, slots=True)
class PnsGpsSettings:
    """One sigma each. At the start: ``azimuth_rad``, ``deviation_rad`` (of a compass that was calibrated as worn:
    half a microtesla that was left, and a per cent of the vertical field, against some 20 µT across the ground),
    ``length_share`` of the step length. As one goes: white noise of a step's place ``step_m``, of the azimuth
    rad/√s, of the length's share /√s, and of a velocity that fades in ``velocity_s``.

    A fix errs by ``wander_share`` of its stated accuracy with a memory of ``wander_s``, and by ``white_share`` of
    it anew each time. It counts as reliable from ``least_satellites`` on, up to ``most_accuracy_m``, and within
    ``gate_sigmas`` of where the track is; ``most_refused`` refusals in a row are not believed.
    """

    azimuth_rad: float = math.radians(10.0)
    deviation_rad: float = math.radians(1.75)
    length_share: float = 0.1
    velocity_m_s: float = 0.05
    velocity_s: float = 30.0
    step_m: float = 0.05
    azimuth_rad_sqrt_s: float = math.radians(0.01)
    length_share_sqrt_s: float = 0.0003
    wander_share: float = 1.0
    wander_s: float = 60.0
    white_share: float = 0.2
    least_satellites: int = 5
    most_accuracy_m: float = 15.0
    gate_sigmas: float = 4.0
    most_refused: int = 20


class PnsGps:
    """Track of steps corrected by reliable fixes, east, north from the first place (2,), m."""

    def __init__(self, place_m: FloatArray, sigma_m: float, settings: PnsGpsSettings | None = None) -> None:
        from filterpy.kalman import KalmanFilter  # tens of megabytes: loaded only by who filters

        self.settings = settings or PnsGpsSettings()
        self.place_m = place_m.astype(np.float64)
        self.azimuth_error_rad = 0.0  # what is added to azimuths
        self.deviation_rad = np.zeros(2)  # and by sine and cosine of theirs
        self.length_factor = 1.0  # by what lengths are multiplied
        self.taken = self.refused = 0
        self._refused_in_row = 0
        self._velocity_m_s = np.zeros(2)
        self._wander = np.zeros(2)  # of the fixes, in what they state
        self._filter = KalmanFilter(dim_x=_SIZE, dim_z=2)
        self._filter.x = np.zeros(_SIZE)
        s = self.settings
        steps = [sigma_m, sigma_m, s.velocity_m_s, s.velocity_m_s, s.azimuth_rad, s.length_share]
        self._filter.P = np.diag(np.square([*steps, 1.0, 1.0, s.deviation_rad, s.deviation_rad]))

    @property
    def covariance_m2(self) -> FloatArray:
        """Of the place, (2, 2)."""
        return np.asarray(self._filter.P[_PLACE, _PLACE])

    def step(self, length_m: float, azimuth_rad: float, duration_s: float) -> FloatArray:
        """A step on; the place (2,) then."""
        lobes = np.array([math.sin(azimuth_rad), math.cos(azimuth_rad)])
        azimuth = azimuth_rad + self.azimuth_error_rad + float(lobes @ self.deviation_rad)
        length = self.length_factor * length_m
        along = np.array([math.sin(azimuth), math.cos(azimuth)])
        self.place_m = self.place_m + length * along + self._velocity_m_s * duration_s
        self._velocity_m_s *= math.exp(-duration_s / self.settings.velocity_s)
        self._wander *= math.exp(-duration_s / self.settings.wander_s)
        transition = self._transition(length, along, duration_s)
        transition[_PLACE, _DEVIATION] = np.outer(transition[_PLACE, _AZIMUTH], lobes)
        self._filter.predict(F=transition, Q=self._noise(duration_s))
        return self.place_m

    def fix(self, place_m: FloatArray, accuracy_m: float, satellites: int | None) -> bool:
        """A fix, where it was measured now; whether it was reliable and taken."""
        s = self.settings
        if accuracy_m > s.most_accuracy_m or (satellites is not None and satellites < s.least_satellites):
            return False
        sigma_m = max(accuracy_m, _LEAST_ACCURACY_M) / math.sqrt(2.0)  # of a component
        seen = np.eye(2, _SIZE)
        seen[:, _WANDER] = s.wander_share * sigma_m * np.eye(2)
        noise = (s.white_share * sigma_m) ** 2 * np.eye(2)
        residual = place_m - self.place_m - s.wander_share * sigma_m * self._wander
        total = seen @ self._filter.P @ seen.T + noise
        off = math.sqrt(float(residual @ np.linalg.solve(total, residual)))
        if off > s.gate_sigmas:
            self.refused += 1
            self._refused_in_row += 1
            if self._refused_in_row < s.most_refused:
                return False
            self._filter.P[_PLACE, _PLACE] += float(residual @ residual) * np.eye(2)
        self._refused_in_row = 0
        self.taken += 1
        self._filter.update(residual, R=noise, H=seen)
        self._correct()
        return True

    def _transition(self, length_m: float, along: FloatArray, duration_s: float) -> FloatArray:
        """δP grows by the errors of velocity, azimuth (clockwise) and length, over a step."""
        transition = np.eye(_SIZE)
        transition[_PLACE, _VELOCITY] = duration_s * np.eye(2)
        transition[_PLACE, _AZIMUTH] = length_m * np.array([along[1], -along[0]])
        transition[_PLACE, _LENGTH] = length_m * along
        transition[_VELOCITY, _VELOCITY] = math.exp(-duration_s / self.settings.velocity_s) * np.eye(2)
        transition[_WANDER, _WANDER] = math.exp(-duration_s / self.settings.wander_s) * np.eye(2)
        return transition

    def _noise(self, duration_s: float) -> FloatArray:
        s = self.settings
        noise = np.zeros(_SIZE)
        noise[_PLACE] = s.step_m**2
        noise[_VELOCITY] = s.velocity_m_s**2 * (1.0 - math.exp(-2.0 * duration_s / s.velocity_s))
        noise[_AZIMUTH] = s.azimuth_rad_sqrt_s**2 * duration_s
        noise[_LENGTH] = s.length_share_sqrt_s**2 * duration_s
        noise[_WANDER] = 1.0 - math.exp(-2.0 * duration_s / s.wander_s)
        return np.diag(noise)

    def _correct(self) -> None:
        """Take the errors out of the track and begin again with none."""
        error = self._filter.x
        self.place_m = self.place_m + error[_PLACE]
        self._velocity_m_s = self._velocity_m_s + error[_VELOCITY]
        self.azimuth_error_rad = math.remainder(self.azimuth_error_rad + float(error[_AZIMUTH]), math.tau)
        self.deviation_rad = self.deviation_rad + error[_DEVIATION]
        self.length_factor *= 1.0 + float(error[_LENGTH])
        self._wander = self._wander + error[_WANDER]
        self._filter.x = np.zeros(_SIZE)
