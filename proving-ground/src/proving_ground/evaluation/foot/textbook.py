"""The textbook's foot-mounted INS in plain NumPy: what the compiled filter's speed is measured against.

Nine error states (δp, δv, δθ), the SHOE detector of Skog et al. (2010) with a fixed threshold, and zero-velocity
updates, one sample after the other with a matrix for every matrix of the text, as OpenShoe's reference script has
them and with its settings. Nothing is made slow on purpose: small arrays, no needless copies, no Python arithmetic
where NumPy has an operation.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from proving_ground.evaluation.alignment import FloatArray

BoolArray = npt.NDArray[np.bool_]
GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class TextbookSettings:
    """OpenShoe's settings: detector window and weights, process and measurement noise as standard deviations."""

    window: int = 3  # samples
    detector_accel_m_s2: float = 0.01
    detector_gyro_rad_s: float = math.radians(0.1)
    threshold: float = 0.3e5
    accel_m_s2: float = 0.5
    gyro_rad_s: float = math.radians(0.5)
    velocity_m_s: float = 0.01
    start_sigma: float = 1e-5
    start_tilt_rad: float = math.radians(0.1)
    align_samples: int = 20


def skew(v: FloatArray) -> FloatArray:
    """[v]×, (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def shoe_stances(accel: FloatArray, gyro: FloatArray, settings: TextbookSettings) -> BoolArray:
    """Samples (n,) that lie in a window whose statistic T is below the threshold (Skog 2010, eq. 15).

    T = 1/W · Σ ‖a_k − g·ā/‖ā‖‖²/σ_a² + ‖ω_k‖²/σ_ω² over the window's W samples.
    """
    width = settings.window
    still = np.zeros(len(accel), dtype=bool)
    for k in range(len(accel) - width + 1):
        a, w = accel[k : k + width], gyro[k : k + width]
        mean = a.mean(axis=0)
        rest = a - GRAVITY_M_S2 * mean / np.linalg.norm(mean)
        statistic = (
            np.sum(rest**2) / settings.detector_accel_m_s2**2 + np.sum(w**2) / settings.detector_gyro_rad_s**2
        ) / width
        if statistic < settings.threshold:
            still[k : k + width] = True
    return still


def levelled(accel: FloatArray) -> FloatArray:
    """Attitude (3, 3), sensor to nav (z up), with yaw 0, from a mean specific force (3,) at rest."""
    roll = math.atan2(accel[1], accel[2])
    pitch = math.atan2(-accel[0], math.hypot(accel[1], accel[2]))
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def turned(attitude: FloatArray, angle: FloatArray) -> FloatArray:
    """The attitude after a turn by the rotation vector ``angle`` (3,) in sensor axes (Rodrigues)."""
    size = float(np.linalg.norm(angle))
    if size < 1e-12:
        return attitude
    axis = skew(angle / size)
    return np.asarray(attitude @ (np.eye(3) + math.sin(size) * axis + (1.0 - math.cos(size)) * axis @ axis))


class TextbookFilter:
    """Nominal state and covariance; one `predict` a sample, one `zero_velocity` a sample of stance."""

    def __init__(self, attitude: FloatArray, settings: TextbookSettings) -> None:
        self.position, self.velocity, self.attitude = np.zeros(3), np.zeros(3), attitude
        self.P = np.diag([settings.start_sigma**2] * 6 + [settings.start_tilt_rad**2] * 3)
        self.Q = np.diag([settings.accel_m_s2**2] * 3 + [settings.gyro_rad_s**2] * 3)
        self.R = np.eye(3) * settings.velocity_m_s**2
        self.H = np.hstack([np.zeros((3, 3)), np.eye(3), np.zeros((3, 3))])
        self.gravity = np.array([0.0, 0.0, GRAVITY_M_S2])

    def predict(self, accel: FloatArray, gyro: FloatArray, dt: float) -> None:
        """Mechanisation, and P ← F·P·Fᵀ + G·Q·Gᵀ."""
        self.attitude = turned(self.attitude, gyro * dt)
        force = self.attitude @ accel
        motion = force - self.gravity
        self.position = self.position + self.velocity * dt + 0.5 * motion * dt**2
        self.velocity = self.velocity + motion * dt
        F = np.eye(9)
        F[0:3, 3:6] = dt * np.eye(3)
        F[3:6, 6:9] = -dt * skew(force)
        G = np.zeros((9, 6))
        G[3:6, 0:3] = dt * self.attitude
        G[6:9, 3:6] = dt * self.attitude
        self.P = F @ self.P @ F.T + G @ self.Q @ G.T

    def zero_velocity(self) -> None:
        """The Kalman update with velocity 0, and the error moved into the nominal state."""
        H = self.H
        K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + self.R)
        error = K @ -self.velocity
        self.position = self.position + error[0:3]
        self.velocity = self.velocity + error[3:6]
        self.attitude = turned(self.attitude, self.attitude.T @ error[6:9])
        self.P = (np.eye(9) - K @ H) @ self.P
        self.P = 0.5 * (self.P + self.P.T)


def textbook_track(
    time_s: FloatArray, accel: FloatArray, gyro: FloatArray, settings: TextbookSettings | None = None
) -> FloatArray:
    """Positions (n, 3), m, z up, of a foot that rests at first; ``accel`` m/s², ``gyro`` rad/s, both (n, 3).

    Two passes, as the reference script has them: the detector over all samples, then the filter.
    """
    settings = settings or TextbookSettings()
    rest = slice(0, settings.align_samples)
    gyro = gyro - gyro[rest].mean(axis=0)
    still = shoe_stances(accel, gyro, settings)
    ins = TextbookFilter(levelled(accel[rest].mean(axis=0)), settings)
    position = np.zeros((len(time_s), 3))
    for k in range(1, len(time_s)):
        ins.predict(accel[k], gyro[k], time_s[k] - time_s[k - 1])
        if still[k]:
            ins.zero_velocity()
        position[k] = ins.position
    return position
