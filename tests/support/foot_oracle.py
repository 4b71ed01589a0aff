"""The foot filter once more, as the textbook writes it: plain NumPy and SciPy, matrices, nothing clever.

The oracle of the compiled kernel: error state (δp, δv, δθ, δl), attitude error in nav axes, lever in sensor axes.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

POSITION, VELOCITY, ATTITUDE, LEVER = (slice(k, k + 3) for k in (0, 3, 6, 9))
HEADING = 8


def cross_matrix(v: np.ndarray) -> np.ndarray:
    """[v]×, so that [v]× u = v × u."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


@dataclass
class Noise:
    """Densities and sigmas, named as the filter's settings."""

    accel: float = 0.012
    gyro: float = 0.0006
    accel_scale: float = 0.005
    accel_timing: float = 3e-4
    gyro_scale: float = 0.002
    bias_sigma: float = 0.0
    clip: float = 0.06
    velocity_sigma: float = 0.01
    learned: float = 3.0
    motion: float = 0.5
    hidden_motion: float = 0.3
    gate: float = 3.0


@dataclass
class Oracle:
    """Nominal state and covariance."""

    attitude: Rotation
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    lever: np.ndarray = field(default_factory=lambda: np.zeros(3))
    step_position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    P: np.ndarray = field(default_factory=lambda: np.zeros((12, 12)))
    gravity: float = 9.81
    noise: Noise = field(default_factory=Noise)

    def force(self, accel: np.ndarray, rate: np.ndarray, dt: float) -> np.ndarray:
        """Specific force in nav axes, with the attitude in the middle of the interval."""
        return (self.attitude * Rotation.from_rotvec(0.5 * rate * dt)).apply(accel)

    def transition(self, force: np.ndarray, dt: float) -> np.ndarray:
        """F of the interval."""
        F = np.eye(12)
        F[POSITION, VELOCITY] = dt * np.eye(3)
        F[POSITION, ATTITUDE] = -0.5 * dt**2 * cross_matrix(force)
        F[VELOCITY, ATTITUDE] = -dt * cross_matrix(force)
        return F

    def predict(
        self, accel: np.ndarray, rate: np.ndarray, dt: float, clipped: np.ndarray, before: np.ndarray
    ) -> None:
        """One interval of mean specific force (``before``: in the interval before) and mean angular rate."""
        force = self.force(accel, rate, dt)
        motion = force - np.array([0, 0, self.gravity])
        F = self.transition(force, dt)
        self.position = self.position + self.velocity * dt + 0.5 * motion * dt**2
        self.velocity = self.velocity + motion * dt
        self.attitude = self.attitude * Rotation.from_rotvec(rate * dt)
        Q = np.zeros((12, 12))
        shaking = self.noise.accel_scale * np.linalg.norm(motion)
        shock = self.noise.accel_timing * np.linalg.norm(accel - before)
        Q[VELOCITY, VELOCITY] = ((self.noise.accel**2 + shaking**2) * dt + shock**2) * np.eye(3)
        C = self.attitude.as_matrix()
        turning = self.noise.gyro_scale * np.linalg.norm(rate)
        angle = self.noise.gyro**2 + turning**2 + self.noise.bias_sigma**2
        Q[ATTITUDE, ATTITUDE] = angle * dt * np.eye(3)
        Q[ATTITUDE, ATTITUDE] += C @ np.diag(clipped * self.noise.clip**2 * dt) @ C.T
        self.P = F @ self.P @ F.T + Q

    def sole_velocity(self, rate: np.ndarray) -> np.ndarray:
        """h: velocity of the sole's still point."""
        return self.velocity + self.attitude.apply(np.cross(rate, self.lever))

    def jacobian(self, rate: np.ndarray) -> np.ndarray:
        """H of `sole_velocity`."""
        C = self.attitude.as_matrix()
        H = np.zeros((3, 12))
        H[:, VELOCITY] = np.eye(3)
        H[:, ATTITUDE] = -cross_matrix(C @ np.cross(rate, self.lever))
        H[:, LEVER] = C @ cross_matrix(rate)
        return H

    def creep(self, sigma: float, dt: float) -> None:
        """What stance hides: the place wanders by a velocity σ that lasts a while."""
        self.P[POSITION, POSITION] += sigma**2 * self.noise.hidden_motion * dt * np.eye(3)

    def expected(self, along: float, up: float) -> np.ndarray:
        """The sole's mean velocity, given as speeds along the step's way and up; less of it after a short way."""
        way = (self.position - self.step_position)[:2]
        length = np.linalg.norm(way)
        share = self.noise.motion * length / np.hypot(length, 0.3)
        return share * np.array([*(along * way / length), up])

    def zero_velocity(
        self, rate: np.ndarray, dt: float, sigma: float = 0.0, motion: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """The Joseph form, with the measurement's noise inflated where the innovation passes the gate."""
        H, y = self.jacobian(rate), self.expected(*motion) - self.sole_velocity(rate)
        variance = self.noise.velocity_sigma**2 + (self.noise.learned * sigma) ** 2
        S = H @ self.P @ H.T + variance * 0.005 / dt * np.eye(3)
        distance = np.sqrt(y @ np.linalg.solve(S, y))
        S = S * max(1.0, distance / self.noise.gate)
        R = S - H @ self.P @ H.T
        K = self.P @ H.T @ np.linalg.inv(S)
        I_KH = np.eye(12) - K @ H
        self.P = I_KH @ self.P @ I_KH.T + K @ R @ K.T
        self.inject(K @ y)

    def inject(self, error: np.ndarray) -> None:
        """Move an error into the nominal state."""
        self.position = self.position + error[POSITION]
        self.velocity = self.velocity + error[VELOCITY]
        self.attitude = Rotation.from_rotvec(error[ATTITUDE]) * self.attitude
        self.lever = self.lever + error[LEVER]

    def error_of(self, other: "Oracle") -> np.ndarray:
        """The error state that leads from this nominal state to ``other``."""
        turn = (other.attitude * self.attitude.inv()).as_rotvec()
        return np.concatenate(
            [other.position - self.position, other.velocity - self.velocity, turn, other.lever - self.lever]
        )

    def forget_place(self) -> None:
        """Step-wise reset."""
        rows = [0, 1, 2, HEADING]
        self.P[rows, :] = 0
        self.P[:, rows] = 0
