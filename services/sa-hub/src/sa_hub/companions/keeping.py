"""Keeps acknowledgements back: alerts and observations are acknowledged by radio when the archive has them on disk.

An archive that fails is passed over, as on the page: health says so, and an alert that people have heard is not
repeated over the radio until somebody mends a disk. One that neither fails nor ends is waited for so long, then
passed over. What is passed over is counted.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from bootprint.bus import Envelope
from bootprint.messages import Alert, Observation
from sa_hub.companions.worker import Promise

LONGEST_S: Final = 5.0
"""Host time."""


@dataclass(frozen=True, slots=True)
class _Owed:
    """So many notices heard in a look: what becomes of them, and until when that is waited for."""

    look: int
    notices: int
    promise: Promise
    until_s: float


class Keeping:
    """``look`` numbers the hub's looks at what has come by radio: an order that no clock that is set can upset.

    ``entrust`` tells the companions. ``unkept``: notices that were acknowledged without being known to be kept.
    """

    def __init__(self, entrust: Callable[[Sequence[Envelope]], Promise]) -> None:
        self.look = 0
        self.unkept = 0
        self._entrust = entrust
        self._owed: deque[_Owed] = deque()

    def heard(self, envelopes: Sequence[Envelope]) -> None:
        """Tell the companions what was heard in this look; the next one begins."""
        promise = self._entrust(envelopes)
        notices = sum(isinstance(each.message, Alert | Observation) for each in envelopes)
        if notices:
            self._owed.append(_Owed(self.look, notices, promise, time.monotonic() + LONGEST_S))
        self.look += 1

    def until(self) -> int | None:
        """The last look all of whose notices may be acknowledged; None: all that were."""
        while self._owed and self._is_over(self._owed[0]):
            self._owed.popleft()
        return self._owed[0].look - 1 if self._owed else None

    def _is_over(self, owed: _Owed) -> bool:
        fate = owed.promise()
        if fate == "waiting" and time.monotonic() < owed.until_s:
            return False
        if fate != "kept":
            self.unkept += owed.notices
        return True
