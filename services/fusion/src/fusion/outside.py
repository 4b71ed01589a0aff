"""A foot outside the filter: it walks on in its own frame, until its track shows how that lies beside the other."""

import math
from collections import Counter

from bootprint.messages import FootStep, Vector3
from fusion.config import FusionConfig
from fusion.coupling import side_of
from fusion.feet import MOVING_M, Foot
from fusion.filter import StateFilter
from fusion.joining import Joining, relative_noise
from fusion.models import dual_foot, foot_step
from fusion.state import Array, xyz


class Outside:
    """Takes feet into the filter once it is known where they are."""

    def __init__(self, state_filter: StateFilter, config: FusionConfig, counters: Counter[str]) -> None:
        self._filter = state_filter
        self._config = config
        self._counters = counters

    def step(self, foot: Foot, step: FootStep, beside: Foot | None, *, together: bool) -> None:
        """The foot walks on past the one ``beside``, if there is one to be joined; ``together``: see `Joining`."""
        before = foot.own
        foot.own = foot_step.compose(foot.own, step.displacement_m, step.heading_change_rad)
        if beside is None:
            foot.joining = None
            return
        if foot.joining is None or foot.joining.is_hopeless:
            foot.joining = Joining(together=together)
        if math.hypot(*step.displacement_m[:2]) > MOVING_M:
            self._lay_beside(foot.joining, beside, step, before)
            self._join(foot, beside, foot.joining)

    def mark(self, foot: Foot, time_ns: int) -> None:
        """Where the foot is in its own frame, for a smoother."""
        if self._filter.tape is not None:
            point = foot_step.compose(foot.own, foot.offset, 0.0)[:3]
            self._filter.tape.mark(time_ns, foot.block, foot.offset, point, foot.own, inside=False)

    def _lay_beside(self, joining: Joining, beside: Foot, step: FootStep, before: Array) -> None:
        """One more stance of the foot beside, as it is and as a step from the pose ``before`` passed it."""
        aside_m = side_of(beside.place, step) * float(self._filter.state[self._filter.layout.width])
        point = dual_foot.beside(before, step.displacement_m, step.heading_change_rad, aside_m)
        joining.add(point, self._passed(beside, step))

    def _passed(self, beside: Foot, step: FootStep) -> Vector3:
        """Where the foot beside stands; who does not stride, a camera, was there in the middle of the step."""
        if beside.block in self._filter.layout.blocks:
            return xyz(self._filter.state[beside.block.position])
        return xyz(beside.trail.at((step.start_time_ns + step.time_ns) // 2))

    def _join(self, foot: Foot, beside: Foot, joining: Joining) -> None:
        move = joining.fit(self._config)
        if move is None:
            return
        noise = relative_noise(move, foot.own)
        self._filter.join(foot.block, beside.block, move.pose(foot.own), noise, alike=joining.together)
        foot.active, foot.stepped, foot.refused, foot.joining = True, False, False, None
        self._counters["feet_joined"] += 1
