"""Faults done to real processes: a full disk for one computer only, a standstill, kills, want of memory."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import psutil

from bootprint.processes import ProcessGroup, ProcessSpec
from proving_ground.exercises.exercise import Fault
from proving_ground.exercises.faults.process_faults import ProcessFaults
from proving_ground.exercises.processes.stage import Stage
from support.waiting import wait_until

WRITER = """
import pathlib, sys, time
while True:
    try:
        pathlib.Path(sys.argv[1]).write_text("kept")
    except OSError:
        pass
    time.sleep(0.01)
"""


HUNGRY = """
import time
held = []
while True:
    try:
        held.append(bytearray(1_000_000))
    except MemoryError:
        raise SystemExit(3)
    if len(held) > 20:
        held.clear()
    time.sleep(0.01)
"""


class Services(ProcessGroup):
    """A group whose processes can be started again by computer and service."""

    def __init__(self, script: str, folder: Path) -> None:
        super().__init__()
        self._script, self._folder = script, folder

    def respawn(self, computer: str, service: str) -> None:
        arguments = ("-c", self._script, str(self._folder / computer))
        name = f"{computer}/{service}"
        self.start(ProcessSpec(name, Path(sys.executable).name, arguments, self._folder / "log", append=True))

    def services(self) -> list[str]:
        return [name.split("/")[1] for name in self.pids]


def staged(group: Services, *faults: Fault) -> Stage:
    """As much of a stage as these faults need: its processes, and nobody who watches them."""
    observers = SimpleNamespace(forget=lambda *_: None, alive=lambda _: set(group.services()))
    exercise = SimpleNamespace(faults=faults)
    return cast(
        Stage, SimpleNamespace(exercise=exercise, processes=group, observers=observers, spawn=group.respawn)
    )


def test_nothing_more_can_be_written_on_a_full_disk_until_it_has_room_again(tmp_path: Path) -> None:
    state = {name: tmp_path / name for name in ("a1", "a2")}
    fault = Fault(10.0, "disk_full", "a1", {"for_s": 5.0})
    with Services(WRITER, tmp_path) as group:
        for name in state:
            group.respawn(name, "sa-hub")
        faults = ProcessFaults(staged(group, fault))
        faults.play(9.9)
        wait_until(lambda: all(path.exists() and path.read_text() for path in state.values()))
        faults.play(10.0)
        wait_until(lambda: not state["a1"].read_text())
        state["a2"].write_text("")
        wait_until(lambda: state["a2"].read_text() == "kept")
        assert not state["a1"].read_text()
        faults.play(15.0)
        wait_until(lambda: state["a1"].read_text() == "kept")
        group.check()


def test_a_process_that_stands_still_goes_on(tmp_path: Path) -> None:
    fault = Fault(10.0, "process_stopped", "a1", {"process": "fusion", "for_s": 5.0})
    with Services(WRITER, tmp_path) as group:
        group.respawn("a1", "fusion")
        faults = ProcessFaults(staged(group, fault))
        process = psutil.Process(group.pids["a1/fusion"])
        faults.play(10.0)
        wait_until(lambda: process.status() == psutil.STATUS_STOPPED)
        faults.play(14.9)
        assert process.status() == psutil.STATUS_STOPPED
        faults.close()  # the end of the exercise comes before its end
        wait_until(lambda: process.status() != psutil.STATUS_STOPPED)


def test_who_is_killed_or_dies_of_want_of_memory_is_started_again(tmp_path: Path) -> None:
    killed = Fault(10.0, "process_killed", "a1", {"process": "sa-hub"})
    short = Fault(20.0, "memory_short", "a1", {"for_s": 5.0})
    with Services(HUNGRY, tmp_path) as group:
        group.respawn("a1", "sa-hub")
        faults = ProcessFaults(staged(group, killed, short))
        for at_s in (10.0, 20.0):
            before = group.pids["a1/sa-hub"]
            faults.play(at_s)
            wait_until(lambda: faults.play(15.0) or group.pids.get("a1/sa-hub", before) != before)  # noqa: B023
        faults.play(25.0)
    first, second = (outage.how for outage in faults.outages)
    assert first == "killed"
    # By an error that it tells, or hard, if not even the interpreter could start in what was left.
    assert second.startswith(("ended with exit code", "was killed by signal"))
    assert all(outage.back_s is not None and outage.back_s > outage.gone_s for outage in faults.outages)
