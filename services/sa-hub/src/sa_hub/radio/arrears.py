"""How far behind a listener may be with each soldier: the odds, frame by frame, of what it has missed or refused.

An update is refused by who is farther behind than it allows for, and who once refused is refused again until the
sender learns of it. A few receivers that are played do not show what is that rare, so it is reckoned.
"""

from typing import Final

import numpy as np

from sa_hub.radio.ground import FloatArray
from sa_hub.radio.layout import MISSES
from sa_hub.radio.picture import IntArray, Spoken

_BEYOND: Final = MISSES[-1] + 1
"""So many frames behind or more, or never told: no update can be resolved."""


def certainly(behind: IntArray) -> FloatArray:
    """(slots, states) the odds of who is ``behind`` (slots,) by so much for sure."""
    odds: FloatArray = np.eye(_BEYOND + 1)[np.minimum(behind, _BEYOND)]
    return odds


def after(odds: FloatArray, spoken: Spoken, loss: float) -> FloatArray:
    """The odds after a frame of ours that is missed with probability ``loss``."""
    behind = _one_more(odds)
    then = (1.0 - loss) * odds + loss * behind
    allowed = _BEYOND if spoken.misses is None else spoken.misses
    before = odds[spoken.slots]
    refused = before.copy()
    refused[:, : allowed + 1] = 0.0
    heard = _one_more(refused)
    heard[:, 0] = (before - refused).sum(axis=1)
    then[spoken.slots] = (1.0 - loss) * heard + loss * behind[spoken.slots]
    return then


def needed(odds: FloatArray, unsure: float) -> IntArray:
    """(n,) what updates must allow for, so that they are refused with a probability of no more than ``unsure``.

    Who can resolve no update whatsoever does not count.
    """
    resolved = np.cumsum(odds[:, :_BEYOND], axis=1)
    needs: IntArray = np.argmax(resolved >= resolved[:, -1:] - unsure, axis=1)
    return needs


def _one_more(odds: FloatArray) -> FloatArray:
    """The odds of who is one frame farther behind."""
    behind = np.zeros_like(odds)
    behind[:, 1:] = odds[:, :-1]
    behind[:, -1] += odds[:, -1]
    return behind
