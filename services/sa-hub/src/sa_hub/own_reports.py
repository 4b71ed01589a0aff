"""Our own reports as the radio is to tell them: in this hub's time, and from the step on that they belong to.

A sensor may stamp by a clock other than this computer's. What a frame tells of others is in the hub's time, and one
offset is all that a receiver can find out about a sender, so our own reports must be in the same time.
"""

from collections import deque
from dataclasses import replace
from typing import Final

from sa_hub.radio.content import Report
from sa_hub.tracks import CLOCK_TOLERANCE_NS

_LONGEST_QUEUE: Final = 256


class OwnReports:
    """The newest report for each step, also for steps that are made up late."""

    def __init__(self) -> None:
        self._arriving: list[tuple[Report, int]] = []
        self._settled: deque[Report] = deque(maxlen=_LONGEST_QUEUE)

    def add(self, report: Report, hub_ns: int) -> None:
        """A report has come; ``hub_ns`` is the last time that the hub was told, before or at its arrival."""
        self._arriving.append((report, hub_ns))

    def settle(self, now_ns: int) -> None:
        """It is ``now_ns``: what has come so far came between two known times, so its stamp can be judged."""
        for report, before_ns in self._arriving:
            right = before_ns - CLOCK_TOLERANCE_NS <= report.time_ns <= now_ns + CLOCK_TOLERANCE_NS
            self._settled.append(report if right else replace(report, time_ns=now_ns))
        self._arriving.clear()

    def at(self, step_ns: int, now_ns: int) -> Report | None:
        """Our newest report at this step; one that is stamped a little ahead of the clock is here already."""
        here = [each for each in self._settled if each.time_ns <= step_ns or each.time_ns > now_ns]
        while here and self._settled[0] is not here[-1]:
            self._settled.popleft()
        return here[-1] if here else None

    def clear(self) -> None:
        """The clock was set back: begin afresh."""
        self._arriving.clear()
        self._settled.clear()
