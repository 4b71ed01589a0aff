"""The demo itself, headless, as a user starts it; and every way to stop it early."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from support.recorded import recorded_data
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes"), pytest.mark.timeout(240)]
BOOTPRINT = Path(sys.executable).parent / "bootprint"
SERVICES = {"sensor-gateway": 8, "pdr-engine": 8, "fusion": 8, "sa-hub": 9}  # of building-clearing


def start(report: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [str(BOOTPRINT), "demo", "--headless", "--report", str(report), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def children_of(pid: int) -> list[psutil.Process]:
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def service_of(process: psutil.Process) -> str:
    try:
        return process.name()
    except psutil.NoSuchProcess:
        return ""


def all_run(demo: subprocess.Popen[str]) -> bool:
    if demo.poll() is not None:
        raise AssertionError(f"the demo ended early: {demo.communicate()}")
    names = [service_of(child) for child in children_of(demo.pid)]
    return all(names.count(service) == count for service, count in SERVICES.items())


def assert_none_left(children: list[psutil.Process]) -> None:
    def left() -> list[psutil.Process]:
        return [child for child in children if child.is_running() and child.status() != psutil.STATUS_ZOMBIE]

    wait_until(lambda: not left(), what="every child has ended")


def test_a_demo_ends_with_scores_for_eight_soldiers(tmp_path: Path) -> None:
    demo = start(tmp_path, "--speed", "2", "--duration", "30", "--json", "-")
    wait_until(lambda: all_run(demo), timeout_s=120.0, what="all 33 processes")
    children = children_of(demo.pid)
    output, errors = demo.communicate(timeout=120)
    assert demo.returncode == 0, errors
    result = json.loads(output)
    assert json.loads((tmp_path / "result.json").read_text()) == result
    assert [row["soldier"] for row in result["soldiers"]] == [f"a{n}" for n in range(1, 9)]
    for row in result["soldiers"]:
        assert row["position_error_p95_m"] < 5.0
        assert row["dead_reckoning_error_p95_m"] is not None
        assert row["floor_correct_pct"] > 80.0
    assert len(result["usage"]) == sum(SERVICES.values()) + 2  # the umpire, and who forks the services
    assert all(row["memory_mb"] > 5.0 for row in result["usage"])
    command_post = result["pictures"][0]
    assert command_post["receiver"] == "cp"
    assert command_post["added_error_p95_m"] < 15.0
    assert command_post["missing_pct"] < 50.0
    assert all(row["bits_per_s"] <= row["budget_bits_per_s"] for row in result["links"])
    assert result["latency_p99_ms"] > 0.0
    assert "<svg" in (tmp_path / "report.html").read_text()
    assert_none_left(children)


def test_recorded_walks_reach_the_command_post(tmp_path: Path) -> None:
    demo = start(tmp_path, "--data", str(recorded_data()), "--speed", "8", "--json", "-")
    output, errors = demo.communicate(timeout=200)
    assert demo.returncode == 0, errors
    result = json.loads(output)
    assert len(result["soldiers"]) == 4
    for row in result["soldiers"]:
        assert row["final_error_m"] < 3.0
    assert result["pictures"][0]["samples"] > 100


@pytest.mark.parametrize(
    ("end", "code"),
    [
        (lambda pid: os.kill(pid, signal.SIGINT), 130),
        (lambda pid: os.kill(pid, signal.SIGTERM), 130),
        (lambda pid: os.kill(pid, signal.SIGKILL), -signal.SIGKILL),
    ],
    ids=["ctrl-c", "sigterm", "kill -9"],
)
def test_a_demo_stopped_early_leaves_no_process_behind(
    tmp_path: Path, end: Callable[[int], None], code: int
) -> None:
    demo = start(tmp_path)
    wait_until(lambda: all_run(demo), timeout_s=120.0, what="all 33 processes")
    children = children_of(demo.pid)
    end(demo.pid)
    _, errors = demo.communicate(timeout=60)
    assert demo.returncode == code
    assert "Traceback" not in errors
    assert_none_left(children)


def test_a_service_that_is_killed_ends_the_demo_with_what_was_scored(tmp_path: Path) -> None:
    demo = start(tmp_path, "--speed", "2")
    wait_until(lambda: all_run(demo), timeout_s=120.0, what="all 33 processes")
    children = children_of(demo.pid)
    next(child for child in children if service_of(child) == "fusion").kill()
    _, errors = demo.communicate(timeout=60)
    assert demo.returncode == 2
    assert "a1/fusion was killed by signal 9" in errors
    assert json.loads((tmp_path / "result.json").read_text())["soldiers"]
    assert_none_left(children)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--data", "nowhere"), "nowhere: no such file or folder"),
        (("--speed", "0"), "--speed 0 must be above 0"),
        (("--loss", "2"), "--loss 2 must be a share"),
        (("--duration", "-1"), "--duration -1 must be a positive number"),
        (("--json", "/nowhere/result.json"), "/nowhere/result.json: cannot be written"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(tmp_path: Path, arguments: tuple[str, ...], expected: str) -> None:
    demo = start(tmp_path, *arguments)
    output, errors = demo.communicate(timeout=60)
    assert demo.returncode == 2
    assert expected in errors
    assert len(errors.strip().splitlines()) == 1
    assert output == ""
