"""Keeps the processes of one computer running: what ends is started again, what hangs is ended.

Who has run for a while starts again at once; pauses between starts double while a process keeps failing. A
process that ends with 0 has done what it was asked; one that was never well and ends with 2 in its first moments
cannot run as it is configured, and no further start would mend that.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import structlog

from bootprint.processes import ProcessGroup, ProcessSpec, end_of
from bootprint.service import EXIT_BAD_INPUT

FIRST_PAUSE_S: Final = 0.25
LONGEST_PAUSE_S: Final = 3.0
STEADY_S: Final = 20.0
"""Who has run for so long is well: the next failure is a new one."""
FIRST_MOMENTS_S: Final = 10.0
SILENT_S: Final = 15.0
"""Who has told nothing of its health for so long, though it did before, hangs."""
STARTING_S: Final = 60.0
"""The same for who has not told of it yet."""


@dataclass
class Charge:
    """One process in care; times are host seconds. ``due_s`` is when it starts again, None while it runs."""

    spec: ProcessSpec
    started_s: float = 0.0
    heard_s: float | None = None
    due_s: float | None = 0.0
    pause_s: float = 0.0
    restarts: int = 0
    finished: bool = False
    refused: bool = False
    was_well: bool = False

    def silent_s(self, now_s: float) -> float:
        """For how long it has told nothing."""
        return now_s - (self.started_s if self.heard_s is None else self.heard_s)

    def hangs(self, now_s: float) -> bool:
        """Whether it runs, and should have told of its health by now."""
        if self.due_s is not None or self.finished:
            return False
        return self.silent_s(now_s) > (STARTING_S if self.heard_s is None else SILENT_S)

    def ended(self, code: int, now_s: float) -> None:
        """It has ended: when, if ever, it starts again."""
        ran_s = now_s - self.started_s
        self.refused = code == EXIT_BAD_INPUT and ran_s < FIRST_MOMENTS_S and not self.was_well
        self.finished = code == 0 or self.refused
        if self.finished:
            self.due_s = None
            return
        longer_s = min(max(2.0 * self.pause_s, FIRST_PAUSE_S), LONGEST_PAUSE_S)
        self.pause_s = 0.0 if ran_s >= STEADY_S else longer_s
        self.due_s = now_s + self.pause_s


class Supervisor:
    """Charges by the name of their process; `watch` is to be called many times a second.

    ``watched`` tells of whom health is expected; of others only their end is noticed.
    """

    def __init__(
        self, group: ProcessGroup, specs: Iterable[ProcessSpec], watched: Callable[[str], bool]
    ) -> None:
        self.charges = {spec.name: Charge(spec) for spec in specs}
        self._group = group
        self._watched = watched
        self._log = structlog.get_logger()

    def heard(self, name: str, now_s: float) -> None:
        """A process has told of its health."""
        charge = self.charges.get(name)
        if charge is not None and charge.due_s is None:
            charge.heard_s, charge.was_well = now_s, True

    def watch(self, now_s: float) -> None:
        """See who has ended, end who hangs, start who is due."""
        for name, code in self._group.reap().items():
            self._ended(name, code, now_s)
        for name, charge in self.charges.items():
            if self._watched(name) and charge.hangs(now_s):
                self._log.error("process hangs", process=name, silent_s=round(charge.silent_s(now_s), 1))
                self._group.kill(name)
                charge.ended(-9, now_s)
        for charge in self.charges.values():
            if charge.due_s is not None and charge.due_s <= now_s:
                self._start(charge, now_s)

    @property
    def refused(self) -> list[str]:
        """Those that cannot run as they are configured."""
        return [name for name, charge in self.charges.items() if charge.refused]

    def _ended(self, name: str, code: int, now_s: float) -> None:
        charge = self.charges[name]
        charge.ended(code, now_s)
        if charge.finished:
            self._log.info("process ended", process=name, how=end_of(code))
        else:
            self._log.error("process ended", process=name, how=end_of(code), again_in_s=charge.pause_s)

    def _start(self, charge: Charge, now_s: float) -> None:
        again = charge.started_s > 0.0
        charge.restarts += again
        charge.started_s, charge.heard_s, charge.due_s = now_s, None, None
        self._group.start(charge.spec)
        self._log.info("process started", process=charge.spec.name, restarts=charge.restarts)
