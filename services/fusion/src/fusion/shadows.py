"""Shadows: what the boots would say had satellites been left out since some moments of the last minutes.

Solution separation, as receivers' integrity monitors do it: beside the filter that takes every source run copies
of it that were split off at past moments and have not heard satellites since. A spoofer that drags slowly passes
every gate of the filter that it drags; it cannot drag these. They are also where to fall back to.

A new shadow is split off every `interval`. Odd ones live for two intervals, every second one for four, every fourth
for eight: so there are young ones, whose dead reckoning is sharp, and old ones, from before a slow drag began.
"""

import copy
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from bootprint.clock import NS_PER_S
from bootprint.messages import FootPose, FootStep
from fusion.boots import Boots

_LONGEST_LIFE = 8  # intervals


@dataclass(frozen=True, slots=True)
class Shadow:
    """Boots that have not heard satellites since ``born_ns``; ``number`` counts intervals."""

    boots: Boots
    born_ns: int
    number: int

    @property
    def life(self) -> int:
        """Intervals it is kept for."""
        return min(2 * (self.number & -self.number), _LONGEST_LIFE)


class Shadows:
    """The shadows of one soldier's boots, youngest last."""

    def __init__(self, interval_s: float) -> None:
        self._interval_ns = round(interval_s * NS_PER_S)
        self._alive: list[Shadow] = []
        self._scrap: Counter[str] = Counter()  # what shadows count, boots have counted
        self._number = 0

    def __iter__(self) -> Iterator[Shadow]:
        return iter(self._alive)

    def split_off(self, boots: Boots, counters: Counter[str], now_ns: int) -> None:
        """A new shadow, if one is due; those that have lived their time go."""
        if self._alive and now_ns - self._alive[-1].born_ns < self._interval_ns:
            return
        self._number += 1
        self._alive = [one for one in self._alive if self._number - one.number < one.life]
        self._alive.append(Shadow(_copy(boots, counters, self._scrap), now_ns, self._number))

    def revived(self, shadow: Shadow, counters: Counter[str]) -> Boots:
        """A shadow's boots, to go on with."""
        return _copy(shadow.boots, self._scrap, counters)

    def step(self, place: str, step: FootStep) -> None:
        """What the boots are told of steps."""
        for shadow in self._alive:
            shadow.boots.step(place, step)

    def pose(self, place: str, pose: FootPose) -> None:
        """What the boots are told of poses."""
        for shadow in self._alive:
            shadow.boots.pose(place, pose)

    def clear(self) -> None:
        """Begin anew: the boots have been told something that shadows were not."""
        self._alive.clear()
        self._number = 0


def _copy(boots: Boots, counted: Counter[str], counting: Counter[str]) -> Boots:
    """Boots of their own, that count elsewhere and write no tape."""
    memo: dict[int, object] = {id(counted): counting}
    if boots.filter.tape is not None:
        memo[id(boots.filter.tape)] = None
    return copy.deepcopy(boots, memo)
