"""Services that are forked from a server behave as if each had been started by itself."""

import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from bootprint.fork_server import ForkServer
from bootprint.processes import ProcessGroup, ProcessSpec
from support.routers import free_endpoint
from support.waiting import wait_until

pytestmark = pytest.mark.processes
SERVICES = ("sensor-gateway", "pdr-engine", "fusion", "sa-hub", "bootprint")


@pytest.fixture
def group() -> Iterator[ProcessGroup]:
    with ProcessGroup(forked=("bootprint",)) as made:
        yield made


def router(folder: Path, name: str, *more: str) -> ProcessSpec:
    return ProcessSpec(name, "bootprint", ("router", "--listen", free_endpoint(), *more), folder / name)


def started(group: ProcessGroup, spec: ProcessSpec) -> psutil.Process:
    """The process, once it has said that it runs."""
    assert spec.log
    group.start(spec)
    wait_until(lambda: "router at" in spec.log.read_text(), what=f"{spec.name} runs")
    return psutil.Process(group.pids[spec.name])


def server_of(process: psutil.Process) -> psutil.Process:
    parent = process.parent()
    assert parent
    return parent


def ended(group: ProcessGroup, name: str) -> int:
    codes: dict[str, int] = {}
    wait_until(lambda: codes.update(group.reap()) or name in codes, what=f"{name} has ended")
    return codes[name]


def test_exit_codes_and_last_words_are_the_process_s_own(group: ProcessGroup, tmp_path: Path) -> None:
    group.start(router(tmp_path, "asked-wrong", "--nonsense"))
    killed = started(group, router(tmp_path, "killed"))
    asked = started(group, router(tmp_path, "asked"))
    wait_until(group.failed, what="the refusal")
    assert "asked-wrong ended with exit code 2; its last words" in group.failed()[0]
    killed.kill()
    asked.terminate()
    assert [ended(group, name) for name in ("killed", "asked")] == [-signal.SIGKILL, 0]


def test_more_files_than_a_select_knows_do_no_harm(group: ProcessGroup, tmp_path: Path) -> None:
    spare = [os.dup(0) for _ in range(1100)]
    try:
        started(group, router(tmp_path, "late")).kill()
        assert ended(group, "late") == -signal.SIGKILL
    finally:
        for each in spare:
            os.close(each)


def test_it_has_its_own_name_session_and_folder_and_its_siblings_leave_it_alone(
    group: ProcessGroup, tmp_path: Path
) -> None:
    first, second = (started(group, router(tmp_path, name)) for name in ("first", "second"))
    assert server_of(first) == server_of(second)
    assert first.name() == "bootprint"
    assert first.cwd() == str(Path.cwd())
    assert os.getsid(first.pid) == first.pid
    group.stop(["first"])  # closes its input: nobody else may hold the other end
    assert not first.is_running()
    assert second.is_running()
    assert second.status() != psutil.STATUS_ZOMBIE


def test_who_outlives_the_server_is_ended_for_nobody_could_tell_its_end(
    group: ProcessGroup, tmp_path: Path
) -> None:
    orphan = started(group, router(tmp_path, "orphan"))
    server_of(orphan).kill()
    assert ended(group, "orphan") == -signal.SIGKILL
    wait_until(lambda: not orphan.is_running() or orphan.status() == psutil.STATUS_ZOMBIE, what="its end")
    again = started(group, router(tmp_path, "again"))
    assert server_of(again).is_running()


def test_the_server_has_one_thread_whatever_it_has_imported(tmp_path: Path) -> None:
    server = ForkServer(SERVICES)
    with (tmp_path / "log").open("wb") as log:
        forked = [server.start(command, ["--help"], log) for command in SERVICES]
    process = psutil.Process(server.pid)
    assert process.num_threads() == 1
    assert [each.wait(60.0) for each in forked] == [0] * len(SERVICES)
    for each in forked:
        each.stdin.close()
    said = (tmp_path / "log").read_text()
    assert all(f"Usage: {command}" in said for command in SERVICES)
    server.close()
    assert not process.is_running()


def test_patience_ends(group: ProcessGroup, tmp_path: Path) -> None:
    started(group, router(tmp_path, "lasting"))
    (_, forked) = group._running["lasting"]
    with pytest.raises(subprocess.TimeoutExpired):
        forked.wait(0.01)


def test_what_is_not_installed_is_not_forked() -> None:
    assert not ForkServer(("no-such-command",)).serves("no-such-command")
