"""How two feet hold each other, and which of them to doubt when they contradict each other (METHODS D4, A10).

Where one foot passes the other they are abreast (`fusion.models.dual_foot`): a gated update whose gain shares out
the contradiction by covariance. Beyond the largest separation they are projected onto it, whatever the gate says.

One passing refused is an odd step. Passings refused again and again mean that one foot is lost. Two tracks alone
cannot tell which; what the feet's own steps say can: their quality, and whether their lengths fit the walk. The
foot that looks worse is doubted: its variance grows, so that it follows the other; if that does not mend it, it has
to leave and join anew.
"""

from collections import Counter, deque
from collections.abc import Callable
from enum import Enum

import numpy as np

from bootprint.messages import FootStep, Vector3
from fusion.config import FeetConfig
from fusion.feet import Foot
from fusion.filter import Innovation, Measurement, StateFilter
from fusion.models import dual_foot
from fusion.models.dual_foot import Passing
from fusion.models.turned import unturned
from fusion.state import Array

_CROSSWISE = ("left", "right")  # a step to the side passes nothing
_UPRIGHT = ("walking", "running", "stairs")  # motions in which the feet walk on two lines
_WATCHED = 6  # passings
_OUTLIERS, _MOST_REFUSED = (
    1,
    3,
)  # refused among these: that many happen; beyond the other, a foot has to leave
_CLEARLY = 1.5  # times as doubtful as the other foot
_LEAST_DOUBT = 0.15  # below it a foot is as good as feet are
_DOUBTED_TURN_RAD = 0.1


class Verdict(Enum):
    """What a passing has shown."""

    NOTHING = "nothing"
    TOGETHER = "together"
    APART = "apart"
    LOST = "lost"  # ... for the last time: the doubted foot has to leave


class Coupling:
    """Measurements between two feet of one filter."""

    def __init__(
        self,
        boots: FeetConfig,
        state_filter: StateFilter,
        correct: Callable[[Measurement], Innovation],
        counters: Counter[str],
    ) -> None:
        self._boots = boots
        self._filter = state_filter
        self._correct = correct
        self._counters = counters
        self._refused: deque[bool] = deque(maxlen=_WATCHED)

    def restart(self) -> None:
        """Another pair of feet, or the same anew."""
        self._refused.clear()

    def pass_by(
        self, foot: Foot, other: Foot, step: FootStep, moved: Vector3, turn_rad: float
    ) -> tuple[Verdict, Foot | None]:
        """``foot`` has stepped past ``other``, by ``moved`` and ``turn_rad``; what that shows, and of whom."""
        passing = Passing(other.block, foot.block, moved, turn_rad)
        found: tuple[Verdict, Foot | None] = (Verdict.NOTHING, None)
        measurement = self._measurement(passing, foot, other, step)
        if measurement is not None:
            found = self._judge(foot, other, self._correct(measurement))
        if (
            self._boots.coupling != "none"
            and dual_foot.separation(self._filter.state, passing) > self._boots.separation_m
        ):
            self._correct(self._within_bound(passing))
            self._counters["separation_bounded"] += 1
        return found

    def _measurement(self, passing: Passing, foot: Foot, other: Foot, step: FootStep) -> Measurement | None:
        if self._boots.coupling == "same_position" and other.stepped:
            foot.stepped = other.stepped = False
            return self._same_position(passing)
        if self._boots.coupling == "passing" and _passes(other, step, self._boots.passing_least_m):
            return self._abreast(passing, side_of(other.place, step), step)
        return None

    def _same_position(self, passing: Passing) -> Measurement:
        state = self._filter.state
        apart, heading = dual_foot.difference(state, passing), np.zeros(state.size)
        heading[passing.stepped.yaw] = 1.0
        return Measurement(
            "dual_foot",
            -apart,
            unturned(dual_foot.difference_jacobian(state, passing), apart, heading),
            self._boots.same_position_sigma_m**2 * np.eye(3),
            gate_probability=self._boots.gate_probability,
            relative=True,
        )

    def _abreast(self, passing: Passing, side: float, step: FootStep) -> Measurement:
        """Errors of passings repeat (starts, turns, a gait), so each tells less: as `fusion.models.gnss` has it."""
        state, width = self._filter.state, self._filter.layout.width
        noise = self._abreast_noise(side, step)
        return Measurement(
            "dual_foot",
            -dual_foot.abreast(state, passing, side, width),
            dual_foot.abreast_jacobian(state, passing, side, width),
            noise * max(1.0, 2.0 * self._boots.passing_correlation),
            gate_noise=noise,
            gate_probability=self._boots.gate_probability,
            relative=True,
        )

    def _abreast_noise(self, side: float, step: FootStep) -> Array:
        ahead, aside, up = self._boots.passing_sigma_m
        aside = float(np.hypot(aside, self._boots.passing_turn_sigma_m * step.heading_change_rad))
        if side == 0.0:  # the width itself is unknown then
            aside = float(np.hypot(aside, self._boots.width_m + self._boots.width_sigma_m))
        return np.diag(np.square([ahead, aside, up]))

    def _within_bound(self, passing: Passing) -> Measurement:
        excess = self._boots.separation_m - dual_foot.separation(self._filter.state, passing)
        return Measurement(
            "separation",
            np.array([excess]),
            dual_foot.separation_jacobian(self._filter.state, passing),
            np.array([[self._boots.separation_sigma_m**2]]),
            relative=True,
        )

    def _judge(self, foot: Foot, other: Foot, innovation: Innovation) -> tuple[Verdict, Foot | None]:
        self._refused.append(not innovation.accepted)
        if innovation.accepted:
            return Verdict.TOGETHER, None
        self._counters["feet_apart"] += 1
        if sum(self._refused) <= _OUTLIERS:
            return Verdict.APART, None
        doubted = doubtful(foot, other)
        for one in (foot, other) if doubted is None else (doubted,):
            self._filter.widen(one.block, float(np.mean(innovation.residual**2)), _DOUBTED_TURN_RAD**2)
        if doubted is not None and sum(self._refused) > _MOST_REFUSED:
            self.restart()
            return Verdict.LOST, doubted
        return Verdict.APART, doubted


