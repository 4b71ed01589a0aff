"""Displacements of steps whose direction is seen only later: published now, put right with the next steps.

The first step aside or back looks like one more step forward until the second has been seen. What was published
stays published; the next step carries the difference, so that the track ends where it would had all been known.
"""

from collections import deque
from collections.abc import Mapping

import numpy as np

from bootprint.messages import Direction
from pdr_engine.body.movement.direction import LAG, DirectionFilter
from pdr_engine.body.pieces import FloatArray

Ways = Mapping[Direction, FloatArray]


class Settlement:
    """Keeps the last `LAG` steps open."""

    def __init__(self) -> None:
        self._open: deque[tuple[Ways, FloatArray]] = deque(maxlen=LAG)

    def step(self, ways: Ways, directions: DirectionFilter) -> FloatArray:
        """What to publish for a step: its displacement (2,), m, and what is to be put right of those before.

        ``ways``: the displacement (2,) that the step would have in each direction. ``directions`` has taken the
        step in.
        """
        owed = np.zeros(2)
        for lag in range(1, len(self._open) + 1):
            earlier, booked = self._open[-lag]
            right = earlier[directions.settled(lag)]
            owed += right - booked
            self._open[-lag] = (earlier, right)
        now = ways[directions.decided]
        self._open.append((ways, now))
        return np.asarray(now + owed)
