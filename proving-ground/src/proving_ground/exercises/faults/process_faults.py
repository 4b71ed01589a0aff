"""Faults of an exercise of real processes: what is killed is back when `bootprint up` would have it back, at once.

The nets play ``radio_gone`` and ``net_parted``, the runs sensors' faults; all others are played here. Limits stand
in for a full disk (no file of the computer's processes may grow) and for want of memory (none gets more than it
has); a clock that jumps is that of a hub that is started again, for all processes share one that nobody may set.
"""

import os
import resource
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bootprint.processes import end_of
from bootprint.upkeep import LOOK_S
from proving_ground.exercises.event_time.line import killed_by
from proving_ground.exercises.exercise import Fault
from proving_ground.exercises.faults.bus_flood import BusFlood

if TYPE_CHECKING:
    from proving_ground.exercises.processes.stage import Stage

_ROUTER_GONE_S: Final = 2.0
_PLAYED: Final = frozenset(
    (
        *("process_killed", "process_stopped", "power_cut", "router_killed"),
        *("clock_jump", "disk_full", "memory_short", "bus_flood"),
    )
)


@dataclass
class Outage:
    """A service of a computer that was gone: host seconds (monotonic), None for what has not come yet.

    ``again_s`` is when it was started again, ``back_s`` when it spoke.
    """

    fault: Fault | None
    computer: str
    service: str
    gone_s: float
    how: str = "killed"
    again_s: float | None = None
    back_s: float | None = None