def doubtful(one: Foot, other: Foot) -> Foot | None:
    """Which of two feet that contradict each other looks wrong by itself; None if neither clearly does."""
    lengths = [stride.length_m for foot in (one, other) for stride in foot.recent]
    if not lengths:
        return None
    usual_m = max(float(np.median(lengths)), 0.3)
    doubts = {foot.place: doubt(foot, usual_m) for foot in (one, other)}
    worse, better = (one, other) if doubts[one.place] >= doubts[other.place] else (other, one)
    is_clear = doubts[worse.place] > _CLEARLY * max(doubts[better.place], _LEAST_DOUBT)
    return worse if is_clear else None


def doubt(foot: Foot, usual_m: float) -> float:
    """How little a foot's recent steps are like good steps of a walk with steps of ``usual_m``; 0 is best."""
    marks = [
        min(2.0, abs(stride.length_m - usual_m) / usual_m) + 1.0 - stride.quality for stride in foot.recent
    ]
    return float(np.mean(marks)) if marks else 0.0


def _passes(other: Foot, step: FootStep, least_m: float) -> bool:
    """Whether in this step the foot went past the other one, which stood."""
    ended_ns = other.end_ns
    stood = ended_ns is not None and step.start_time_ns <= ended_ns <= step.time_ns
    far_enough = float(np.hypot(*step.displacement_m[:2])) > least_m
    return stood and far_enough and step.direction not in _CROSSWISE


def side_of(standing: str, step: FootStep) -> float:
    """On which side of the step the standing foot is: +1 left, −1 right, 0 unknown.

    Long steps whose direction is not known lead forward: nearly all do.
    """
    if step.motion not in _UPRIGHT:
        return 0.0
    side = {"left": 1.0, "right": -1.0}.get(standing.partition("_")[0], 0.0)
    return -side if step.direction == "backward" else side
