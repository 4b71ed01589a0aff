"""Both feet through one filter: steps composed, gaps owned up to, feet holding each other (METHODS D4).

The first foot that steps begins the boots frame. Another foot's heading against it is unknown (each sensor sits on
its boot as it likes), so it *joins* (`fusion.joining`): when both have walked a few metres their tracks show it.
A foot that was unseen for long joins again.
"""

import math
from collections import Counter

import numpy as np

from bootprint.messages import FootPose, FootStep, MotionClass, Vector3
from fusion.config import FusionConfig
from fusion.feet import Entry, Foot
from fusion.filter import Innovation, Measurement, StateFilter
from fusion.joining import Joining, relative_noise
from fusion.models import body, dual_foot, foot_step
from fusion.models.dual_foot import Passing
from fusion.state import Array, Layout
from fusion.transform import RigidTransform

_COARSE_STEP = np.diag([0.1, 0.1, 0.1, 0.05]) ** 2  # for a step whose covariance is none
_MOVING_M = 0.1  # a shorter step is standing
_SHORTEST_S, _LONGEST_S = 0.25, 60.0  # of a step, for what speed says of its length
_LONGEST_SWING_S = 10.0  # no stance in that time: where the foot is is anybody's guess
_TOGETHER_NS = 2_000_000_000  # feet whose first steps are this near set off together


