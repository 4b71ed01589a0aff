"""The low-rate filter: one state, one covariance, one way to update it, one gate.

Kalman's algebra with Joseph's form of the update (Bucy and Joseph 1968), around it what
is nonlinear: composing steps, wrapping angles. numpy alone: a library's filter would bring scipy.stats into every
fusion, for six lines.
"""

from dataclasses import dataclass

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import FootStep, Vector3
from fusion.chi_square import chi_square_quantile
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
    root = np.linalg.inv(np.linalg.cholesky(matrix))
    result: Array = root.T @ root
    return result


class StateFilter:
    """State (n,) and covariance (n, n) of all feet, in the frame of `fusion.state`; read them, never write."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.state: Array = np.zeros(layout.size)
        self.covariance: Array = np.zeros((layout.size, layout.size))

    def propagate(self, block: FootBlock, step: FootStep, noise: Array) -> None:
        """Compose a step (its covariance (4, 4) in the step's axes) onto a foot."""
        state, pose = self.state.copy(), self.state[block.all]
        transition, process = np.eye(state.size), np.zeros_like(self.covariance)
        transition[block.all, block.all] = foot_step.pose_jacobian(pose, step.displacement_m)
        spread = foot_step.step_jacobian(pose)
        process[block.all, block.all] = spread @ noise @ spread.T
        state[block.all] = foot_step.compose(pose, step.displacement_m, step.heading_change_rad)
        self.state = state
        self.covariance = transition @ self.covariance @ transition.T + process

    def update(self, measurement: Measurement) -> Innovation:
        """Gate, then update; the innovation tells what happened."""
        innovation = self._innovation(measurement)
        if innovation.accepted:
            self._correct(measurement)
            self._settle()
        return innovation

    def _correct(self, measurement: Measurement) -> None:
        """The gain, and with it state and covariance (Joseph's form: right for any gain, and never indefinite)."""
        jacobian, noise = measurement.jacobian, measurement.noise
        shared = self.covariance @ jacobian.T
        gain = shared @ invert_spd(jacobian @ shared + noise)
        kept = np.eye(self.layout.size) - gain @ jacobian
        self.state = self.state + gain @ measurement.residual
        self.covariance = kept @ self.covariance @ kept.T + gain @ noise @ gain.T

    def _innovation(self, measurement: Measurement) -> Innovation:
        noise = measurement.noise if measurement.gate_noise is None else measurement.gate_noise
        covariance = measurement.jacobian @ self.covariance @ measurement.jacobian.T + noise
        squared = float(measurement.residual @ invert_spd(covariance) @ measurement.residual)
        probability = measurement.gate_probability
        degrees = measurement.residual.size
        accepted = probability is None or squared <= chi_square_quantile(probability, degrees)
        return Innovation(measurement.source, measurement.residual, covariance, squared, accepted)

    def _settle(self) -> None:
        for block in self.layout.blocks:
            self.state[block.yaw] = wrap_angle(float(self.state[block.yaw]))
        self.covariance = 0.5 * (self.covariance + self.covariance.T)

    def widen(self, block: FootBlock, position_m2: float, yaw_rad2: float) -> None:
        """Add variance to one foot: something unobserved happened to it alone."""
        for index in range(block.start, block.start + 3):
            self.covariance[index, index] += position_m2
        self.covariance[block.yaw, block.yaw] += yaw_rad2

    def widen_together(self, position_covariance: Array, yaw_rad2: float = 0.0) -> None:
        """Add covariance (3, 3), m², and a yaw variance to all feet alike: the whole body was misjudged."""
        for one in self.layout.blocks:
            for other in self.layout.blocks:
                self.covariance[one.position, other.position] += position_covariance
                self.covariance[one.yaw, other.yaw] += yaw_rad2

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
        self.covariance = covariance
        self.state[block.all] = pose

    def transform(self, move: RigidTransform) -> None:
        """Carry the whole state into another frame; the move's own error becomes common to all feet."""
        jacobian = np.zeros_like(self.covariance)
        common = np.zeros((self.layout.size, FOOT_SIZE))
        state = self.state.copy()
        for block in self.layout.blocks:
            jacobian[block.all, block.all] = move.pose_jacobian()
            state[block.all] = move.pose(self.state[block.all])
            common[block.all] = move.error_jacobian(self._position(block))
        self.state = state
        self.covariance = jacobian @ self.covariance @ jacobian.T + common @ move.covariance @ common.T

    def _position(self, block: FootBlock) -> Vector3:
        east, north, up = (float(value) for value in self.state[block.position])
        return east, north, up
