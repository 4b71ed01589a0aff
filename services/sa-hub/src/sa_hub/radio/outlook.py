"""The time until the next report: where soldiers will be meanwhile, and the place that is best told of them now.

What telling is worth shows only then: who has just set out is not yet wrong anywhere, and who is told where he is
will soon be elsewhere. So errors are looked at over the time until the next report; and who goes on at a velocity
that is not told is told at the place that is nearest to all those where he will be: ahead of him.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from bootprint.prediction import reaches_s
from sa_hub.radio.ground import FloatArray
from sa_hub.radio.wares import Candidates

_MOMENTS: Final = np.array([1.0, 3.0, 5.0]) / 6.0
"""Of the time ahead: the middles of its thirds."""


@dataclass(frozen=True)
class Outlook:
    """Of n soldiers over ``ahead_s``; ``told`` (n, 2) m/s: the velocity that receivers would be told."""

    who: Candidates
    told: FloatArray
    ahead_s: float

    @cached_property
    def moments(self) -> Sequence[tuple[FloatArray, float]]:
        """At each moment: (n, 2) m that they will have gone, and the seconds by which velocities told reach."""
        seconds = self.ahead_s * _MOMENTS
        reaches = reaches_s(seconds)
        return [(self.who.way_m(s), float(reach)) for s, reach in zip(seconds.tolist(), reaches, strict=True)]

    @cached_property
    def aims_m(self) -> FloatArray:
        """(n, 2) from where they are now to the place to tell."""
        aims: FloatArray = np.mean([way - self.told * reach_s for way, reach_s in self.moments], axis=0)
        return aims

    def left_m(self) -> Sequence[FloatArray]:
        """At each moment (n, 2): how far off receivers would show them that were told now."""
        return [way - self.told * reach_s - self.aims_m for way, reach_s in self.moments]