class Boots:
    """The feet of one soldier."""

    def __init__(self, config: FusionConfig, counters: Counter[str]) -> None:
        layout = Layout.of(config.feet)
        self.filter = StateFilter(layout)
        self.feet = {block.place: Foot(block) for block in layout.blocks}
        self.reference: Foot | None = None  # the foot whose track stands for the walk
        self._began_ns = 0
        self._config = config
        self._counters = counters

    # --- what comes in -----------------------------------------------------------------------------------------

    def step(self, place: str, step: FootStep) -> Foot | None:
        """Take a step into account; the foot if the step moved it within the filter."""
        foot = self.feet[place]
        newer = foot.end_ns is None or step.time_ns > foot.end_ns
        entry = foot.ledger.enter(step.sequence, newer)
        if entry is None:
            self._counters["duplicate_steps"] += 1
            return None
        self._begin(foot, step)
        self._own_up(foot, step, entry)
        moved = self._compose(foot, step, newer)
        foot.end_ns = step.time_ns if newer else foot.end_ns
        foot.hear(step.time_ns)
        return foot if moved and foot.active else None

    def pose(self, place: str, pose: FootPose) -> None:
        """Take where a foot is between two steps."""
        foot = self.feet[place]
        if math.hypot(*pose.displacement_m) > self._config.boots.max_speed_m_s * _LONGEST_SWING_S:
            self._counters["implausible_poses"] += 1
        elif self._was_left_behind(foot, pose.time_ns):
            self._counters["poses_after_silence"] += 1
        elif not foot.note_pose(pose):
            self._counters["poses_without_step"] += 1
        elif foot.active:
            self._sample(foot, pose.time_ns)

    def _was_left_behind(self, foot: Foot, now_ns: int) -> bool:
        """Whether the other foot walked on while this one was silent: only its next step tells what it has missed.

        Its poses go on from where it was then. They would pull the body back there.
        """
        return not foot.is_heard(now_ns, self._config.silence.coasting_s) and bool(self._others(foot, now_ns))

    def _begin(self, foot: Foot, step: FootStep) -> None:
        """The first foot to step begins the frame: there, exactly."""
        if self.reference is None:
            foot.active = True
            self.reference = foot
            self._began_ns = step.start_time_ns
            self._sample(foot, step.start_time_ns)

    def _own_up(self, foot: Foot, step: FootStep, entry: Entry) -> None:
        """Widen the covariance by what happened to this foot unseen; drop it if the other one saw more."""
        silence = self._config.silence
        untracked_s = foot.untracked_s(step, entry.unseen)
        self._counters["lost_steps"] += entry.lost
        self._counters["foot_restarts"] += entry.anew
        forgiven_s = (
            silence.coasting_s if step.realigned else silence.rejoin_s
        )  # a broken step tells no way at all
        if untracked_s > forgiven_s and self._others(foot, step.time_ns):
            self._drop(foot)
        elif foot.active and untracked_s > 0.0:
            moved, turned = silence.drift_m_s * untracked_s, silence.turn_rad_sqrt_s
            self._widen(foot, moved**2, turned**2 * untracked_s)

    def _widen(self, foot: Foot, position_m2: float, yaw_rad2: float) -> None:
        self.filter.widen(foot.block, position_m2, yaw_rad2)

    def _drop(self, foot: Foot) -> None:
        foot.active, foot.joining, foot.own = False, None, np.zeros(4)
        foot.samples.clear()
        if self.reference is foot:
            self.reference = next(other for other in self.feet.values() if other.active)
        self._counters["feet_dropped"] += 1

    def _others(self, foot: Foot, now_ns: int) -> list[Foot]:
        """The other feet that are in the filter and alive."""
        coasting_s = self._config.silence.coasting_s
        return [
            other
            for other in self.feet.values()
            if other is not foot and other.active and other.is_heard(now_ns, coasting_s)
        ]

    def _compose(self, foot: Foot, step: FootStep, newer: bool) -> bool:
        duration_s = (step.time_ns - step.start_time_ns) / 1e9
        plausible_s = min(max(duration_s, _SHORTEST_S), _LONGEST_S)
        if math.hypot(*step.displacement_m) > self._config.boots.max_speed_m_s * plausible_s:
            self._counters["implausible_steps"] += 1
            if foot.active:
                self._widen(foot, (self._config.silence.drift_m_s * max(plausible_s, 0.5)) ** 2, 0.0)
            return False
        covariance = foot_step.step_covariance(step.covariance)
        if covariance is None:
            self._counters["bad_covariances"] += 1
            covariance = _COARSE_STEP
        noise = covariance + foot_step.unmodelled(step.displacement_m, duration_s, self._config.boots)
        if newer:
            foot.note_step(step, math.sqrt(noise[1, 1]))
        if foot.active:
            self._move(foot, step, noise)
        else:
            self._approach(foot, step)
        return True

    def _move(self, foot: Foot, step: FootStep, noise: Array) -> None:
        self.filter.propagate(foot.block, step, noise)
        self._sample(foot, step.time_ns)
        if math.hypot(*step.displacement_m[:2]) > _MOVING_M:
            self._couple(foot, step)

    def _sample(self, foot: Foot, time_ns: int) -> None:
        point = body.foot_position(self.filter.state, (foot.block, foot.offset))
        if not foot.samples or time_ns > foot.samples[-1][0]:
            foot.samples.append((time_ns, point))
        else:
            foot.samples[-1] = (foot.samples[-1][0], point)

    # --- two feet, one body ------------------------------------------------------------------------------------

    def _couple(self, foot: Foot, step: FootStep) -> None:
        """Hold the feet together: once per pair of steps softly, and by the bound whenever it is passed."""
        foot.stepped = True
        coasting_s = self._config.silence.coasting_s
        for other in self._others(foot, step.time_ns):
            if other.is_ahead(step.time_ns, coasting_s):
                continue  # the step comes so late that the other foot stands where this one has yet to go
            passing = Passing(other.block, foot.block, step.displacement_m, step.heading_change_rad)
            if other.stepped:
                foot.stepped = other.stepped = False
                if not self.correct(self._same_position(passing)).accepted:
                    self._counters["feet_apart"] += 1
            if dual_foot.separation(self.filter.state, passing) > self._config.boots.separation_m:
                self.correct(self._within_bound(passing))
                self._counters["separation_bounded"] += 1

    def _same_position(self, passing: Passing) -> Measurement:
        boots = self._config.boots
        return Measurement(
            "dual_foot",
            -dual_foot.difference(self.filter.state, passing),
            dual_foot.difference_jacobian(self.filter.state, passing),
            boots.same_position_sigma_m**2 * np.eye(3),
            gate_probability=boots.gate_probability,
        )

    def _within_bound(self, passing: Passing) -> Measurement:
        boots = self._config.boots
        excess = boots.separation_m - dual_foot.separation(self.filter.state, passing)
        return Measurement(
            "separation",
            np.array([excess]),
            dual_foot.separation_jacobian(self.filter.state, passing),
            np.array([[boots.separation_sigma_m**2]]),
        )

    def _approach(self, foot: Foot, step: FootStep) -> None:
        """A foot outside the filter walks on in its own frame, until its track shows how it lies.

        As in `fusion.models.dual_foot`, the middle of its step is abreast of the other foot's stance.
        """
        beside, before = self.reference, foot.own
        foot.own = foot_step.compose(foot.own, step.displacement_m, step.heading_change_rad)
        if beside is None or not self._others(foot, step.time_ns):
            foot.joining = None
            return
        if foot.joining is None or foot.joining.is_hopeless:
            foot.joining = Joining(together=step.start_time_ns - self._began_ns < _TOGETHER_NS)
        if math.hypot(*step.displacement_m[:2]) > _MOVING_M:
            stance = _xyz(self.filter.state[beside.block.position])
            foot.joining.add(_xyz(0.5 * (before + foot.own)), stance)
            self._join(foot, beside, foot.joining)
        if foot.active:
            self._sample(foot, step.time_ns)

    def _join(self, foot: Foot, beside: Foot, joining: Joining) -> None:
        """Take a foot into the filter once it is known how its frame lies."""
        move = joining.fit(self._config)
        if move is None:
            return
        noise = relative_noise(move, foot.own)
        self.filter.join(foot.block, beside.block, move.pose(foot.own), noise, alike=joining.together)
        foot.active, foot.stepped, foot.joining = True, False, None
        self._counters["feet_joined"] += 1

    # --- the filter, corrected or moved ------------------------------------------------------------------------

    def correct(self, measurement: Measurement) -> Innovation:
        """Update the filter; recent positions of the feet move along."""
        before = self.filter.state.copy()
        innovation = self.filter.update(measurement)
        for foot in self.feet.values():
            by = self.filter.state[foot.block.position] - before[foot.block.position]
            foot.relocate(by.__add__)
        return innovation

    def move(self, transform: RigidTransform) -> None:
        """Carry everything into another frame."""
        self.filter.transform(transform)
        for foot in self.feet.values():
            foot.relocate(lambda point: transform.point(_xyz(point)))
            if foot.joining is not None:
                foot.joining.relocate(transform)

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        self._began_ns += by_ns
        for foot in self.feet.values():
            foot.shift(by_ns)

    # --- what is asked -----------------------------------------------------------------------------------------

    def alive(self, now_ns: int) -> list[Foot]:
        """The feet in the filter that speak; when all are silent, all that are in the filter."""
        active = [foot for foot in self.feet.values() if foot.active]
        coasting_s = self._config.silence.coasting_s
        return [foot for foot in active if foot.is_heard(now_ns, coasting_s)] or active

    def silent_s(self, now_ns: int) -> float | None:
        """How long no foot of the filter has been heard; None before any was."""
        heard = [foot.heard_ns for foot in self.feet.values() if foot.active and foot.heard_ns is not None]
        return max(0.0, (now_ns - max(heard)) / 1e9) if heard else None

    def stands(self, now_ns: int) -> list[body.Stand]:
        """The feet that carry the body, for its measurement model."""
        return [(foot.block, foot.offset) for foot in self.alive(now_ns)]

    def track_point(self) -> Vector3:
        """Where the walk has come to: the reference foot's position."""
        return (0.0, 0.0, 0.0) if self.reference is None else self._point(self.reference)

    def _point(self, foot: Foot) -> Vector3:
        return _xyz(body.foot_position(self.filter.state, (foot.block, foot.offset)))

    def moved_since(self, time_ns: int) -> Array | None:
        """How far the body went since then, by its feet, (3,) m; None if that is not remembered."""
        moves = [foot.moved_since(time_ns) for foot in self.alive(time_ns)]
        known = [move for move in moves if move is not None]
        if len(known) < len(moves):
            return None
        return np.mean(known, axis=0) if known else np.zeros(3)

    def velocity(self, foot: Foot) -> Vector3:
        """Mean velocity of a foot over its last stride, m/s."""
        if foot.stride is None or foot.stride.duration_s <= 0.0:
            return 0.0, 0.0, 0.0
        yaw = float(self.filter.state[foot.block.yaw]) - foot.stride.turn_rad
        east, north, up = foot_step.rotate(yaw, foot.stride.displacement_m)
        return tuple(part / foot.stride.duration_s for part in (east, north, up))  # type: ignore[return-value]

    def motion(self, now_ns: int) -> MotionClass:
        """The motion class of the foot heard last."""
        alive = [foot for foot in self.alive(now_ns) if foot.end_ns is not None]
        return max(alive, key=lambda foot: foot.end_ns or 0).motion if alive else "unknown"


def _xyz(values: Array) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])