class ProcessFaults:
    """Breaks and mends, by event time; ``outages`` tells who was gone for how long."""

    def __init__(self, stage: "Stage") -> None:
        self._stage = stage
        due = [fault for fault in stage.exercise.faults if fault.kind in _PLAYED]
        self._due = deque(sorted(due, key=lambda fault: fault.at_s))
        self._mending: list[tuple[float, Fault, Callable[[], None]]] = []
        self._starting: list[tuple[float, str, str]] = []
        self._floods: list[BusFlood] = []
        self._starved: set[str] = set()
        self.outages: list[Outage] = []

    def play(self, elapsed_s: float) -> None:
        """Everything that is due by now."""
        while self._due and self._due[0].at_s <= elapsed_s:
            self._break(self._due.popleft())
        for item in [item for item in self._mending if item[0] <= elapsed_s]:
            self._mending.remove(item)
            item[2]()
        for flood in self._floods:
            flood.pour()
        self._revive()
        self._note_back()

    def close(self) -> None:
        """Let everybody go on who stands still."""
        for _, _, mend in self._mending:
            mend()
        self._mending.clear()

    # -- breaking -----------------------------------------------------------------------------------------------

    def _break(self, fault: Fault) -> None:
        breaks = {
            "process_killed": self._kill,
            "process_stopped": self._stop,
            "power_cut": self._cut_power,
            "router_killed": self._kill_router,
            "clock_jump": self._jump,
            "disk_full": self._fill_disk,
            "memory_short": self._starve,
            "bus_flood": self._flood,
        }
        breaks[fault.kind](fault)

    def _later(self, fault: Fault, mend: Callable[[], None], for_s: float | None = None) -> None:
        until_s = fault.until_s if for_s is None else fault.at_s + for_s
        self._mending.append((until_s, fault, mend))

    def _kill(self, fault: Fault) -> None:
        (service,) = killed_by(fault)
        self._gone(fault, service)
        self._starting.append((time.monotonic() + LOOK_S, fault.target, service))

    def _gone(self, fault: Fault, service: str) -> None:
        self._stage.processes.kill(f"{fault.target}/{service}")
        self._stage.observers.forget(fault.target, service)
        self.outages.append(Outage(fault, fault.target, service, time.monotonic()))

    def _stop(self, fault: Fault) -> None:
        pid = self._stage.processes.pids.get(f"{fault.target}/{fault.details['process']}")
        if pid is not None:
            os.kill(pid, signal.SIGSTOP)
            self._later(fault, lambda: _signal(pid, signal.SIGCONT))

    def _cut_power(self, fault: Fault) -> None:
        self._stage.close_router(fault.target)
        services = self._stage.services_of(fault.target)
        for service in services:
            self._gone(fault, service)
        self._later(fault, lambda: self._restore_power(fault, services))

    def _restore_power(self, fault: Fault, services: tuple[str, ...]) -> None:
        self._stage.open_router(fault.target)
        for outage in self.outages:  # gone is who should be there
            if outage.fault is fault:
                outage.gone_s = time.monotonic()
        for service in services:
            self._start(fault.target, service)

    def _start(self, computer: str, service: str) -> None:
        self._stage.spawn(computer, service)
        for outage in self.outages:
            if (outage.computer, outage.service, outage.again_s) == (computer, service, None):
                outage.again_s = time.monotonic()

    def _kill_router(self, fault: Fault) -> None:
        self._stage.close_router(fault.target)
        for_s = float(fault.details.get("for_s", _ROUTER_GONE_S))
        self._later(fault, lambda: self._stage.open_router(fault.target), for_s)

    def _jump(self, fault: Fault) -> None:
        self._set_clock(fault, float(fault.details["jump_s"]))
        self._later(fault, lambda: self._set_clock(fault, 0.0))

    def _set_clock(self, fault: Fault, jump_s: float) -> None:
        self._gone(fault, "sa-hub")
        self._stage.jumps_s[fault.target] = jump_s
        self._starting.append((time.monotonic() + LOOK_S, fault.target, "sa-hub"))

    def _fill_disk(self, fault: Fault) -> None:
        self._limit(fault.target, resource.RLIMIT_FSIZE, lambda _: 0)
        self._later(fault, lambda: self._limit(fault.target, resource.RLIMIT_FSIZE, None))

    def _starve(self, fault: Fault) -> None:
        self._starved.add(fault.target)
        self._limit(fault.target, resource.RLIMIT_AS, _address_space)
        self._later(fault, lambda: self._limit(fault.target, resource.RLIMIT_AS, None))

    def _limit(self, computer: str, what: int, limit: Callable[[int], int] | None) -> None:
        """Set the soft limit of every process of a computer, or (None) lift it again."""
        for pid in self._pids(computer):
            with suppress(ProcessLookupError, FileNotFoundError):  # it has ended meanwhile
                _, most = resource.prlimit(pid, what)
                resource.prlimit(pid, what, (most if limit is None else limit(pid), most))

    def _pids(self, computer: str) -> Iterator[int]:
        for name, pid in self._stage.processes.pids.items():
            if name.startswith(f"{computer}/"):
                yield pid

    def _flood(self, fault: Fault) -> None:
        identity = self._stage.exercise.identity(fault.target)
        times = float(fault.details.get("times", 10.0))
        flood = BusFlood(self._stage.endpoint(fault.target), identity, times, self._stage.clock)
        self._floods.append(flood)
        self._later(fault, lambda: self._dam(flood))

    def _dam(self, flood: BusFlood) -> None:
        self._floods.remove(flood)
        flood.close()

    # -- mending ------------------------------------------------------------------------------------------------

    def _revive(self) -> None:
        """Start who is due; who died of want of memory is started again as well."""
        for name, code in self._died():
            computer, service = name.split("/", 1)
            self._stage.observers.forget(computer, service)
            self.outages.append(Outage(None, computer, service, time.monotonic(), end_of(code)))
            self._starting.append((time.monotonic() + LOOK_S, computer, service))
        for item in [item for item in self._starting if item[0] <= time.monotonic()]:
            self._starting.remove(item)
            self._start(item[1], item[2])

    def _died(self) -> list[tuple[str, int]]:
        if not self._starved:
            return []
        return self._stage.processes.take_dead(lambda name: name.split("/", 1)[0] in self._starved)

    def _note_back(self) -> None:
        for outage in self.outages:
            awaited = outage.again_s is not None and outage.back_s is None
            if awaited and outage.service in self._stage.observers.alive(outage.computer):
                outage.back_s = time.monotonic()


def _signal(pid: int, number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, number)


def _address_space(pid: int) -> int:
    """Bytes of address space that a process has now."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[0])
    return pages * resource.getpagesize()
