"""The time until the next report: where soldiers will be meanwhile, and the place that is best told of them now.

What telling is worth shows only then: who has just set out is not yet wrong anywhere, and who is told where he is
will soon be elsewhere. So errors are looked at over the time until the next report; and who goes on at a velocity
that is not told is told at the place that is nearest to all those where he will be: ahead of him.
"""

from dataclasses import dataclass
from functools import cached_property

from bootprint.prediction import reaches_s
from sa_hub.radio.ground import FloatArray
from sa_hub.radio.persistence import MOMENTS
from sa_hub.radio.wares import Candidates


@dataclass(frozen=True)
class Outlook:
    """Of n soldiers over ``ahead_s``; ``told`` (n, 2) m/s: the velocity that receivers would be told."""

    who: Candidates
    told: FloatArray
    ahead_s: float

    @cached_property
    def ways_m(self) -> FloatArray:
        """(moments, n, 2) that they will have gone at each moment."""
        return self.who.way_m(self.ahead_s * MOMENTS)

    @cached_property
    def reaches_s(self) -> FloatArray:
        """(moments, 1, 1) by which velocities told reach."""
        return reaches_s(self.ahead_s * MOMENTS)[:, None, None]

    @cached_property
    def _beyond_m(self) -> FloatArray:
        """(moments, n, 2) by which they will be farther than who was told their velocity believes."""
        return self.ways_m - self.told * self.reaches_s

    @cached_property
    def aims_m(self) -> FloatArray:
        """(n, 2) from where they are now to the place to tell."""
        aims: FloatArray = self._beyond_m.mean(axis=0)
        return aims

    def left_m(self) -> FloatArray:
        """(moments, n, 2): how far off receivers would show them that were told now."""
        return self._beyond_m - self.aims_m
