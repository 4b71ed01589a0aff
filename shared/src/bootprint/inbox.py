"""Where a service's main loop waits: for jobs that others post, and for the bell that messages on the bus ring.

A look at the bus costs more than most messages do, so the bell does not call at once: what comes within a moment
is looked at together, and rings for nothing more until then.
"""

import queue
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Final

from bootprint.bus import Envelope

_SIZE: Final = 20_000
_SPELL_S: Final = 0.1
"""Jobs that keep coming are left for messages after so long."""

Job = Callable[[], Iterable[Envelope]]


def _nothing() -> Iterable[Envelope]:
    return ()


class Inbox:
    """Jobs for the main loop, from any thread; ``gather_s``: the moment between the bell and the look."""

    def __init__(self, gather_s: float) -> None:
        self.dropped = 0
        self._gather_s = gather_s
        self._rung = False
        self._jobs: queue.Queue[Job] = queue.Queue(_SIZE)

    def post(self, job: Job, *, patient: bool) -> None:
        """Leave a job; where there is no room wait for it (``patient``), or drop the job and count it."""
        try:
            self._jobs.put(job, block=patient)
        except queue.Full:
            self.dropped += 1

    def ring(self) -> None:
        """Something waits on the bus."""
        if not self._rung:
            self._rung = True
            with suppress(queue.Full):  # whose jobs are looked at anyway
                self._jobs.put_nowait(_nothing)

    def answer(self) -> None:
        """What waits on the bus is about to be looked at: what comes from now on rings again."""
        self._rung = False

    def jobs(self, until: float) -> Iterator[Job]:
        """Jobs as they come, to a time of `time.monotonic` or the bell's; one that waits already is never left."""
        try:
            while True:
                wait_s = until - time.monotonic()
                yield self._jobs.get(timeout=wait_s) if wait_s > 0.0 else self._jobs.get_nowait()
                now = time.monotonic()
                if self._rung:
                    until = min(until, now + self._gather_s)
                if now > until + _SPELL_S:
                    return
        except queue.Empty:
            return
