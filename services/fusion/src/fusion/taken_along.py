"""Feet that do not speak are taken along by the camera that does: none of them is left where it fell silent.

Each of the camera's steps moves and turns them by as much as itself, with the same error. What has been told so of
a foot is taken back if the foot tells it, late, itself. A late step begins where, and facing as, the foot was then:
so all that came after its beginning is taken back before it is composed, and what came after its end put on again.
"""

from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.messages import FootStep
from fusion.boots import Boots
from fusion.feet import Foot
from fusion.state import Array

_REMEMBERED_NS: Final = 60 * NS_PER_S


class TakenAlong:
    """Moves (4,) by time of feet that were silent, each until it has told that time itself."""

    def __init__(self) -> None:
        self._moves: dict[str, list[tuple[int, Array]]] = {}
        self._leads = False

    def step(self, boots: Boots, leader: Foot, step: FootStep, noise: Array) -> None:
        """The leader steps, ``noise`` (4, 4), and with it all feet while none speaks."""
        silent = [foot for foot in boots.feet.values() if foot.active]
        if not silent or boots.heard_feet(step.time_ns):
            self._leads = False
            boots.filter.lead(leader.block, step, noise, ())
            return
        blocks = [foot.block for foot in silent]
        if self._leads:
            moved = boots.filter.lead(leader.block, step, noise, blocks)
        else:  # it has just been noticed that they are silent: the leader's track tells the time before
            self._leads = True
            boots.filter.lead(leader.block, step, noise, ())
            moved = _since(leader, boots.feet_heard_ns)
            boots.filter.displace(blocks, moved, leader.block)
        boots.carried_ns = max(boots.carried_ns or step.time_ns, step.time_ns)
        for foot in silent:
            foot.trail.carry(moved[:3])
            self._remember(foot.place, step.time_ns, moved)

    def _remember(self, place: str, time_ns: int, moved: Array) -> None:
        moves = self._moves.setdefault(place, [])
        moves.append((time_ns, moved))
        while time_ns - moves[0][0] > _REMEMBERED_NS:
            del moves[0]

    def take_back(self, boots: Boots, foot: Foot, step: FootStep) -> Array:
        """A foot is about to tell, late, of a time in which it was taken along: its own word counts, not both.

        What is to be put on (4,) when the step has been composed: the moves after its end.
        """
        if not foot.active:
            self._moves.pop(foot.place, None)  # it has left the filter, and joins it anew
        moves = self._moves.get(foot.place, [])
        if step.realigned or not any(at_ns > step.start_time_ns for at_ns, _ in moves):
            return np.zeros(4)
        later = [(at_ns, moved) for at_ns, moved in moves if at_ns > step.time_ns]
        undone = [moved for at_ns, moved in moves if at_ns > step.start_time_ns]
        self._moves[foot.place] = later
        _put(boots, foot, -np.sum(undone, axis=0))
        return np.asarray(sum((moved for _, moved in later), np.zeros(4)))

    @staticmethod
    def put_on(boots: Boots, foot: Foot, moved: Array) -> None:
        """The late step has been composed: what the foot has been taken along since."""
        if foot.active and moved.any():
            _put(boots, foot, moved)

    def turn(self, by_rad: float) -> None:
        """The frame has turned."""
        turned = np.eye(4)
        turned[:2, :2] = [[np.cos(by_rad), -np.sin(by_rad)], [np.sin(by_rad), np.cos(by_rad)]]
        self._moves = {
            place: [(at_ns, turned @ moved) for at_ns, moved in moves] for place, moves in self._moves.items()
        }

    def clear(self) -> None:
        """What was told counts for good."""
        self._moves.clear()
        self._leads = False


def _put(boots: Boots, foot: Foot, by: Array) -> None:
    leader = boots.stand_in or foot
    boots.filter.displace([foot.block], by, leader.block)
    foot.trail.carry(by[:3])


def _since(leader: Foot, heard_ns: int | None) -> Array:
    """How far the leader went since then, as a move (4,)."""
    moved = None if heard_ns is None else leader.trail.moved_since(heard_ns)
    return np.zeros(4) if moved is None else np.append(moved, 0.0)
