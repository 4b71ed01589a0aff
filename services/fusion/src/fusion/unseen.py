"""Time in which a foot went unseen (lost steps, restarts, silence): what it may have done is owned up to.

Where the other foot told of that time, this one alone is unsure. Where nobody saw the body walk or turn, what it
may have done is common to its feet, and counts once.
"""

from collections.abc import Collection

import numpy as np

from bootprint.messages import FootStep
from fusion.config import FusionConfig
from fusion.feet import Foot
from fusion.filter import StateFilter

_TURNED_ALONE_RAD = 0.1  # of a foot against the other, while neither is seen


class Unseen:
    """Owns up to gaps of feet in the filter."""

    def __init__(self, state_filter: StateFilter, config: FusionConfig) -> None:
        self._filter = state_filter
        self._silence = config.silence
        self._apart_m = config.boots.join_sigma_m
        self._dark_until_ns = 0  # up to here what no foot has seen is owned up to

    def own_up(
        self,
        foot: Foot,
        feet: Collection[Foot],
        step: FootStep,
        untracked_s: float,
        carried_ns: int | None = None,
    ) -> None:
        """A foot has made a step after so long unseen; ``carried_ns``: until when others told of its way."""
        moved_m2 = (self._silence.drift_m_s * foot.uncarried_s(untracked_s, carried_ns)) ** 2
        turned_rad2 = self._silence.turn_rad_sqrt_s**2 * untracked_s
        if not self._was_dark(foot, feet, step):
            self._filter.widen(foot.block, moved_m2, turned_rad2)
            return
        if foot.end_ns is None or foot.end_ns >= self._dark_until_ns:
            self._filter.widen_together(moved_m2 * np.eye(3))
            self._filter.widen_turned([other.block for other in feet if other.carries], turned_rad2)
            self._dark_until_ns = step.start_time_ns
        self._filter.widen(foot.block, self._apart_m**2, _TURNED_ALONE_RAD**2)

    def _was_dark(self, foot: Foot, feet: Collection[Foot], step: FootStep) -> bool:
        """Whether no other foot has told of the time that this one went unseen."""
        others = [other for other in feet if other is not foot and other.carries]
        if any(other.end_ns is not None and other.end_ns > step.start_time_ns for other in others):
            return foot.end_ns is not None and foot.end_ns < self._dark_until_ns
        return len(others) > 0

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._dark_until_ns += by_ns
