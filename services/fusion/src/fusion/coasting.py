"""Coasting: what a soldier may have walked while nobody told of it grows the covariance, each silence once."""

import numpy as np

from fusion.boots import Boots
from fusion.config import SilenceConfig


class Coasting:
    """Remembers how much of the present silence the state has owned up to."""

    def __init__(self, silence: SilenceConfig) -> None:
        self._silence = silence
        self._owned_m2 = 0.0

    def over(self) -> None:
        """Somebody tells of the walk again."""
        self._owned_m2 = 0.0

    def pending_m2(self, silent_s: float | None) -> float:
        """Variance on each axis that the state does not hold yet, m²."""
        if silent_s is None or silent_s <= self._silence.coasting_s:
            return 0.0
        return max(0.0, (self._silence.drift_m_s * silent_s) ** 2 - self._owned_m2)

    def own_up(self, boots: Boots, now_ns: int) -> None:
        """Put it into the state, before a satellite fix is compared with that."""
        pending_m2 = self.pending_m2(boots.silent_s(now_ns))
        if pending_m2 > 0.0:
            boots.filter.widen_together(pending_m2 * np.eye(3))
            self._owned_m2 += pending_m2
