"""The low-rate filter: one state, one covariance, one way to update it, one gate.

filterpy's `KalmanFilter` keeps x and P and does the algebra (Joseph form); what is nonlinear (composing steps,
wrapping angles) is done here around it, and its ``inv`` is replaced by a Cholesky solve.
"""

from dataclasses import dataclass

import numpy as np
from filterpy.kalman import KalmanFilter
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtri

from bootprint.geodesy import wrap_angle
from bootprint.messages import FootStep, Vector3
from fusion.models import foot_step
from fusion.state import FOOT_SIZE, Array, FootBlock, Layout
from fusion.transform import RigidTransform


@dataclass(frozen=True, slots=True)
class Innovation:
    """What one update found: residual (k,), its covariance (k, k) as the gate saw it, and the verdict."""

    source: str
    residual: Array
    covariance: Array
    normalised_squared: float
    accepted: bool


@dataclass(frozen=True, slots=True)
class Measurement:
    """A linearised measurement: ``residual = z − h(x)`` (k,), ``jacobian = ∂h/∂x`` (k, n), noise (k, k).

    ``gate_noise`` is the size of a single error where that differs from what an update may assume (errors that
    repeat); ``gate_probability`` None takes the measurement whatever its innovation is.
    """

    source: str
    residual: Array
    jacobian: Array
    noise: Array
    gate_noise: Array | None = None
    gate_probability: float | None = None


def invert_spd(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix by Cholesky; LinAlgError if it is none."""
    result: Array = cho_solve(cho_factor(matrix, lower=True), np.eye(matrix.shape[0]))
    return result


def chi_square_quantile(probability: float, degrees: int) -> float:
    """The value that a chi-square variable stays below with this probability."""
    return float(chdtri(degrees, 1.0 - probability))


class StateFilter:
    """State and covariance of all feet, in the frame of `fusion.state`."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._kalman = KalmanFilter(dim_x=layout.size, dim_z=3)
        self._kalman.x = np.zeros(layout.size)
        self._kalman.P = np.zeros((layout.size, layout.size))
        self._kalman.inv = invert_spd

    @property
    def state(self) -> Array:
        """State (n,); treat as read-only."""
        state: Array = self._kalman.x
        return state

    @property
    def covariance(self) -> Array:
        """Covariance (n, n); treat as read-only."""
        covariance: Array = self._kalman.P
        return covariance

    def propagate(self, block: FootBlock, step: FootStep, noise: Array) -> None:
        """Compose a step (its covariance (4, 4) in the step's axes) onto a foot."""
        state, pose = self.state.copy(), self.state[block.all]
        transition, process = np.eye(state.size), np.zeros_like(self.covariance)
        transition[block.all, block.all] = foot_step.pose_jacobian(pose, step.displacement_m)
        spread = foot_step.step_jacobian(pose)
        process[block.all, block.all] = spread @ noise @ spread.T
        state[block.all] = foot_step.compose(pose, step.displacement_m, step.heading_change_rad)
        self._kalman.predict(F=transition, Q=process)
        self._kalman.x = state  # predict() has moved x linearly; the composition is exact

    def update(self, measurement: Measurement) -> Innovation:
        """Gate, then update; the innovation tells what happened."""
        innovation = self._innovation(measurement)
        if innovation.accepted:
            jacobian = measurement.jacobian
            self._kalman.update(measurement.residual + jacobian @ self.state, R=measurement.noise, H=jacobian)
            self._settle()
        return innovation

    def _innovation(self, measurement: Measurement) -> Innovation:
        noise = measurement.noise if measurement.gate_noise is None else measurement.gate_noise
        covariance = measurement.jacobian @ self.covariance @ measurement.jacobian.T + noise
        squared = float(measurement.residual @ cho_solve(cho_factor(covariance), measurement.residual))
        probability = measurement.gate_probability
        degrees = measurement.residual.size
        accepted = probability is None or squared <= chi_square_quantile(probability, degrees)
        return Innovation(measurement.source, measurement.residual, covariance, squared, accepted)

    def _settle(self) -> None:
        for block in self.layout.blocks:
            self._kalman.x[block.yaw] = wrap_angle(float(self._kalman.x[block.yaw]))
        self._kalman.P = 0.5 * (self._kalman.P + self._kalman.P.T)

    def widen(self, block: FootBlock, position_m2: float, yaw_rad2: float) -> None:
        """Add variance to one foot: something unobserved happened to it alone."""
        for index in range(block.start, block.start + 3):
            self._kalman.P[index, index] += position_m2
        self._kalman.P[block.yaw, block.yaw] += yaw_rad2

    def widen_together(self, position_covariance: Array, yaw_rad2: float = 0.0) -> None:
        """Add covariance (3, 3), m², and a yaw variance to all feet alike: the whole body was misjudged."""
        for one in self.layout.blocks:
            for other in self.layout.blocks:
                self._kalman.P[one.position, other.position] += position_covariance
                self._kalman.P[one.yaw, other.yaw] += yaw_rad2

    def join(self, block: FootBlock, beside: FootBlock, pose: Array, noise: Array, alike: bool) -> None:
        """Set a foot to ``pose`` (4,), found relative to the foot ``beside`` it, give or take ``noise`` (4, 4).

        State augmentation: the new foot shares every error of the foot it was compared with. Where both set off
        ``alike``, the difference between them is as much the fault of the one as of the other: each gets half of
        it, with opposite shares, and it is their mean that keeps the covariance of the foot that was here first.
        """
        covariance = self.covariance.copy()
        covariance[block.all, :] = covariance[beside.all, :]
        covariance[:, block.all] = covariance[:, beside.all]
        shares = [(block, block, 1.0)]
        if alike:
            shares = [
                (one, other, 0.25 if one is other else -0.25)
                for one in (block, beside)
                for other in (block, beside)
            ]
        own = self.covariance[beside.all, beside.all].copy()
        for one, other, share in shares:
            covariance[one.all, other.all] = own + share * noise
        self._kalman.P = covariance
        self._kalman.x[block.all] = pose

    def transform(self, move: RigidTransform) -> None:
        """Carry the whole state into another frame; the move's own error becomes common to all feet."""
        jacobian = np.zeros_like(self.covariance)
        common = np.zeros((self.layout.size, FOOT_SIZE))
        state = self.state.copy()
        for block in self.layout.blocks:
            jacobian[block.all, block.all] = move.pose_jacobian()
            state[block.all] = move.pose(self.state[block.all])
            common[block.all] = move.error_jacobian(self._position(block))
        self._kalman.x = state
        self._kalman.P = jacobian @ self.covariance @ jacobian.T + common @ move.covariance @ common.T

    def _position(self, block: FootBlock) -> Vector3:
        east, north, up = (float(value) for value in self.state[block.position])
        return east, north, up
