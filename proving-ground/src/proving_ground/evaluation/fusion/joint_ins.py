"""The papers' way of two feet (METHODS D4): both inertial navigators in one filter of 18 error states.

Sample by sample, per foot the textbook's nine states (`evaluation.foot.textbook`), zero velocity in stance, and
once a second the pseudo-measurement "same 3-D position" with σ = 1 m. The papers mount both units alike; recorded
ones sit as they like, so the right foot's yaw against the left's is fitted first, to what both walk alone in the
beginning.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from proving_ground.evaluation.alignment import FloatArray, Track, fit_rigid, path_lengths
from proving_ground.evaluation.foot.textbook import (
    GRAVITY_M_S2,
    TextbookSettings,
    levelled,
    shoe_stances,
    skew,
    textbook_track,
    turned,
)
from sensor_gateway.recordings.run import ImuSeries

METHOD = "joint-18"
SAME_POSITION_M = 1.0
_EVERY_S = 1.0
_FITTED_M = 8.0
_ERRORS = 9
_Sample = tuple[float, int, int]  # time s, foot, index


def joint_tracks(imus: Mapping[str, ImuSeries], settings: TextbookSettings | None = None) -> dict[str, Track]:
    """Tracks of two feet, m, z up, in the left foot's frame; both rest at first."""
    settings = settings or TextbookSettings()
    series = [_without_bias(imu, settings) for imu in imus.values()]
    yaw = relative_yaw(series, settings)
    joint = JointFilter(
        [_attitude(imu, turn, settings) for imu, turn in zip(series, (0.0, yaw), strict=True)], settings
    )
    still = [shoe_stances(imu.accel_m_s2, imu.gyro_rad_s, settings) for imu in series]
    found = [np.zeros((len(imu.time_s), 3)) for imu in series]
    due_s = -math.inf
    for time_s, foot, k in _in_time(series):
        imu = series[foot]
        joint.predict(foot, imu.accel_m_s2[k], imu.gyro_rad_s[k], time_s - float(imu.time_s[k - 1]))
        if still[foot][k]:
            joint.zero_velocity(foot)
        if time_s >= due_s:
            joint.same_position()
            due_s = time_s + _EVERY_S
        found[foot][k] = joint.position[foot]
    return {place: Track(imu.time_s, track) for place, imu, track in zip(imus, series, found, strict=True)}


def relative_yaw(series: list[ImuSeries], settings: TextbookSettings) -> float:
    """By how much the right foot's own track must be turned to lie on the left's, over its first metres, rad."""
    left, right = (
        Track(imu.time_s, textbook_track(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s, settings))
        for imu in series
    )
    walked = path_lengths(left.position_m[:, :2]) <= _FITTED_M
    time_s = left.time_s[walked]
    return fit_rigid(right.at(time_s)[:, :2], left.at(time_s)[:, :2]).yaw_rad


def _without_bias(imu: ImuSeries, settings: TextbookSettings) -> ImuSeries:
    rest = imu.gyro_rad_s[: settings.align_samples].mean(axis=0)
    return ImuSeries(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s - rest)


def _attitude(imu: ImuSeries, yaw: float, settings: TextbookSettings) -> FloatArray:
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ levelled(imu.accel_m_s2[: settings.align_samples].mean(axis=0)))


def _in_time(series: list[ImuSeries]) -> Iterator[_Sample]:
    """All samples but each foot's first, by time."""
    samples = [
        (float(time_s), foot, k)
        for foot, imu in enumerate(series)
        for k, time_s in enumerate(imu.time_s)
        if k > 0
    ]
    return iter(sorted(samples))


class JointFilter:
    """Nominal states of two feet, and the covariance (18, 18) of (δp, δv, δθ) of the one and of the other."""

    def __init__(self, attitudes: list[FloatArray], settings: TextbookSettings) -> None:
        self.position = [np.zeros(3), np.zeros(3)]
        self.velocity = [np.zeros(3), np.zeros(3)]
        self.attitude = list(attitudes)
        sigmas = [settings.start_sigma] * 6 + [settings.start_tilt_rad] * 3
        self.P = np.diag(np.square(sigmas * 2))
        self._q = np.repeat(np.square([settings.accel_m_s2, settings.gyro_rad_s]), 3)
        self._still_m2_s2 = settings.velocity_m_s**2

    def predict(self, foot: int, accel: FloatArray, gyro: FloatArray, dt: float) -> None:
        """One foot's mechanisation; what it has in common with the other goes along."""
        attitude = self.attitude[foot] = turned(self.attitude[foot], gyro * dt)
        force = attitude @ accel
        motion = force - (0.0, 0.0, GRAVITY_M_S2)
        self.position[foot] = self.position[foot] + self.velocity[foot] * dt + 0.5 * motion * dt**2
        self.velocity[foot] = self.velocity[foot] + motion * dt
        block = _block(foot)
        transition = np.eye(_ERRORS)
        transition[0:3, 3:6] = dt * np.eye(3)
        transition[3:6, 6:9] = -dt * skew(force)
        self.P[block] = transition @ self.P[block]
        self.P[:, block] = self.P[:, block] @ transition.T
        noise = np.zeros(_ERRORS)
        noise[3:] = self._q * dt**2  # white on all axes alike: no turn into the navigation frame needed
        self.P[block, block] += np.diag(noise)

    def zero_velocity(self, foot: int) -> None:
        """The foot stands."""
        jacobian = np.zeros((3, 2 * _ERRORS))
        jacobian[:, _ERRORS * foot + 3 : _ERRORS * foot + 6] = np.eye(3)
        self._update(jacobian, -self.velocity[foot], self._still_m2_s2)

    def same_position(self) -> None:
        """Both feet are where the body is."""
        jacobian = np.zeros((3, 2 * _ERRORS))
        jacobian[:, 0:3], jacobian[:, _ERRORS : _ERRORS + 3] = np.eye(3), -np.eye(3)
        self._update(jacobian, self.position[1] - self.position[0], SAME_POSITION_M**2)

    def _update(self, jacobian: FloatArray, residual: FloatArray, variance: float) -> None:
        shared = self.P @ jacobian.T
        gain = shared @ np.linalg.inv(jacobian @ shared + variance * np.eye(3))
        error = gain @ residual
        for foot in (0, 1):
            part = error[_block(foot)]
            self.position[foot] = self.position[foot] + part[0:3]
            self.velocity[foot] = self.velocity[foot] + part[3:6]
            self.attitude[foot] = turned(self.attitude[foot], self.attitude[foot].T @ part[6:9])
        self.P = self.P - gain @ shared.T
        self.P = 0.5 * (self.P + self.P.T)


def _block(foot: int) -> slice:
    return slice(_ERRORS * foot, _ERRORS * (foot + 1))
