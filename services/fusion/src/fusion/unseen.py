"""Time in which a foot went unseen (lost steps, restarts, silence): what it may have done is owned up to.

Where the other foot told of that time, this one alone is unsure. Where nobody saw the body walk or turn, what it
may have done is common to its feet, and counts once.
"""

from collections.abc import Sequence

import numpy as np

from fusion.config import FusionConfig
from fusion.feet import Foot, Span
from fusion.filter import StateFilter

_TURNED_ALONE_RAD = 0.1  # of a foot against the other, while neither is seen


class Unseen:
    """Owns up to gaps of feet in the filter."""

    def __init__(self, state_filter: StateFilter, config: FusionConfig) -> None:
        self._filter = state_filter
        self._silence = config.silence
        self._apart_m = config.boots.join_sigma_m
        self._owned_until_ns = 0  # what no foot has seen up to here is owned up to

    def own_up(
        self, foot: Foot, feet: Sequence[Foot], dark: Span, untracked_s: float, carried_ns: int | None
    ) -> None:
        """A foot has made a step after so long unseen; of all ``feet`` nobody saw the time ``dark`` it lies in.

        ``carried_ns``: until when others told of its way.
        """
        moved_m2 = (self._silence.drift_m_s * foot.uncarried_s(untracked_s, carried_ns)) ** 2
        turned_rad2 = self._silence.turn_rad_sqrt_s**2 * untracked_s
        if len(feet) < 2:
            self._filter.widen(foot.block, moved_m2, turned_rad2)
            return
        if dark[0] >= self._owned_until_ns or not self._others_saw_the_rest(foot, feet, dark):
            self._filter.widen_together(moved_m2 * np.eye(3))
            self._filter.widen_turned([one.block for one in feet], turned_rad2)
            self._owned_until_ns = dark[1]
        self._filter.widen(foot.block, self._apart_m**2, _TURNED_ALONE_RAD**2)

    def _others_saw_the_rest(self, foot: Foot, feet: Sequence[Foot], dark: Span) -> bool:
        """Whether somebody saw what of ``dark`` is not owned up to yet."""
        rest = max(dark[0], self._owned_until_ns), dark[1]
        return rest[0] >= rest[1] or any(one.saw(rest) for one in feet if one is not foot)

    def shift(self, by_ns: int) -> None:
        """The clock has been set."""
        self._owned_until_ns += by_ns
