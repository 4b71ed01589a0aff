"""Both feet through one filter: steps composed, gaps owned up to, feet holding each other (METHODS D4).

The first foot that steps begins the boots frame. Another foot's heading against it is unknown (each sensor sits on
its boot as it likes), so it *joins* (`fusion.joining`): when both have walked a few metres their tracks show it.
A foot that was unseen for long joins again.

Who stands in for the feet, a camera, moves itself (`fusion.camera`). It carries the body while no foot speaks; feet
that come back after that have been left behind, and join it as they join each other.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from bootprint.messages import FootPose, FootStep, Vector3
from fusion.company import Company
from fusion.config import FusionConfig
from fusion.coupling import Coupling, Verdict
from fusion.feet import MOVING_M, Entry, Foot
from fusion.filter import Innovation, Measurement, StateFilter
from fusion.models import body, compass
from fusion.models.shared_errors import StepError, prior
from fusion.outside import Outside
from fusion.state import Array, Layout, xyz
from fusion.step_errors import StepErrors
from fusion.transform import RigidTransform
from fusion.unseen import Unseen

_SHORTEST_S, _LONGEST_S = 0.25, 60.0  # of a step, for what speed says of its length
_LONGEST_SWING_S = 10.0  # no stance in that time: where the foot is is anybody's guess
_TOGETHER_NS = 2_000_000_000  # feet whose first steps are this near set off together


class Boots(Company):
    """The feet of one soldier."""

    def __init__(self, config: FusionConfig, counters: Counter[str]) -> None:
        layout = Layout.of(config.feet)
        self.filter = StateFilter(layout, prior(layout, config.boots))
        super().__init__({block.place: Foot(block) for block in layout.blocks}, config.silence)
        self.in_enu = False  # or still in the boots frame
        self._began_ns = 0
        self._config = config
        self._counters = counters
        self._errors = StepErrors(config.boots, counters)
        self._unseen = Unseen(self.filter, config)
        self._outside = Outside(self.filter, config, counters)
        self.coupling = Coupling(config.boots, self.filter, self.correct, counters)

    @property
    def began_ns(self) -> int:
        """When the first foot set off."""
        return self._began_ns

    def go_on(self, state: Array, covariance: Array, reference: str, began_ns: int) -> None:
        """Go on from a saved state; the feet have been told theirs."""
        self.filter.state, self.filter.covariance = state, covariance
        self.reference, self._began_ns, self.in_enu = self.feet[reference], began_ns, True
        for foot in self.feet.values():
            if foot.active and foot.end_ns is not None:
                self.sample(foot, foot.end_ns)

    # --- what comes in -----------------------------------------------------------------------------------------

    def step(self, place: str, step: FootStep) -> Foot | None:
        """Take a step into account; the foot if the step moved it within the filter."""
        foot = self.feet[place]
        newer = foot.end_ns is None or step.time_ns > foot.end_ns
        entry = foot.ledger.enter(step.sequence, newer)
        if entry is None:
            self._counters["duplicate_steps"] += 1
            return None
        if self.reference is None:
            self.begin(foot, step.start_time_ns)
        self._own_up(foot, step, self._filled(foot, step, entry))
        moved = self._compose(foot, step, newer)
        foot.end_ns = step.time_ns if newer else foot.end_ns
        foot.hear(step.time_ns)
        return foot if moved and foot.active else None

    def has_had(self, place: str, step: FootStep) -> bool:
        """Whether this very step has been taken into account."""
        foot = self.feet[place]
        return foot.end_ns is not None and step.time_ns <= foot.end_ns and foot.ledger.has(step.sequence)

    def pose(self, place: str, pose: FootPose) -> None:
        """Take where a foot is between two steps."""
        foot = self.feet[place]
        if math.hypot(*pose.displacement_m) > self._config.boots.max_speed_m_s * _LONGEST_SWING_S:
            self._counters["implausible_poses"] += 1
        elif self._was_left_behind(foot, pose.time_ns):
            self._counters["poses_after_silence"] += 1
        elif not foot.note_pose(pose):
            self._counters["poses_without_step"] += 1
        elif not foot.active:
            self._outside.mark(foot, pose.time_ns)
        elif self._is_out_of_reach(foot, pose.time_ns):
            foot.refused, foot.strayed = True, True
            self._counters["poses_out_of_reach"] += 1
        else:
            self.sample(foot, pose.time_ns)

    def _is_out_of_reach(self, foot: Foot, now_ns: int) -> bool:
        """Whether a foot has gone further from its stance, and from the other foot, than legs reach.

        So it is with a sensor that is stuck or has failed: no stance comes, and its poses fly off.
        """
        reach_m = self._config.boots.reach_m
        if math.hypot(*foot.offset[:2]) <= reach_m:
            return False
        here = body.foot_position(self.filter.state, (foot.block, foot.offset))
        return any(
            math.dist(here[:2], other.trail.at(now_ns)[:2]) > reach_m for other in self.others(foot, now_ns)
        )

    def _was_left_behind(self, foot: Foot, now_ns: int) -> bool:
        """Whether others walked on while this foot was silent: only its next step tells what it has missed.

        Its poses go on from where it was then. They would pull the body back there.
        """
        return not foot.is_heard(now_ns, self._config.silence.coasting_s) and bool(self.company(foot, now_ns))

    def adopt(self, time_ns: int) -> None:
        """Begin without a step: a soldier whose boots are silent is carried by others from here on."""
        foot = next(iter(self.feet.values()))
        foot.end_ns = time_ns
        self.begin(foot, time_ns)

    def begin(self, foot: Foot, time_ns: int) -> None:
        """This one begins the frame, where it is: its track stands for the walk."""
        foot.active, self.reference, self._began_ns = True, foot, time_ns
        self.sample(foot, time_ns)

    def _filled(self, foot: Foot, step: FootStep, entry: Entry) -> Entry:
        """What is still unseen once a single lost step has been made good by the poses that told its way."""
        substitute = foot.substitute(step) if entry.lost == 1 else None
        if substitute is None or not self._compose(foot, substitute, newer=True):
            return entry
        foot.end_ns = substitute.time_ns
        foot.ledger.missing.discard(substitute.sequence)
        self._counters["lost_steps"] += 1
        self._counters["steps_made_good"] += 1
        return Entry()

    def _own_up(self, foot: Foot, step: FootStep, entry: Entry) -> None:
        """Widen the covariance by what happened to this foot unseen; drop it if the other one saw more."""
        silence = self._config.silence
        untracked_s = foot.untracked_s(step, entry.unseen)
        self._counters["lost_steps"] += entry.lost
        self._counters["foot_restarts"] += entry.anew
        forgiven_s = (
            silence.coasting_s if step.realigned else silence.rejoin_s
        )  # a broken step tells no way at all
        dark = foot.lay_dark(step, untracked_s)
        others = self.others(foot, step.time_ns)
        witnessed = dark is None or any(other.saw(dark) for other in others)
        if others and (foot.strayed or (witnessed and untracked_s > forgiven_s)):
            self._drop(foot)
        elif untracked_s > silence.coasting_s and not others and self.company(foot, step.time_ns):
            self._leave_behind(foot, step.time_ns)
        elif foot.active and dark is not None:
            feet = [foot] if witnessed else [one for one in self.feet.values() if one.carries]
            self._unseen.own_up(foot, feet, dark, untracked_s, self.carried_ns)

    def _drop(self, foot: Foot) -> None:
        foot.active, foot.strayed, foot.joining, foot.own = False, False, None, np.zeros(4)
        foot.trail.clear()
        self.coupling.restart()
        if self.reference is foot:
            self.reference = next((other for other in self.feet.values() if other.carries), self.stand_in)
        self._counters["feet_dropped"] += 1

    def _leave_behind(self, foot: Foot, now_ns: int) -> None:
        """The stand-in has carried the body on from where the silent feet were: they join it, one by one."""
        for one in self.feet.values():
            if one is foot or (one.active and not one.is_heard(now_ns, self._config.silence.coasting_s)):
                self._drop(one)

    def _compose(self, foot: Foot, step: FootStep, newer: bool) -> bool:
        duration_s = (step.time_ns - step.start_time_ns) / 1e9
        plausible_s = min(max(duration_s, _SHORTEST_S), _LONGEST_S)
        if math.hypot(*step.displacement_m) > self._config.boots.max_speed_m_s * plausible_s:
            self._counters["implausible_steps"] += 1
            if foot.active:
                self.filter.widen(
                    foot.block, (self._config.silence.drift_m_s * max(plausible_s, 0.5)) ** 2, 0.0
                )
            return False
        error = self._errors.of(step)
        if newer:
            foot.note_step(step, math.sqrt(error.own[1, 1]))
        if foot.active:
            self._move(foot, step, error)
        else:
            self._approach(foot, step)
            foot.joining = foot.joining if newer else None  # in order, these steps make another track
        return True

    def _move(self, foot: Foot, step: FootStep, error: StepError) -> None:
        moved, turn_rad = step.displacement_m, step.heading_change_rad
        if error.shares is not None:
            moved, turn_rad = error.shares.corrected(step, self.filter.state[foot.block.common])
        self.filter.propagate(foot.block, step, error.own, error.shares, self._errors.kept(step))
        if self.in_enu:
            compass.look(self.filter, foot, step, self._config.boots.gate_probability, self.correct)
        self.sample(foot, step.time_ns)
        if math.hypot(*step.displacement_m[:2]) > MOVING_M:
            self._couple(foot, step, moved, turn_rad)

    def sample(self, foot: Foot, time_ns: int, joined: bool = False) -> None:
        """Remember where a foot is at that time."""
        point = body.foot_position(self.filter.state, (foot.block, foot.offset))
        if self.filter.tape is not None:
            self.filter.tape.mark(time_ns, foot.block, foot.offset, point, foot.own if joined else None)
        foot.trail.put(time_ns, point)

    # --- two feet, one body ------------------------------------------------------------------------------------

    def _couple(self, foot: Foot, step: FootStep, moved: Vector3, turn_rad: float) -> None:
        """Hold the feet together as one passes the other; a foot that is lost has to leave."""
        if self.carried_ns is not None and step.time_ns <= self.carried_ns:
            return  # it comes late: others have told of that time, and the other foot is elsewhere by now
        foot.stepped = True
        coasting_s = self._config.silence.coasting_s
        for other in self.others(foot, step.time_ns):
            if other.is_ahead(step.time_ns, coasting_s):
                continue  # the step comes so late that the other foot stands where this one has yet to go
            poor = next(
                (one for one, good in ((foot, other), (other, foot)) if one.is_poor_beside(good)), None
            )
            if poor is not None:
                self._refuse(poor)
                return
            verdict, doubted = self.coupling.pass_by(foot, other, step, moved, turn_rad)
            if verdict is Verdict.LOST and doubted is not None:
                self._refuse(doubted)
                return

    def _refuse(self, foot: Foot) -> None:
        """A foot has to leave, and not because it was silent."""
        self._drop(foot)
        foot.refused = True
        self._counters["feet_diverged"] += 1

    def _approach(self, foot: Foot, step: FootStep) -> None:
        """A foot outside the filter walks on, and perhaps joins the one whose track counts."""
        beside = self.reference
        if beside is None or not self.company(foot, step.time_ns) or foot.is_poor_beside(beside):
            beside = None
        together = step.start_time_ns - self._began_ns < _TOGETHER_NS
        self._outside.step(foot, step, beside, together=together)
        if foot.active:
            self.reference = foot if self.reference is self.stand_in else self.reference
            self.sample(foot, step.time_ns, joined=True)
        else:
            self._outside.mark(foot, step.time_ns)

    # --- the filter, corrected or moved ------------------------------------------------------------------------

    def correct(self, measurement: Measurement) -> Innovation:
        """Update the filter; recent positions of the feet move along."""
        before = self.filter.state.copy()
        innovation = self.filter.update(measurement)
        for foot in self.everybody():
            by = self.filter.state[foot.block.position] - before[foot.block.position]
            foot.trail.carry(by)
        return innovation

    def beyond_tangent(
        self, stands: Sequence[body.Stand], sigma_m: float, surest_rad: float = math.inf
    ) -> Array | None:
        """Where a doubtful heading may have led the body beside its tangent, (3, 3) m²: `Measurement.carries`.

        None if that is less than who tells the place now errs, and the heading no more doubtful than
        ``surest_rad``: then the tangent will do.
        """
        state, covariance = self.filter.state, self.filter.covariance
        beside = body.unseen_by_tangent(state, covariance, stands)
        will_do = math.sqrt(float(np.trace(beside))) <= sigma_m
        return None if will_do and body.heading_sigma_rad(state, covariance, stands) <= surest_rad else beside

    def carry(self, by_m: Array, covariance: Array, until_ns: int | None = None) -> None:
        """The whole body has moved (3,) m without a step of these feet, give or take ``covariance`` (3, 3).

        ``until_ns``: up to then nothing else has happened to it.
        """
        self.filter.carry(by_m, covariance)
        if until_ns is not None:
            self.carried_ns = max(self.carried_ns or until_ns, until_ns)
        for foot in self.everybody():
            foot.trail.carry(by_m)

    def move(self, transform: RigidTransform) -> None:
        """Carry everything into another frame."""
        sighted = self.reference if transform.sighted is not None else None
        self.filter.transform(transform, None if sighted is None else sighted.block)
        self.in_enu = True
        for foot in self.everybody():
            foot.trail.transform(transform)
            if foot.joining is not None:
                foot.joining.relocate(transform)

    def shift(self, by_ns: int) -> None:
        """The clock has been set: what was remembered by the old one."""
        self._began_ns += by_ns
        self.carried_ns = None
        self._unseen.shift(by_ns)
        for foot in self.everybody():
            foot.shift(by_ns)

    # --- what is asked -----------------------------------------------------------------------------------------

    def stands(self, now_ns: int) -> list[body.Stand]:
        """The feet that carry the body, for its measurement model."""
        return [(foot.block, foot.offset) for foot in self.alive(now_ns)]

    def place_at(self, now_ns: int, alive: Sequence[Foot]) -> Array:
        """Where the body was then, over the mean of these, (3,) m; the origin if there are none."""
        if not alive:
            return np.zeros(3)
        return sum((foot.trail.at(now_ns) for foot in alive), np.zeros(3)) / len(alive) + self.ahead(
            alive, now_ns
        )

    def spread_of(self, alive: Sequence[Foot]) -> Array:
        """Covariance (3, 3) of the body's position over these, in the filter's frame, m²."""
        stands = [(foot.block, foot.offset) for foot in alive]
        spread = body.position_covariance(self.filter.state, self.filter.covariance, stands)
        return spread + self._config.boots.pose_sigma_m**2 * np.eye(3)

    def track_point(self) -> Vector3:
        """Where the walk has come to: the reference foot's position."""
        foot = self.reference
        if foot is None:
            return 0.0, 0.0, 0.0
        return xyz(body.foot_position(self.filter.state, (foot.block, foot.offset)))

    def moved_since(self, time_ns: int) -> Array | None:
        """How far the body went since then, by its feet, (3,) m; None if that is not remembered."""
        moves = [foot.trail.moved_since(time_ns) for foot in self.alive(time_ns)]
        known = [move for move in moves if move is not None]
        if len(known) < len(moves):
            return None
        return np.mean(known, axis=0) if known else np.zeros(3)
