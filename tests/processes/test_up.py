"""`bootprint up` and `bootprint doctor` on a real computer: sensors replayed, router and services as processes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from bootprint.messages import Health
from bootprint.topics import Identity
from bootprint.zenoh_bus import open_bus
from sa_hub.keys import create_group_key
from support.golden import WALK
from support.routers import free_endpoint
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes")]
SERVICES = {"pdr-engine", "fusion", "sensor-gateway", "sa-hub"}
_BOOTPRINT = str(Path(sys.executable).parent / "bootprint")


@pytest.fixture
def computer(tmp_path: Path) -> Path:
    """A soldier's computer that replays the small recording for ever; its router's address is in the file."""
    shutil.copytree(WALK, tmp_path / "walk")
    create_group_key(tmp_path / "keys" / "group.key")
    (tmp_path / "realm.toml").write_text(
        'id = "up"\norigin = { latitude_deg = 59.35, longitude_deg = 18.07 }\n'
        'roster = [{ id = "a1", number = 1, unit = "alpha" }]\n'
    )
    path = tmp_path / "computer.toml"
    path.write_text(
        f'realm = "realm.toml"\nsoldier = "a1"\nrouter = "{free_endpoint()}"\n'
        '[[gateway.sources]]\nkind = "replay"\npath = "walk"\nloop = true\n'
        "[fusion.start]\neast_m = 0.0\nnorth_m = 0.0\nazimuth_deg = 90.0\n"
        '[hub]\nrole = "soldier"\n[[hub.links]]\nname = "squad"\nrate_bits_per_s = 1200\nbind = "127.0.0.1:0"\n'
    )
    return path


def router_of(computer: Path) -> str:
    line = next(line for line in computer.read_text().splitlines() if line.startswith("router"))
    return line.split('"')[1]


@contextmanager
def running_up(computer: Path) -> Iterator[subprocess.Popen[bytes]]:
    with (computer.parent / "up.log").open("wb") as log:
        process = subprocess.Popen(
            [_BOOTPRINT, "up", str(computer), "--logs", str(computer.parent / "logs"), "--stop-on-eof"],
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=log,
        )
    try:
        yield process
    finally:
        assert process.stdin
        process.stdin.close()
        assert process.wait(20.0) == 0


def doctor(computer: Path) -> tuple[int, dict[str, str]]:
    """Exit code, and the level of each finding by its subject."""
    command = [_BOOTPRINT, "doctor", str(computer), "--json", "-"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, {row["subject"]: row["level"] for row in json.loads(done.stdout)}


def child(up: subprocess.Popen[bytes], name: str) -> psutil.Process | None:
    for process in psutil.Process(up.pid).children(recursive=True):
        with suppress(psutil.Error):  # one that has just ended
            if process.name() == name:
                return process
    return None


def test_everything_runs_is_kept_running_and_leaves_nothing(computer: Path) -> None:
    with running_up(computer) as up:
        router = router_of(computer)
        wait_until(
            lambda: doctor(computer)[1].items() >= dict.fromkeys(SERVICES, "ok").items(), 90.0, "all run"
        )
        children = psutil.Process(up.pid).children(recursive=True)
        assert {process.name() for process in children} >= {*SERVICES, "bootprint"}
        assert len(children) == 6  # and who forks them
        before = child(up, "fusion")
        assert before is not None
        with closing(open_bus(router)) as bus:
            heard: list[Health] = []
            bus.subscribe(
                Identity("up", "alpha", "a1").selector("health", "fusion"),
                lambda envelope: isinstance(envelope.message, Health) and heard.append(envelope.message),
            )
            os.kill(before.pid, signal.SIGKILL)
            wait_until(
                lambda: (again := child(up, "fusion")) and again.pid != before.pid, what="a new fusion"
            )
            heard.clear()
            wait_until(lambda: any(health.sequence == 1 for health in heard), 30.0, "its health")
        left = psutil.Process(up.pid).children(recursive=True)
    wait_until(lambda: not any(process.is_running() for process in left), what="nothing is left")
    log = (computer.parent / "up.log").read_text()
    assert 'event="process ended" process=fusion how="was killed by signal 9"' in log
    assert log.count("Traceback") == 0


def test_what_cannot_run_as_configured_ends_all_with_its_reason(computer: Path) -> None:
    computer.write_text(computer.read_text().replace('path = "walk"', 'path = "nowhere"'))
    logs = computer.parent / "logs"
    command = [_BOOTPRINT, "up", str(computer), "--logs", str(logs)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "sensor-gateway cannot run as configured" in done.stderr.splitlines()[-1]
    assert "nowhere: no such recording" in (logs / "sensor-gateway.log").read_text()


@pytest.mark.parametrize(
    ("old", "new", "subject"),
    [
        ('path = "walk"', 'path = "nowhere"', "sensors"),
        ("[hub]", "[hub]\nstale = 1", "hub"),
        ("azimuth_deg", "azimut_deg", "fusion"),
        ('soldier = "a1"', 'soldier = "zz"', "configuration"),
    ],
)
def test_the_doctor_finds_what_is_wrong(computer: Path, old: str, new: str, subject: str) -> None:
    code, levels = doctor(computer)
    assert code == 0
    assert set(levels.values()) <= {"ok", "warning"}
    computer.write_text(computer.read_text().replace(old, new))
    code, levels = doctor(computer)
    assert code == 1
    assert [name for name, level in levels.items() if level == "fault"] == [subject]


def test_the_doctor_sees_a_key_that_others_may_read(computer: Path) -> None:
    (computer.parent / "keys" / "group.key").chmod(0o644)
    code, levels = doctor(computer)
    assert (code, levels["group key"]) == (1, "fault")
