"""Process groups: nothing is left behind, whatever happens to the parent."""

import os
import signal
import socket
import subprocess
import sys
import textwrap
from pathlib import Path

import psutil
import pytest

from bootprint.processes import ProcessError, ProcessGroup, ProcessSpec
from proving_ground.exercises.processes.free_ports import free_ports
from support.routers import free_endpoint
from support.waiting import wait_until

pytestmark = pytest.mark.processes


def router_spec(folder: Path, name: str = "router", listen: str | None = None) -> ProcessSpec:
    arguments = ("router", "--listen", listen or free_endpoint())
    return ProcessSpec(name, "bootprint", arguments, folder / f"{name}.log")


def is_running(pid: int) -> bool:
    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE


def test_a_group_stops_all_it_started(tmp_path: Path) -> None:
    with ProcessGroup() as group:
        for name, port in zip(("one", "two"), free_ports(2, socket.SOCK_STREAM), strict=True):
            group.start(router_spec(tmp_path, name, f"tcp/127.0.0.1:{port}"))
        wait_until(lambda: all((tmp_path / f"{n}.log").read_text() for n in ("one", "two")))
        pids = list(group.pids.values())
        assert all(is_running(pid) for pid in pids)
        group.check()
    assert not any(is_running(pid) for pid in pids)


def test_a_process_that_ends_early_is_named_with_its_last_words(tmp_path: Path) -> None:
    with ProcessGroup() as group:
        group.start(router_spec(tmp_path, "broken", listen="tcp/127.0.0.1:99999"))
        wait_until(group.failed)
        with pytest.raises(
            ProcessError,
            match=r"broken ended with exit code 2; .*broken.log: bootprint: cannot start a router",
        ):
            group.check()


def test_an_unknown_command_is_an_error_in_words(tmp_path: Path) -> None:
    with pytest.raises(ProcessError, match=r"no-such-command.*not installed"):
        ProcessGroup().start(ProcessSpec("x", "no-such-command", (), tmp_path / "x.log"))


@pytest.mark.parametrize("forked", [(), ("bootprint",)], ids=["started", "forked"])
def test_a_killed_parent_leaves_no_child(tmp_path: Path, forked: tuple[str, ...]) -> None:
    script = textwrap.dedent(
        f"""
        import sys, threading
        from pathlib import Path
        sys.path.insert(0, {str(Path(__file__).parents[1])!r})
        from bootprint.processes import ProcessGroup, ProcessSpec
        from support.routers import free_endpoint
        group = ProcessGroup({forked!r})
        log = Path({str(tmp_path / "child.log")!r})
        group.start(ProcessSpec("child", "bootprint", ("router", "--listen", free_endpoint()), log))
        print(group.pids["child"], flush=True)
        threading.Event().wait()
        """
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout
    child = int(parent.stdout.readline())
    wait_until(lambda: (tmp_path / "child.log").read_text(), what="the child runs")
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    wait_until(lambda: not is_running(child), what="the child has ended")
