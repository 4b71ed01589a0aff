"""Faults of an exercise of real processes: what is killed is back when its supervisor would have it back.

Played are ``process_killed``, ``router_killed`` and ``disk_full``; the nets play ``radio_gone``, the runs sensors'
faults. A ``clock_jump`` would need rights over a whole computer, which all these processes share. For a full disk a
limit will do: no file of the computer's processes may grow.
"""

import resource
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from bootprint.clock import NS_PER_S
from proving_ground.exercises.exercise import Fault
from proving_ground.exercises.line import RESTART_NS

if TYPE_CHECKING:
    from proving_ground.exercises.stage import Stage

_ROUTER_GONE_S = 2.0


class ProcessFaults:
    """Kills and restarts, by event time."""

    def __init__(self, stage: "Stage") -> None:
        self._stage = stage
        kinds = ("process_killed", "router_killed", "disk_full")
        due = [fault for fault in stage.exercise.faults if fault.kind in kinds]
        self._due = deque(sorted(due, key=lambda fault: fault.at_s))
        self._mending: list[tuple[float, Fault]] = []

    def play(self, elapsed_s: float) -> None:
        """Everything that is due by now."""
        while self._due and self._due[0].at_s <= elapsed_s:
            self._break(self._due.popleft())
        for at_s, fault in [item for item in self._mending if item[0] <= elapsed_s]:
            self._mending.remove((at_s, fault))
            self._mend(fault)

    def _break(self, fault: Fault) -> None:
        stage = self._stage
        if fault.kind == "router_killed":
            stage.close_router(fault.target)
            self._mending.append((fault.at_s + float(fault.details.get("for_s", _ROUTER_GONE_S)), fault))
            return
        if fault.kind == "disk_full":
            self._let_files_grow(fault.target, False)
            self._mending.append((fault.until_s, fault))
            return
        service = str(fault.details["process"])
        stage.processes.kill(f"{fault.target}/{service}")
        stage.observers.forget(fault.target, service)
        if service != "sensor-gateway":  # a replay would begin anew, at its first sample
            self._mending.append((fault.at_s + RESTART_NS / NS_PER_S, fault))

    def _mend(self, fault: Fault) -> None:
        if fault.kind == "router_killed":
            self._stage.open_router(fault.target)
        elif fault.kind == "disk_full":
            self._let_files_grow(fault.target, True)
        else:
            self._stage.spawn(fault.target, str(fault.details["process"]))

    def _let_files_grow(self, computer: str, allowed: bool) -> None:
        for name, pid in self._stage.processes.pids.items():
            if name.startswith(f"{computer}/"):
                with suppress(ProcessLookupError):  # it has ended meanwhile
                    _, most = resource.prlimit(pid, resource.RLIMIT_FSIZE)
                    resource.prlimit(pid, resource.RLIMIT_FSIZE, (most if allowed else 0, most))
