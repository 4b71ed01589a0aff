"""Processor time and memory of an exercise's processes, measured from outside."""

import time
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import psutil

from proving_ground.exercises.scoring.score import Row


class UsageMeter:
    """Counts from its making on; processes by name. Ours is the ``umpire`` (routers, nets, observers)."""

    def __init__(self, pids: Mapping[str, int]) -> None:
        self._processes = {name: psutil.Process(pid) for name, pid in pids.items() if psutil.pid_exists(pid)}
        self._processes["umpire"] = psutil.Process()
        self._began_s = time.monotonic()
        self._cpu_s = {name: _cpu_s(process) for name, process in self._processes.items()}

    def rows(self) -> list[Row]:
        """A row for each process that still runs: share of one processor since the start, memory (PSS)."""
        elapsed_s = max(time.monotonic() - self._began_s, 1e-9)
        rows: list[Row] = []
        for name, process in self._processes.items():
            used_s, memory_mb = _cpu_s(process), _memory_mb(process)
            if used_s is None or memory_mb is None:
                continue
            since_s = used_s - (self._cpu_s[name] or 0.0)
            rows.append({"process": name, "cpu_pct": 100.0 * since_s / elapsed_s, "memory_mb": memory_mb})
        return rows


def by_service(rows: list[Row]) -> list[dict[str, Any]]:
    """The rows of each service as one: how many, processor share and memory on average, and memory in all."""
    groups: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        groups[str(row["process"]).rsplit("/", 1)[-1]].append(row)
    return [
        {
            "service": service,
            "processes": len(group),
            "cpu_mean_pct": sum(float(row["cpu_pct"] or 0.0) for row in group) / len(group),
            "cpu_total_pct": sum(float(row["cpu_pct"] or 0.0) for row in group),
            "memory_mean_mb": sum(float(row["memory_mb"] or 0.0) for row in group) / len(group),
            "memory_total_mb": sum(float(row["memory_mb"] or 0.0) for row in group),
        }
        for service, group in groups.items()
    ]


def _cpu_s(process: psutil.Process) -> float | None:
    try:
        times = process.cpu_times()
    except psutil.Error:
        return None
    return float(times.user + times.system)


def _memory_mb(process: psutil.Process) -> float | None:
    """Proportional share: pages that several processes share count once in all."""
    try:
        return float(process.memory_full_info().pss) / 1e6
    except psutil.Error:
        return None
