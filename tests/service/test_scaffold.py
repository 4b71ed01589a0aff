"""The service scaffold as real processes: arguments, health, faults, and every way to end."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.config import load_computer
from bootprint.messages import Health, Pressure
from bootprint.service import Context, Options, Service, _inlet, run
from bootprint.topics import Identity
from bootprint.zenoh_bus import RingingInlet, ZenohBus, open_bus
from support.echo_service import build
from support.routers import free_endpoint, running_router
from support.waiting import wait_until

pytestmark = pytest.mark.processes
A1 = Identity("bp", "alpha", "a1")
ECHO = Path(__file__).parents[1] / "support" / "echo_service.py"
REALM = """
id = "bp"
origin = { latitude_deg = 59.0, longitude_deg = 18.0 }
roster = [{ id = "a1", number = 1, unit = "alpha" }]
"""


def write_config(folder: Path, extra: str = "") -> Path:
    (folder / "realm.toml").write_text(REALM)
    path = folder / "computer.toml"
    path.write_text(f'realm = "realm.toml"\nsoldier = "a1"\n{extra}')
    return path


def start(config: Path, router: str, *extra: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, str(ECHO), "--config", str(config), "--router", router, *extra],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@contextmanager
def running_echo(config: Path, router: str, *extra: str) -> Iterator[tuple[subprocess.Popen[str], ZenohBus]]:
    """The service alive, and a bus beside it."""
    bus = open_bus(router)
    process = start(config, router, *extra)
    try:
        wait_until(lambda: bus.alive(A1.selector("health")), what="the liveliness token")
        yield process, bus
    finally:
        bus.close()
        process.kill()
        process.communicate()


def end_of(process: subprocess.Popen[str]) -> tuple[int, str]:
    _, errors = process.communicate(timeout=45)
    return process.returncode, errors


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_it_cleanly_and_its_last_word_is_stopped(tmp_path: Path, number: signal.Signals) -> None:
    with running_router() as router, running_echo(write_config(tmp_path), router) as (process, bus):
        health: list[Health] = []
        bus.subscribe(A1.selector("health"), lambda e: health.append(e.message))
        wait_until(lambda: health, what="health")
        process.send_signal(number)
        code, errors = end_of(process)
        assert code == 0
        assert "Traceback" not in errors
        wait_until(lambda: health[-1].state == "stopped")


@pytest.mark.parametrize(("arguments", "beat_s"), [((), 0.07), (("--beat", "0.2"), 0.2)])
def test_it_looks_at_the_bus_as_often_as_it_chooses_or_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], beat_s: float
) -> None:
    told: list[float] = []

    def noted(_service: Service, context: Context) -> int:
        told.append(context.beat_s)
        return 0

    monkeypatch.setattr("bootprint.service.run", noted)
    monkeypatch.setattr(sys, "argv", ["echo", "--config", str(write_config(tmp_path)), *arguments])
    with pytest.raises(SystemExit) as ended:
        Service("echo", "Repeats pressures.", ("pressure",), build, 0.07).main()
    assert (ended.value.code, told) == (0, [beat_s])


@pytest.mark.timeout(90)
def test_what_rings_is_looked_at_long_before_the_next_beat(tmp_path: Path) -> None:
    with running_router() as router:
        config, hour_s = write_config(tmp_path), 3600.0
        context = Context("echo", load_computer(config), Options(config, router, beat_s=hour_s))
        pressure = Envelope(A1.address("pressure", "baro"), Pressure(time_ns=1, pressure_pa=1000.0))
        with closing(open_bus(router)) as bus:  # health is told after the first look, an echo after the next
            bus.subscribe(A1.selector("health"), lambda _: bus.publish(pressure))
            bus.subscribe(A1.selector("pressure", "echo"), lambda _: context.finish())
            ringing = Service("echo", "Repeats.", ("pressure",), build, hour_s, ringing=("pressure",))
            assert run(ringing, context) == 0


@pytest.mark.parametrize(("beat_s", "rings"), [(0.05, True), (0.2, False)])
def test_who_asks_for_longer_pauses_is_not_rung_for(tmp_path: Path, beat_s: float, *, rings: bool) -> None:
    service = Service("echo", "Repeats.", ("pressure",), build, 0.05, ringing=("pressure",))
    with running_router() as router:
        config = write_config(tmp_path)
        context = Context("echo", load_computer(config), Options(config, router, beat_s=beat_s))
        with closing(context.connect()):
            assert isinstance(_inlet(service, context, "pressure"), RingingInlet) is rings


def test_closing_its_input_ends_it(tmp_path: Path) -> None:
    with (
        running_router() as router,
        running_echo(write_config(tmp_path), router, "--stop-on-eof") as (process, _),
    ):
        assert process.stdin
        process.stdin.close()
        process.stdin = None
        assert end_of(process)[0] == 0


def test_a_failing_handler_is_counted_and_survived(tmp_path: Path) -> None:
    with running_router() as router, running_echo(write_config(tmp_path), router) as (_, bus):
        echoed: list[float] = []
        health: list[Health] = []
        bus.subscribe(A1.selector("pressure", "echo"), lambda e: echoed.append(e.message.pressure_pa))
        bus.subscribe(A1.selector("health"), lambda e: health.append(e.message))
        address = A1.address("pressure", "baro")
        for value in (13.0, 1000.0):
            bus.publish(Envelope(address, Pressure(time_ns=1, pressure_pa=value)))
        wait_until(lambda: 1000.0 in echoed, what="the message after the failure")
        wait_until(lambda: health and health[-1].counters["handler_errors"] == 1)
        assert health[-1].state == "degraded"
        assert 10.0 < health[-1].gauges["memory_mb"] < 500.0


def test_no_router_is_one_line_and_exit_2(tmp_path: Path) -> None:
    code, errors = end_of(start(write_config(tmp_path), free_endpoint(), "--router-wait", "0.3"))
    assert code == 2
    assert errors.startswith("echo: no router at tcp/")
    assert len(errors.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("extra", "option", "expected"),
    [
        ("colour = 1\n", (), "unknown key 'colour'"),
        ("[gatewy]\n", (), "did you mean 'gateway'"),
        ("", ("--speed", "fast"), "--speed 'fast'"),
        ("", ("--clock-origin", "inf"), "--clock-origin inf"),
        ("[fusion]\nreorder_window_s = inf\n", (), "fusion.reorder_window_s is inf"),
        ("", ("--log-level", "loud"), "--log-level 'loud'"),
        ("=", (), "not valid TOML"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(
    tmp_path: Path, extra: str, option: tuple[str, ...], expected: str
) -> None:
    code, errors = end_of(start(write_config(tmp_path, extra), free_endpoint(), *option))
    assert code == 2
    assert expected in errors
    assert len(errors.strip().splitlines()) == 1


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    code, errors = end_of(start(tmp_path / "nowhere.toml", free_endpoint()))
    assert code == 2
    assert "nowhere.toml: no such file" in errors


def test_a_router_that_was_gone_is_told_of(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    health: list[Health] = []
    with running_router(endpoint):
        process = start(write_config(tmp_path), endpoint)
        watcher = open_bus(endpoint)
        wait_until(lambda: watcher.alive(A1.selector("health")), what="the liveliness token")
        watcher.close()
    assert process.stderr
    while "router lost" not in process.stderr.readline():
        assert process.poll() is None
    with running_router(endpoint):
        watcher = open_bus(endpoint)
        watcher.subscribe(A1.selector("health"), lambda e: health.append(e.message))
        wait_until(lambda: health and health[-1].counters["router_losses"] == 1, what="the loss is reported")
        watcher.close()
        process.terminate()
        code, errors = end_of(process)
    assert code == 0
    assert "router back" in errors
