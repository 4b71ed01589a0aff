"""Restarts by a clock of the test's own, and real processes that end, hang and refuse."""

from pathlib import Path

import pytest

from bootprint.processes import ProcessGroup, ProcessSpec
from bootprint.supervision import (
    FIRST_PAUSE_S,
    LONGEST_PAUSE_S,
    SILENT_S,
    STARTING_S,
    STEADY_S,
    Charge,
    Supervisor,
)
from support.routers import free_endpoint
from support.waiting import wait_until

SPEC = ProcessSpec("router", "bootprint", ("router",), None)


def running(since_s: float = 100.0) -> Charge:
    return Charge(SPEC, started_s=since_s, due_s=None)


def test_pauses_double_while_it_keeps_failing_and_never_leave_it_down_for_long() -> None:
    charge, now_s, pauses = running(), 101.0, []
    for _ in range(8):
        charge.ended(-9, now_s)
        assert charge.due_s is not None
        pauses.append(charge.due_s - now_s)
        now_s = charge.due_s
        charge.started_s, charge.due_s = now_s, None
    assert pauses[:3] == pytest.approx([FIRST_PAUSE_S, 2 * FIRST_PAUSE_S, 4 * FIRST_PAUSE_S])
    assert pauses[-1] == LONGEST_PAUSE_S < 5.0


def test_who_was_well_for_a_while_starts_again_at_once() -> None:
    charge = running()
    charge.pause_s = LONGEST_PAUSE_S
    charge.ended(1, 100.0 + STEADY_S)
    assert charge.due_s == 100.0 + STEADY_S


def test_an_end_as_asked_is_the_end() -> None:
    charge = running()
    charge.ended(0, 200.0)
    assert charge.finished
    assert charge.due_s is None
    assert not charge.refused


@pytest.mark.parametrize(
    ("was_well", "ended_s", "refused"),
    [(False, 103.0, True), (True, 103.0, False), (False, 131.0, False)],  # the last: no router came in time
)
def test_a_refusal_is_only_one_at_the_first_start(was_well: bool, ended_s: float, refused: bool) -> None:
    charge = running()
    charge.was_well = was_well
    charge.ended(2, ended_s)
    assert charge.refused == charge.finished == refused


def test_silence_is_judged_by_whether_it_ever_spoke() -> None:
    charge = running()
    assert not charge.hangs(100.0 + STARTING_S)
    assert charge.hangs(100.1 + STARTING_S)
    charge.heard_s = 150.0
    assert not charge.hangs(150.0 + SILENT_S)
    assert charge.hangs(150.1 + SILENT_S)
    charge.due_s = 1e9
    assert not charge.hangs(1e6)


@pytest.mark.processes
def test_a_killed_and_a_hanging_process_run_again_and_a_refused_one_does_not(tmp_path: Path) -> None:
    specs = [
        ProcessSpec(
            name, "bootprint", ("router", "--listen", endpoint), tmp_path / f"{name}.log", append=True
        )
        for name, endpoint in (("killed", free_endpoint()), ("hangs", free_endpoint()), ("bad", "tcp/none:0"))
    ]
    with ProcessGroup() as group:
        supervisor = Supervisor(group, specs, watched=lambda name: name == "hangs")
        supervisor.watch(1.0)
        first = group.pids
        assert set(first) == {"killed", "hangs", "bad"}
        wait_until(lambda: supervisor.watch(2.0) or supervisor.refused, what="the refusal")
        assert supervisor.refused == ["bad"]
        supervisor.heard("hangs", 2.0)
        group._running["killed"][1].kill()
        wait_until(lambda: supervisor.watch(3.0) or "killed" not in group.pids, what="the end was seen")
        supervisor.watch(4.0)
        assert group.pids["killed"] != first["killed"]
        assert group.pids["hangs"] == first["hangs"]
        supervisor.watch(2.1 + SILENT_S)
        supervisor.watch(2.1 + SILENT_S + LONGEST_PAUSE_S)
        assert group.pids["hangs"] != first["hangs"]
        assert {name: charge.restarts for name, charge in supervisor.charges.items()} == {
            "killed": 1,
            "hangs": 1,
            "bad": 0,
        }
        assert "bad" not in group.pids
