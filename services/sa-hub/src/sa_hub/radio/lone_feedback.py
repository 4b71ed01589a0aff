"""When feedback goes in a frame of its own: where no report takes it along, seldom, for a share of the rate.

A command post without a place of its own tells of nobody, and yet who speaks to it must learn what it hears. A hub
that does tell something waits longer: its next report takes feedback along for a few bytes.
"""

import random
from typing import Final

from bootprint.clock import NS_PER_S

SHARE: Final = 0.25
"""Of the link's rate: lone feedback takes no more."""
LEAST_PAUSE_S: Final = 2.0
PATIENCE_S: Final = (1.0, 10.0)
"""How long feedback waits for a report, while we have nothing to tell and while we do."""
_LOOK_S: Final = 0.5
_JITTER: Final = 0.3


class LoneFeedback:
    """One net's. ``frame_s``: for how long the link is at its full rate with one such frame."""

    def __init__(self, seed: str, frame_s: float) -> None:
        self._random = random.Random(seed)
        self._pause_s = max(LEAST_PAUSE_S, frame_s / SHARE)
        self._since_ns: int | None = None
        self._next_ns = 0

    def looks(self, now_ns: int) -> bool:
        """Whether it is time to look what there is to tell."""
        return now_ns >= self._next_ns

    def is_due(self, now_ns: int, *, waiting: bool, telling: bool) -> bool:
        """Whether what is ``waiting`` is to go alone now; ``telling``: we have reports that may take it along."""
        self._next_ns = now_ns + round(_LOOK_S * NS_PER_S)
        if not waiting:
            self._since_ns = None
            return False
        if self._since_ns is None:
            self._since_ns = now_ns
        return now_ns - self._since_ns >= PATIENCE_S[telling] * NS_PER_S

    def sent(self, now_ns: int, *, alone: bool) -> None:
        """It went, alone or with a report; hubs that heard the same frame do not go on in step."""
        self._since_ns = None
        if alone:
            pause_s = self._pause_s * self._random.uniform(1.0, 1.0 + _JITTER)
            self._next_ns = now_ns + round(pause_s * NS_PER_S)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        self._since_ns = None
        self._next_ns -= by_ns
