"""What a bit is worth now: a price that follows how full the bucket is.

A report is sent when its worth exceeds its bits times the price. The price rises exponentially as the bucket
empties, so bursts of motion are served at once but never drain it. Its level is the one that budget, number of
soldiers and people's usual motion make likely, and follows slowly what the squad's own motion makes of it: from 75
bit/s to a megabit, for one soldier or five hundred.
"""

import math
from typing import Final

from sa_hub.radio.room import Room
from sa_hub.radio.worth import CURVE

GAIN: Final = 4.0
"""e-folds of the price between a full and an empty bucket."""
SETTLING_S: Final = 60.0
"""Time in which the level moves by one e-fold for half a bucket's difference, and an empty bucket is to become half
full."""
CHEAPEST: Final = -6.0
DEAREST: Final = 4.0
WALKERS: Final = 0.5
"""Usual motion: this share of people walk away from where they are believed to be, so fast; the others stand."""
UNFORESEEN_M_S: Final = 1.2


def usual_level(room: Room, soldiers: int, enough_m: float) -> float:
    """The logarithm of the price at which so many soldiers of usual motion spend just the budget.

    All of them are told in one frame when their errors, grown since the last one, are worth its bits.
    """
    interval_s = room.interval_s(soldiers)
    error_m = UNFORESEEN_M_S * interval_s - enough_m
    if soldiers == 0 or error_m <= 0.0:
        return CHEAPEST
    return math.log(WALKERS * soldiers * error_m**CURVE / (interval_s * room.rate_bits_per_s))


class Pacing:
    """The price of a bit, in worth per bit."""

    def __init__(self) -> None:
        self._usual = CHEAPEST
        self._learnt = 0.0
        self._short = 0.0
        self._wanted = 0.0

    @property
    def price(self) -> float:
        """Worth that a bit must buy."""
        level = self._level + GAIN * self._short
        return math.exp(min(max(level, CHEAPEST), DEAREST))

    @property
    def _level(self) -> float:
        return min(max(self._usual + self._learnt, CHEAPEST - GAIN / 2), DEAREST)

    def passed(self, elapsed_s: float, fill: float, usual: float) -> None:
        """So much time has passed, the bucket is filled to this share, 0 to 1; ``usual``: see `usual_level`."""
        self._wanted += (0.5 - self._wanted) * -math.expm1(-elapsed_s / SETTLING_S)
        self._short = self._wanted - fill
        self._usual = usual
        level = self._level + self._short * 2.0 * elapsed_s / SETTLING_S
        self._learnt = min(max(level, CHEAPEST - GAIN / 2), DEAREST) - usual
