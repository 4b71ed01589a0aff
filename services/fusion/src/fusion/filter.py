"""The low-rate filter: one state, one covariance, one way to update it, one gate.

Kalman's algebra with Joseph's form of the update (Bucy and Joseph 1968), around it what
is nonlinear: composing steps, wrapping angles. numpy alone: a library's filter would bring scipy.stats into every
fusion, for six lines.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import FootStep, Vector3
from fusion.chi_square import chi_square_quantile
from fusion.models import foot_step
from fusion.models.shared_errors import Shares
from fusion.models.turned import chord_of
from fusion.state import FOOT_SIZE, Array, FootBlock, Layout
from fusion.tape import Change, ChangeKind, Tape
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
    repeat); ``gate_probability`` None takes the measurement whatever its innovation is. ``entangled``: the error
    may share anything with the state's own, for it may stem from what others were told of it. Then the state takes
    the measurement over, error and all, instead of a mean of both: what is left of its own error is independent of
    what was replaced, so nothing counts twice. (Covariance intersection along the measured directions, whose
    optimum between two scalars is the surer of them: Julier and Uhlmann 1997.)

    ``relative``: it compares walkers with each other, and would be the same had all been turned and moved together.
    ``directs``: it tells a heading alone, so what it does to positions is to turn them about where that was sure.
    ``carries`` (3, 3) m²: where a doubtful heading may have led the body, beside its tangent. The measurement moves
    all walkers alike then and corrects nothing else: its linearisation is worth nothing for the heading, which
    stays as it is and as doubtful (Schmidt's consider filter).
    """

    source: str
    residual: Array
    jacobian: Array
    noise: Array
    gate_noise: Array | None = None
    gate_probability: float | None = None
    entangled: bool = False
    relative: bool = False
    directs: bool = False
    carries: Array | None = None


