"""A camera beside the feet, in one state with them (METHODS D6): same place, constant height above.

The camera walks as a foot does, by level steps (`fusion.camera_chain`). It *joins* the feet when both tracks have
shown how they lie, its height set to theirs; from then on the two constraints hold it to the body, softly, and what
it knows better (heading, length) reaches the feet through the covariance. While feet are silent it carries the
position; where there are none it begins the walk itself. After a time in which it saw nothing it joins again.
"""

import math
from collections import Counter

import numpy as np
from msgspec.structs import replace

from bootprint.clock import NS_PER_S
from bootprint.messages import CameraMotion, FootStep, Vector3, symmetric, upper_triangle
from fusion.boots import Boots
from fusion.camera_chain import CameraChain, CameraStep, is_plausible
from fusion.config import FusionConfig
from fusion.feet import Foot
from fusion.filter import Measurement
from fusion.joining import Joining, relative_noise
from fusion.models import body, camera, foot_step
from fusion.models.turned import unturned
from fusion.rooms.sight import Sight, sight_of
from fusion.state import Array, FootBlock
from fusion.taken_along import TakenAlong
from fusion.tilt import Tilt
from fusion.transform import RigidTransform

_TILT_BASE_M = 3.0  # a tilt is learnt from displacements of at least this


class Camera:
    """The one camera of a soldier; ``foot`` is its part of the state, once it has any."""

    def __init__(self, boots: Boots, config: FusionConfig, counters: Counter[str]) -> None:
        self._boots, self._config, self._counters = boots, config, counters
        self._settings = config.camera
        boots_config = replace(config.boots, join_fit_sigma_m=config.camera.join_sigma_m)
        self._join_config = replace(config, boots=boots_config)
        self._source: str | None = None
        self.foot: Foot | None = None
        self.sight: Sight | None = None  # of the newest motion, if it told landmarks
        self._own: Array = np.zeros(4)  # pose in its own frame while not in the filter
        self._joining: Joining | None = None
        self._begin()

    def _begin(self) -> None:
        settings = self._settings
        self._chain = CameraChain()
        self._tilt = Tilt(settings.tilt_sigma_rad, settings.tilt_walk_rad_sqrt_s, settings.climb_sigma_m)
        self._heard_ns: int | None = None
        self._coupled_ns = -(1 << 62)
        self._since: tuple[Array, Array] | None = (
            None  # level track of the camera, and the body, where tilt was learnt
        )
        self._level: Array = np.zeros(3)
        self._trust_from_ns = -math.inf  # a camera that contradicted the feet waits, longer every time
        self._sequence = 0
        self._along = TakenAlong()
        self._held: list[FootStep] = []  # while it is not known whether feet will come

    @property
    def is_reference(self) -> bool:
        """Whether the walk is told by the camera's track."""
        return self.foot is not None and self._boots.reference is self.foot

    def take(self, source: str, motion: CameraMotion) -> FootStep | None:
        """A motion; the step that it shows to be finished, if that moved the camera within the filter."""
        if self._boots.filter.tape is not None:
            return None  # a smoother is of feet
        if self._source not in (None, source):
            self._counters["second_cameras"] += 1
            return None
        self._source = source
        yaw = camera.heading(self._chain.attitude)
        finished = self._chain.take(motion)
        self._heard_ns = motion.time_ns
        if motion.up is not None:
            self._tilt.note_level(self._settings.level_sigma_rad)
        moved = None if finished is None else self._step(finished, yaw)
        self._note_sight(motion)
        self._look_ahead()
        return moved

    def _note_sight(self, motion: CameraMotion) -> None:
        """Landmarks are of the motion's start, which is where the newest step has ended."""
        self.sight = None
        if self.foot is not None and self.foot.active and self._boots.in_enu:
            pose = self._boots.filter.state[self.foot.block.all]
            self.sight = sight_of(motion, self._chain.attitude, pose)

    def note_move(self, transform: RigidTransform) -> None:
        """The filter has changed its frame."""
        self._since = None
        self._along.turn(transform.yaw_rad)
        if self._joining is not None:
            self._joining.relocate(transform)

    def follow(self, boots: Boots) -> None:
        """The estimate goes on from these boots; if they are others, the camera has to join them."""
        if boots is self._boots:
            return
        self._boots = boots
        blocks = boots.filter.layout.beside
        self.foot = boots.stand_in or (Foot(blocks[0]) if blocks else None)
        self._own, self._joining, self._since = np.zeros(4), None, None
        self._along.clear()
        if self.foot is not None and not self.is_reference:
            self._leave(self.foot)

    def take_back(self, place: str, step: FootStep) -> Array:
        """A foot is about to tell, late, of a time in which the camera took it along; what to put on afterwards."""
        return self._along.take_back(self._boots, self._boots.feet[place], step)

    def put_on(self, place: str, moved: Array) -> None:
        """The late step has been composed."""
        self._along.put_on(self._boots, self._boots.feet[place], moved)

    def shift(self, by_ns: int) -> None:
        """The clock has been set: the chain starts anew, the place is kept."""
        self._along.clear()
        self._begin()
        if self.foot is not None and not self.is_reference:
            self._leave(self.foot)

    # --- steps -------------------------------------------------------------------------------------------------

    def _step(self, finished: CameraStep, yaw: float) -> FootStep | None:
        if finished.gap_s > 0.0:
            self._own_up(finished.gap_s)
        if not is_plausible(finished, self._config.boots.max_speed_m_s):
            self._counters["implausible_camera_motions"] += 1
            self._own_up((finished.time_ns - finished.start_ns) / NS_PER_S)
            return None
        self._counters["camera_steps"] += 1
        step = self._as_foot_step(finished)
        self._level = self._level + np.array(foot_step.rotate(yaw, step.displacement_m))
        self._tilt.age((finished.time_ns - finished.start_ns) / NS_PER_S)
        if self.foot is None or not self.foot.active:
            held = self._held
            self._approach(step)
            return held[0] if self.is_reference else None
        self._along.step(self._boots, self.foot, step, self._noise(finished))
        self._note(self.foot, step)
        self._couple(self.foot, step.time_ns)
        return step

    def _as_foot_step(self, step: CameraStep) -> FootStep:
        self._sequence += 1
        return FootStep(
            time_ns=step.time_ns,
            sequence=self._sequence - 1,
            start_time_ns=step.start_ns,
            displacement_m=step.displacement_m,
            heading_change_rad=step.turn_rad,
            covariance=upper_triangle(step.covariance),
        )

    def _noise(self, step: CameraStep) -> Array:
        """The step's covariance, and what steps have in common: scale, tilt, drift of heading.

        Scale and tilt err alike in all steps of a stretch, so that the error of its end grows with its length:
        independent steps add up to as much by the end of it with the variance ``σ²·length·stretch``.
        """
        settings = self._settings
        length_m = math.hypot(*step.displacement_m)
        alike_m = math.sqrt(length_m * max(length_m, settings.stretch_m))
        slope = math.hypot(settings.scale_sigma, self._tilt.sigma_rad)
        turn = settings.heading_walk_rad_sqrt_s**2 * (step.time_ns - step.start_ns) / NS_PER_S
        shared = np.array([settings.scale_sigma, settings.scale_sigma, slope]) * alike_m
        return np.asarray(step.covariance + np.diag([*shared**2, turn]))

    def _note(self, foot: Foot, step: FootStep) -> None:
        foot.note_step(step, math.sqrt(max(0.0, step.covariance[4])))
        foot.end_ns = step.time_ns
        foot.hear(step.time_ns)
        self._boots.sample(foot, step.time_ns)

    def _look_ahead(self) -> None:
        """Where the camera is beyond its last step, for what is published meanwhile."""
        pending = self._chain.pending()
        if self.foot is None or not self.foot.active or pending is None or pending.gap_s > 0.0:
            return
        self.foot.offset = pending.displacement_m
        self.foot.hear(pending.time_ns)
        self._boots.sample(self.foot, pending.time_ns)

    def _own_up(self, unseen_s: float) -> None:
        """Nobody saw where the camera went: widen, or leave where feet know better."""
        silence = self._config.silence
        self._counters["camera_gaps"] += 1
        self._joining, self._since = None, None
        if self.foot is None or not self.foot.active:
            return
        if self._boots.heard_feet(self._heard_ns or 0):
            self._leave(self.foot)
            return
        uncarried_s = self.foot.uncarried_s(unseen_s, self._boots.carried_ns)
        drift, turn = silence.drift_m_s * uncarried_s, silence.turn_rad_sqrt_s
        together = [one.block for one in self._boots.everybody() if one.active]
        self._boots.filter.widen_together(drift**2 * np.eye(3))
        self._boots.filter.widen_turned(together, turn**2 * unseen_s)

    def _leave(self, foot: Foot) -> None:
        foot.active = False
        foot.trail.clear()
        self._own, self._joining, self._since = np.zeros(4), None, None
        self._boots.dismiss()

    # --- into the filter ---------------------------------------------------------------------------------------

    def _approach(self, step: FootStep) -> None:
        """Walk on in a frame of its own, until its track shows how it lies beside the feet; alone, begin."""
        if self._boots.reference is None:
            self._held.append(step)
            if step.time_ns - self._held[0].start_time_ns > self._config.silence.patience_s * NS_PER_S:
                self._begin_walk()
            return
        self._own = foot_step.compose(self._own, step.displacement_m, step.heading_change_rad)
        beside = self._boots.reference
        feet = self._boots.heard_feet(step.time_ns)
        if not feet or step.time_ns < self._trust_from_ns:
            self._joining = None
            return
        if self._joining is None or self._joining.is_hopeless:
            self._joining = Joining(together=False)
        place = np.mean([foot.trail.at(step.time_ns) for foot in feet if foot.trail], axis=0)
        self._joining.add(_xyz(self._own), _xyz(place))
        move = self._joining.fit(self._join_config)
        if move is None:
            return
        foot = self._part()
        noise = relative_noise(move, self._own)
        self._boots.filter.join(foot.block, beside.block, move.pose(self._own), noise, alike=False)
        self._joined(foot, step)
        self._counters["cameras_joined"] += 1

    def _begin_walk(self) -> None:
        """No feet have come for a while: the frame begins where the camera began."""
        foot, held = self._part(), self._held
        self._held = []
        self._boots.begin(foot, held[0].start_time_ns)
        for step in held:
            self._boots.filter.propagate(foot.block, step, symmetric(step.covariance))
        self._joined(foot, held[-1])

    def _joined(self, foot: Foot, step: FootStep) -> None:
        foot.active, self._joining = True, None
        self._boots.stand_in = foot
        self._note(foot, step)

    def _part(self) -> Foot:
        """The camera's part of the state, made when it is first wanted: who has no camera carries none."""
        if self.foot is None:
            block: FootBlock = self._boots.filter.extend(self._source or "camera")
            self.foot = Foot(block)
        return self.foot

    # --- held to the body --------------------------------------------------------------------------------------

    def _couple(self, foot: Foot, time_ns: int) -> None:
        """The paper's constraints, once a second, for sway and stride err alike within one."""
        feet = self._boots.heard_feet(time_ns)
        if not feet or time_ns - self._coupled_ns < self._settings.couple_s * NS_PER_S:
            return
        self._coupled_ns = time_ns
        stands = [(one.block, one.offset) for one in feet]
        state = self._boots.filter.state
        here = body.position(state, stands)
        jacobian = -body.position_jacobian(state, stands)
        jacobian[:, foot.block.position] += np.eye(3)
        away = state[foot.block.position] - here  # what is ahead of the feet turns with them too
        jacobian = unturned(jacobian, away, body.heading_jacobian(state, stands))
        place = here + self._boots.ahead(feet, time_ns)
        residual = place - state[foot.block.position]
        self._learn_tilt(place)
        settings = self._settings
        across, up = settings.same_position_sigma_m**2, settings.offset_sigma_m**2
        noise = np.diag([across, across, up])
        gate = self._config.boots.gate_probability
        repeated = noise * max(1.0, 2.0 * settings.repeats)
        innovation = self._boots.correct(
            Measurement(
                "camera",
                residual,
                jacobian,
                repeated,
                gate_noise=noise,
                gate_probability=gate,
                relative=True,
            )
        )
        if not innovation.accepted:
            self._counters["camera_apart"] += 1
            self._trust_from_ns = (
                time_ns + self._counters["camera_apart"] * self._settings.distrust_s * NS_PER_S
            )
            self._leave(foot)

    def _learn_tilt(self, place: Array) -> None:
        """Compare the camera's climb with the feet's, since the last time."""
        if self._since is None:
            self._since = (self._level, place)
            return
        moved = self._level - self._since[0]
        if math.hypot(moved[0], moved[1]) < _TILT_BASE_M:
            return
        self._chain.tilt(self._tilt.learn(moved, float(place[2] - self._since[1][2])))
        self._since = (self._level, place)


def _xyz(values: Array) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])
