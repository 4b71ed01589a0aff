"""Faults done to real processes: a disk that is full and has room again, for one computer only."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from bootprint.processes import ProcessGroup, ProcessSpec
from proving_ground.exercises.exercise import Fault
from proving_ground.exercises.process_faults import ProcessFaults
from proving_ground.exercises.stage import Stage
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


def test_nothing_more_can_be_written_on_a_full_disk_until_it_has_room_again(tmp_path: Path) -> None:
    state = {name: tmp_path / name for name in ("a1", "a2")}
    fault = Fault(10.0, "disk_full", "a1", {"for_s": 5.0})
    with ProcessGroup() as group:
        for name, path in state.items():
            arguments = ("-c", WRITER, str(path))
            log = tmp_path / f"{name}.log"
            group.start(ProcessSpec(f"{name}/sa-hub", Path(sys.executable).name, arguments, log))
        stage = SimpleNamespace(exercise=SimpleNamespace(faults=(fault,)), processes=group)
        faults = ProcessFaults(cast(Stage, stage))
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
