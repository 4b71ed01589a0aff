"""Feet that do not speak are taken along by the camera that does: none of them is left where it fell silent.

Each of the camera's steps moves and turns them by as much as itself, with the same error. What has been told so of
a foot is taken back if the foot tells it, late, itself.
"""

import numpy as np

from bootprint.messages import FootStep
from fusion.boots import Boots
from fusion.feet import Foot
from fusion.state import Array


class TakenAlong:
    """Moves (4,) of silent feet by time, since a foot last spoke."""

    def __init__(self) -> None:
        self._moves: list[tuple[int, Array]] = []

    def step(self, boots: Boots, leader: Foot, step: FootStep, noise: Array) -> None:
        """The leader steps, ``noise`` (4, 4), and with it all feet while none speaks."""
        silent = [foot for foot in boots.feet.values() if foot.active]
        if not silent or boots.heard_feet(step.time_ns):
            self._moves.clear()
            boots.filter.lead(leader.block, step, noise, ())
            return
        blocks = [foot.block for foot in silent]
        if self._moves:
            moved = boots.filter.lead(leader.block, step, noise, blocks)
        else:  # it has just been noticed that they are silent: the leader's track tells the time before
            boots.filter.lead(leader.block, step, noise, ())
            moved = _since(leader, boots.feet_heard_ns)
            boots.filter.displace(blocks, moved)
        self._moves.append((step.time_ns, moved))
        boots.carried_ns = max(boots.carried_ns or step.time_ns, step.time_ns)
        for foot in silent:
            foot.relocate(moved[:3].__add__)

    def take_back(self, boots: Boots, foot: Foot, step: FootStep) -> None:
        """A foot tells of a time in which it was taken along: its own word counts, not both."""
        told = [moved for time_ns, moved in self._moves if step.start_time_ns < time_ns <= step.time_ns]
        if told and foot.active and not step.realigned:
            back = -np.sum(told, axis=0)
            boots.filter.displace([foot.block], back)
            foot.relocate(back[:3].__add__)

    def clear(self) -> None:
        """What was told counts for good."""
        self._moves.clear()


def _since(leader: Foot, heard_ns: int | None) -> Array:
    """How far the leader went since then, as a move (4,)."""
    moved = None if heard_ns is None else leader.moved_since(heard_ns)
    return np.zeros(4) if moved is None else np.append(moved, 0.0)
