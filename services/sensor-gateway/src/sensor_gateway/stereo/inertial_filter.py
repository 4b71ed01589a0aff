"""The camera's co-located inertial unit in an EKF of 15 error states: position, velocity, attitude, two biases.

Error states are in level axes (x, y any, z up), the attitude's error on the left: ``R_true = exp(δθ) R``. With f
the specific force less its bias,

    δp' = δv,    δv' = −[R f]× δθ − R δb_a,    δθ' = −R δb_g.

The filter lives from key frame to key frame: there its position and yaw begin at zero error, for of both only what
changes since is told; tilt, velocity and biases go on (METHODS D5).
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sensor_gateway.stereo.calibration import FloatArray

P, V, THETA, BIAS_A, BIAS_G = (slice(start, start + 3) for start in range(0, 15, 3))
SIZE = 15
_GRAVITY = np.array([0.0, 0.0, -9.80665])
_LONGEST_S = 0.1  # between samples: a longer gap is bridged as if nothing changed


@dataclass(frozen=True, slots=True)
class UnitQuality:
    """Noise densities, wander of biases, and what is not known at the start (1 σ), of a small MEMS unit."""

    accel_noise: float = (
        0.02  # m/s²/√Hz: the unit's own, and what its distance from the camera makes of rotation
    )
    gyro_noise: float = 0.001  # rad/s/√Hz
    accel_wander: float = 0.002  # m/s²/√s
    gyro_wander: float = 1e-4  # rad/s/√s
    tilt_rad: float = 0.1
    velocity_m_s: float = 1.0
    accel_bias: float = 0.1
    gyro_bias: float = 0.01


class InertialFilter:
    """Position m and velocity m/s in level axes from the key frame, attitude (body to level), biases."""

    def __init__(self, force: FloatArray, quality: UnitQuality) -> None:
        self._quality = quality
        self.position: FloatArray = np.zeros(3)
        self.velocity: FloatArray = np.zeros(3)
        self.attitude = _levelled(force)
        self.bias_a: FloatArray = np.zeros(3)
        self.bias_g: FloatArray = np.zeros(3)
        first = [0.0] * 3 + [quality.velocity_m_s] * 3 + [quality.tilt_rad] * 2 + [0.0]
        first += [quality.accel_bias] * 3 + [quality.gyro_bias] * 3
        self.covariance: FloatArray = np.diag(np.square(first))

    @property
    def up(self) -> FloatArray:
        """Up in the body's axes, (3,)."""
        return np.asarray(self.attitude.inv().apply([0.0, 0.0, 1.0]))

    def predict(self, seconds: float, force: FloatArray, rate: FloatArray) -> None:
        """Go on with specific force m/s² and rate rad/s, in body axes, for so long."""
        step_s = min(max(seconds, 0.0), _LONGEST_S)
        turned = self.attitude.apply(force - self.bias_a)
        self._spread(step_s, turned)
        accel = turned + _GRAVITY
        self.position = self.position + step_s * self.velocity + 0.5 * step_s**2 * accel
        self.velocity = self.velocity + step_s * accel
        self.attitude = self.attitude * Rotation.from_rotvec(step_s * (rate - self.bias_g))

    def _spread(self, step_s: float, turned: FloatArray) -> None:
        matrix = self.attitude.as_matrix()
        transition = np.eye(SIZE)
        transition[P, V] = step_s * np.eye(3)
        transition[V, THETA] = -step_s * cross(turned)
        transition[V, BIAS_A] = transition[THETA, BIAS_G] = -step_s * matrix
        quality = self._quality
        densities = (0.0, quality.accel_noise, quality.gyro_noise, quality.accel_wander, quality.gyro_wander)
        noise = np.repeat(np.square(densities) * step_s, 3)
        self.covariance = transition @ self.covariance @ transition.T + np.diag(noise)

    def begin_key(self) -> None:
        """The camera's key frame is here and now."""
        self.position = np.zeros(3)
        for index in (*range(3), THETA.start + 2):
            self.covariance[index, :] = 0.0
            self.covariance[:, index] = 0.0

    def surprise(self, residual: FloatArray, noise: FloatArray) -> float:
        """Squared innovation (6,) of position and attitude, in units of its covariance."""
        return float(residual @ np.linalg.solve(self._innovation(noise), residual))

    def _innovation(self, noise: FloatArray) -> FloatArray:
        return self.covariance[np.ix_(_POSE, _POSE)] + noise

    def correct(self, residual: FloatArray, noise: FloatArray) -> None:
        """Update by a residual (6,) of position and attitude; Joseph's form."""
        jacobian = np.eye(SIZE)[_POSE]
        gain = np.linalg.solve(self._innovation(noise), jacobian @ self.covariance).T
        kept = np.eye(SIZE) - gain @ jacobian
        self.covariance = kept @ self.covariance @ kept.T + gain @ noise @ gain.T
        error = gain @ residual
        self.position, self.velocity = self.position + error[P], self.velocity + error[V]
        self.attitude = Rotation.from_rotvec(error[THETA]) * self.attitude
        self.bias_a, self.bias_g = self.bias_a + error[BIAS_A], self.bias_g + error[BIAS_G]


_POSE = [*range(P.start, P.stop), *range(THETA.start, THETA.stop)]


def cross(vector: FloatArray) -> FloatArray:
    """``v ×`` as a matrix (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _levelled(force: FloatArray) -> Rotation:
    """The attitude without yaw in which a mean specific force points up."""
    up = force / max(float(np.linalg.norm(force)), 1e-6)
    pitch = np.arctan2(-up[0], np.hypot(up[1], up[2]))
    roll = np.arctan2(up[1], up[2])
    return Rotation.from_euler("ZYX", [0.0, pitch, roll])