def invert_spd(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix by Cholesky; LinAlgError if it is none."""
    root = np.linalg.inv(np.linalg.cholesky(matrix))
    result: Array = root.T @ root
    return result


def _quarter_turn(way: Array) -> Vector3:
    """How a way (3,) m answers to a turn about the vertical, m/rad."""
    return -float(way[1]), float(way[0]), 0.0


class StateFilter:
    """State (n,) and covariance (n, n) of all feet, in the frame of `fusion.state`; read them, never write."""

    def __init__(self, layout: Layout, prior: tuple[Array, Array] | None = None) -> None:
        size = layout.size
        self.layout = layout
        self.tape: Tape | None = None  # for a smoother
        self.state, self.covariance = prior or (np.zeros(size), np.zeros((size, size)))

    def extend(self, place: str) -> FootBlock:
        """A block of zeros for one more that walks along; it joins, or begins the frame."""
        self.layout = self.layout.with_beside(place)
        self.state = np.concatenate([self.state, np.zeros(FOOT_SIZE)])
        self.covariance = np.pad(self.covariance, (0, FOOT_SIZE))
        return self.layout.beside[-1]

    def attach(self, name: str, offset: Array, response: Array, noise: Array) -> None:
        """An offset, (3,): it errs with the state by ``response`` (3, n), and by ``noise`` (3, 3) of its own."""
        self.layout = self.layout.with_attached(name)
        more = self.layout.size - self.state.size
        self.state = np.concatenate([self.state, np.zeros(more)])
        self.covariance = np.pad(self.covariance, (0, more))
        block = self.layout.attached_of(name)
        transition = np.eye(self.layout.size)
        transition[block] = np.pad(response, ((0, 0), (0, more)))
        self.state[block] = offset
        self.covariance = transition @ self.covariance @ transition.T
        self.covariance[block, block] += noise

    def detach(self, name: str) -> None:
        """This offset means nothing any more."""
        self.layout = self.layout.without(name)

    def loosen(self, block: slice, covariance: Array) -> None:
        """An offset may have changed, give or take (3, 3)."""
        process = np.zeros_like(self.covariance)
        process[block, block] = covariance
        self._advance(self.state, np.eye(self.layout.size), process)

    def propagate(
        self, block: FootBlock, step: FootStep, noise: Array, shares: Shares | None = None, kept: float = 1.0
    ) -> None:
        """Compose a step onto a foot; ``noise`` (4, 4) in the step's axes is what is the step's own.

        With ``shares`` the errors that the foot's steps share act on it, ``kept`` of them still from before.
        """
        state, pose = self.state.copy(), self.state[block.all]
        displacement, turn = step.displacement_m, step.heading_change_rad
        transition, process = np.eye(state.size), np.zeros_like(self.covariance)
        spread = foot_step.step_jacobian(pose)
        if shares is not None:
            displacement, turn = shares.corrected(step, state[block.common])
            transition[block.all, block.common] = spread @ shares.per_unit
            transition[block.common, block.common] *= kept
            process[block.common, block.common] = (1.0 - kept**2) * np.eye(3)
            state[block.common] *= kept
        transition[block.all, block.all] = foot_step.pose_jacobian(pose, displacement)
        process[block.all, block.all] = spread @ noise @ spread.T
        state[block.all] = foot_step.compose(pose, displacement, turn)
        self._advance(state, transition, process)

    def lead(self, block: FootBlock, step: FootStep, noise: Array, along: Sequence[FootBlock]) -> Array:
        """Compose a step onto one who takes others ``along``: these move and err with it, by (4,)."""
        pose, shared = self.state[block.all], np.zeros((self.layout.size, FOOT_SIZE))
        for one in (block, *along):
            shared[one.all] = np.eye(FOOT_SIZE)
        moved = foot_step.compose(pose, step.displacement_m, step.heading_change_rad) - pose
        transition, spread = np.eye(self.layout.size), foot_step.step_jacobian(pose)
        bent = foot_step.pose_jacobian(pose, step.displacement_m) - np.eye(FOOT_SIZE)
        transition[:, block.all] += shared @ bent
        self._advance(self.state + shared @ moved, transition, shared @ spread @ noise @ spread.T @ shared.T)
        self._settle()
        return np.asarray(moved)

    def displace(self, blocks: Sequence[FootBlock], by: Array, led_by: FootBlock) -> None:
        """Put these elsewhere, by (4,) that another led them: as sure as they were, but for the leader's yaw."""
        state, turning = self.state.copy(), np.eye(self.layout.size)
        for block in blocks:
            state[block.all] += by
            turning[block.position, led_by.yaw] += _quarter_turn(by)
        self._advance(state, turning, np.zeros_like(self.covariance))
        self._settle()

    def _advance(self, state: Array, transition: Array, process: Array, kind: ChangeKind = "carry") -> None:
        covariance = transition @ self.covariance @ transition.T + process
        if self.tape is not None:
            self.tape.changes.append(Change(self.state, self.covariance, transition, state, covariance, kind))
        self.state, self.covariance = state, covariance

    def update(self, measurement: Measurement) -> Innovation:
        """Gate, then update; the innovation tells what happened."""
        innovation = self._innovation(measurement)
        if innovation.accepted:
            if measurement.carries is not None:
                self.widen_together(measurement.carries)
            self._correct(measurement)
            self._settle()
        return innovation

    def _correct(self, measurement: Measurement) -> None:
        """The gain, and with it state and covariance (Joseph's form: right for any gain, and never indefinite)."""
        jacobian, noise = measurement.jacobian, measurement.noise
        shared = self.covariance @ jacobian.T
        gain = shared @ invert_spd(jacobian @ shared + (0.0 if measurement.entangled else 1.0) * noise)
        if measurement.carries is not None:
            gain = self._alike(gain, jacobian)
        kept = np.eye(self.layout.size) - gain @ jacobian
        correction = gain @ measurement.residual
        if measurement.directs:
            self._bend(correction)
        self.state = self.state + correction
        self.covariance = kept @ self.covariance @ kept.T + gain @ noise @ gain.T
        if measurement.relative or measurement.directs:
            self._turn_along(correction)

    def _alike(self, gain: Array, jacobian: Array) -> Array:
        """A gain by which all walkers move as those measured would in the mean, and nothing else changes."""
        walkers = self.layout.walkers
        measured = [block for block in walkers if jacobian[:, block.position].any()] or walkers
        alike = np.zeros_like(gain)
        for block in walkers:
            alike[block.position] = np.mean([gain[one.position] for one in measured], axis=0)
        return alike

    def _bend(self, correction: Array) -> None:
        """Along the arc, not along its tangent: ``δp ← V(δψ) δp``, the exponential of a planar motion."""
        for block in self.layout.walkers:
            correction[block.position] = chord_of(float(correction[block.yaw])) @ correction[block.position]

    def _turn_along(self, correction: Array) -> None:
        """What nobody has measured stays as unknown as it was, though positions have been corrected.

        A turn of everything moves a walker at p by ``J p``. Measurements between walkers cannot tell it; but once
        they have moved p, the covariance holds the turn about where p was, and the next one, linearised at p now,
        would take the difference for news: by a thousand of them a heading that nobody knows becomes sure (Huang,
        Mourikis and Roumeliotis 2010). So position errors follow, as those of an invariant filter do (Barrau and
        Bonnabel 2017): ``δp ← δp + J Δp δψ``.
        """
        turning = np.eye(self.layout.size)
        for block in self.layout.walkers:
            turning[block.position, block.yaw] = _quarter_turn(correction[block.position])
        self._advance(self.state, turning, np.zeros_like(self.covariance))

    def _innovation(self, measurement: Measurement) -> Innovation:
        noise = measurement.noise if measurement.gate_noise is None else measurement.gate_noise
        prior = self.covariance
        if measurement.carries is not None:
            prior = prior + self._common(measurement.carries, 0.0)
        covariance = measurement.jacobian @ prior @ measurement.jacobian.T + noise
        squared = float(measurement.residual @ invert_spd(covariance) @ measurement.residual)
        probability = measurement.gate_probability
        degrees = measurement.residual.size
        accepted = probability is None or squared <= chi_square_quantile(probability, degrees)
        return Innovation(measurement.source, measurement.residual, covariance, squared, accepted)

    def _settle(self) -> None:
        for block in self.layout.walkers:  # of a state that the correction has made anew
            self.state[block.yaw] = wrap_angle(float(self.state[block.yaw]))
        self.covariance = 0.5 * (self.covariance + self.covariance.T)

    def widen(self, block: FootBlock, position_m2: float, yaw_rad2: float) -> None:
        """Add variance to one foot: something unobserved happened to it alone."""
        process = np.zeros_like(self.covariance)
        process[block.position, block.position] = position_m2 * np.eye(3)
        process[block.yaw, block.yaw] = yaw_rad2
        self._advance(self.state, np.eye(self.layout.size), process)

    def widen_together(self, position_covariance: Array, yaw_rad2: float = 0.0) -> None:
        """Add covariance (3, 3), m², and a yaw variance to all feet alike: the whole body was misjudged."""
        common = self._common(position_covariance, yaw_rad2)
        self._advance(self.state, np.eye(self.layout.size), common)

    def _common(self, position_covariance: Array, yaw_rad2: float) -> Array:
        """Covariance (n, n) of what is common to all who walk."""
        process = np.zeros_like(self.covariance)
        for one in self.layout.walkers:
            for other in self.layout.walkers:
                process[one.position, other.position] = position_covariance
                process[one.yaw, other.yaw] = yaw_rad2
        return process

    def carry(self, by_m: Array, covariance: Array) -> None:
        """Move all feet alike by (3,) m, give or take ``covariance`` (3, 3)."""
        state, process = self.state.copy(), np.zeros_like(self.covariance)
        for one in self.layout.walkers:
            state[one.position] += by_m
            for other in self.layout.walkers:
                process[one.position, other.position] = covariance
        self._advance(state, np.eye(self.layout.size), process)

    def widen_turned(self, feet: Sequence[FootBlock], yaw_rad2: float) -> None:
        """The body may have turned unseen, about the middle between its feet: they went round with it."""
        middle = np.mean([self.state[block.position] for block in feet], axis=0)
        response = np.zeros(self.layout.size)
        for block in feet:
            east, north, _ = self.state[block.position] - middle
            response[block.all] = (-north, east, 0.0, 1.0)
        self._advance(self.state, np.eye(self.layout.size), yaw_rad2 * np.outer(response, response))

    def join(self, block: FootBlock, beside: FootBlock, pose: Array, noise: Array, alike: bool) -> None:
        """Set a foot to ``pose`` (4,), found relative to the foot ``beside`` it, give or take ``noise`` (4, 4).

        State augmentation: the new foot shares every error of the foot it was compared with, and turns with it if
        that was under way. Where both set off ``alike``, what the heading errs by since is each one's own, and the
        difference between them as much the fault of the one as of the other: each gets half of it, with opposite
        shares, and it is their mean that keeps the covariance of the foot that was here first.
        """
        transition, process = np.eye(self.layout.size), np.zeros_like(self.covariance)
        transition[block.all] = transition[beside.all]
        process[block.all, block.all] = noise
        if not alike:
            transition[block.position, beside.yaw] += _quarter_turn(pose[:3] - self.state[beside.position])
        else:
            for one, other in ((block, block), (beside, beside), (block, beside), (beside, block)):
                process[one.all, other.all] = (0.25 if one is other else -0.25) * noise
        state = self.state.copy()
        state[block.all] = pose
        self._advance(state, transition, process)

    def transform(self, move: RigidTransform, sighted: FootBlock | None = None) -> None:
        """Carry the whole state into another frame; the move's own error becomes common to all feet.

        ``sighted``: by whom the move took its direction, if anybody.
        """
        jacobian = np.eye(self.layout.size)
        common = np.zeros((self.layout.size, FOOT_SIZE))
        state = self.state.copy()
        for block in self.layout.walkers:
            jacobian[block.all, block.all] = move.pose_jacobian()
            state[block.all] = move.pose(self.state[block.all])
            common[block.all] = move.error_jacobian(self._position(block))
        if sighted is not None:
            plane = slice(sighted.start, sighted.start + 2)
            jacobian[:, plane] += np.outer(common[:, 3], move.turn_response())
        self._advance(state, jacobian, common @ move.covariance @ common.T, "frame")

    def _position(self, block: FootBlock) -> Vector3:
        east, north, up = (float(value) for value in self.state[block.position])
        return east, north, up
