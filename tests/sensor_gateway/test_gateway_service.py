"""The gateway as a whole: as a part in its scaffold, and as a real process on a real bus."""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
import structlog

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.clock import ScaledClock
from bootprint.config import load_computer
from bootprint.errors import ConfigError, RecordingError
from bootprint.inbox import Job
from bootprint.messages import Health, ImuBatch
from bootprint.service import Context, Options
from bootprint.topics import Identity
from bootprint.zenoh_bus import open_bus
from sensor_gateway.gateway import build
from sensor_gateway.recordings import load_runs
from sensor_gateway.sources.replay import DEFAULT_START_NS, run_messages
from support.routers import running_router
from support.sensor_device import UTC_NS, MavlinkSender, PtyDevice
from support.ubx_receiver import pvt_at
from support.waiting import PATIENCE_S, wait_until

A1 = Identity("bp", "alpha", "a1")
REALM = """
id = "bp"
origin = { latitude_deg = 59.0, longitude_deg = 18.0 }
roster = [{ id = "a1", number = 1, unit = "alpha" }]
"""
SAMPLES = 4000
S = 1_000_000_000


def write_config(folder: Path, sources: str) -> Path:
    (folder / "realm.toml").write_text(REALM)
    path = folder / "computer.toml"
    path.write_text(f'realm = "realm.toml"\nsoldier = "a1"\n[gateway]\nsources = [{sources}]\n')
    return path


def write_walk(folder: Path) -> None:
    """A run folder of two feet, 20 s at 200 Hz."""
    folder.mkdir()
    rows = [f"{number * 0.005},{number},0,9.75,0.5,0.5,0.5" for number in range(SAMPLES)]
    for foot in ("left_foot", "right_foot"):
        (folder / f"{foot}.csv").write_text("\n".join(["time_s,ax,ay,az,gx,gy,gz", *rows]) + "\n")


def context(folder: Path, sources: str, speed: str = "1") -> Context:
    config = write_config(folder, sources)
    return Context("sensor-gateway", load_computer(config), Options(config=config, speed=speed))


@pytest.mark.parametrize("speed", ["2", "max"])
def test_live_sensors_run_at_speed_1_only(tmp_path: Path, speed: str) -> None:
    source = '{ kind = "udp", port = 0, protocol = "ubx" }'
    with pytest.raises(ConfigError, match="live sensors run at speed 1"):
        build(context(tmp_path, source, speed))


def test_a_missing_recording_stops_the_start(tmp_path: Path) -> None:
    part = build(context(tmp_path, '{ kind = "replay", path = "gone" }'))
    with pytest.raises(RecordingError, match="gone: no such recording"):
        part.start()


def next_job(world: Context) -> Job:
    """The next that was posted."""
    return next(world.inbox.jobs(time.monotonic() + PATIENCE_S))


def test_an_unplugged_sensor_is_degraded_and_a_stop_loses_nothing(tmp_path: Path) -> None:
    """Seven samples make no batch of ten: they still go out when the service stops."""
    device = PtyDevice(tmp_path)
    imu = '{ system = 1, place = "left_foot" }'
    world = context(tmp_path, f'{{ kind = "serial", port = "{device.path}", imus = [{imu}] }}')
    part = build(world)
    part.start()
    wait_until(lambda: "could not open port" in part.figures().note)
    assert part.figures().state == "degraded"
    device.plug()
    wait_until(lambda: part.figures().counters["serial0.opened"] == 1)
    frames = b"".join([*MavlinkSender().imus(0, 7), MavlinkSender(system=9).imu(0)])
    device.write(frames)
    wait_until(lambda: part.figures().counters["serial0.bytes"] == len(frames))
    out: list[Envelope] = []
    while (part.figures().counters.get("serial0.frames", 0)) < 8:
        out += next_job(world)()
    figures = part.figures()
    assert figures.state == "ok"
    assert figures.note == "serial0: not mapped: imu of system 9 component 1 instance 0"
    world.finish()
    out += part.close()
    assert [len(envelope.message.times) for envelope in out if isinstance(envelope.message, ImuBatch)] == [7]
    device.unplug()


def test_a_receiver_tells_how_wrong_the_computer_s_clock_is(tmp_path: Path) -> None:
    """An hour ahead: gauge, counter and note say so, and it is logged once."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind(("127.0.0.1", 0))
        port = sender.getsockname()[1]
    world = context(tmp_path, f'{{ kind = "udp", port = {port}, protocol = "ubx" }}')
    host_ns = [UTC_NS + 3600 * S]
    world.clock = ScaledClock(1.0, 0, lambda: host_ns[0])
    part = build(world)
    with structlog.testing.capture_logs() as logs:
        world.log = structlog.get_logger()
        part.start()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for second in range(8):
                host_ns[0] = UTC_NS + (3600 + second) * S
                sender.sendto(pvt_at(UTC_NS + second * S), ("127.0.0.1", port))
                told = next_job(world)()
                assert [envelope.message.time_ns for envelope in told] == [UTC_NS + second * S]
                assert list(part.tick(host_ns[0])) == []
        figures = part.figures()
    world.finish()
    list(part.close())
    assert (figures.gauges["utc_offset_s"], figures.counters["utc_offset_steps"]) == (-3600.0, 1)
    assert figures.note == "this computer's clock is 3600.0 s ahead of satellite time"
    assert [entry["utc_offset_s"] for entry in logs] == [-3600.0]


@contextmanager
def gateway_process(config: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", "from sensor_gateway.main import main; main()", "--config", str(config)]
    process = subprocess.Popen(
        [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.processes
def test_a_replay_over_the_real_bus_is_what_the_pure_function_says(tmp_path: Path) -> None:
    """As fast as possible, nothing lost, same bytes; then the process ends by its own wish."""
    write_walk(tmp_path / "walk")
    config = write_config(tmp_path, '{ kind = "replay", path = "walk", exit_when_done = true }')
    received: list[Envelope] = []
    with running_router() as router:
        bus = open_bus(router, lossless=True)
        bus.subscribe(A1.selector("imu"), received.append)
        with gateway_process(config, "--router", router, "--speed", "max") as process:
            assert process.wait(30.0) == 0, process.communicate()[1]
        (run,) = load_runs([tmp_path / "walk"])
        expected = list(run_messages(run, A1, DEFAULT_START_NS))
        wait_until(lambda: len(received) == len(expected), what="all batches")
        bus.close()
    for source in ("left_foot", "right_foot"):
        assert payloads(received, source) == payloads(expected, source)


def payloads(envelopes: list[Envelope], source: str) -> list[bytes]:
    return [wire.encode(envelope.message) for envelope in envelopes if envelope.address.source == source]


@pytest.mark.processes
def test_a_looped_replay_at_a_multiple_of_speed_counts_on(tmp_path: Path) -> None:
    """40 times as fast, twenty seconds take half a second; the second loop's numbers and times go on."""
    write_walk(tmp_path / "walk")
    config = write_config(tmp_path, '{ kind = "replay", path = "walk", loop = true }')
    received: list[Envelope] = []
    healths: list[Health] = []
    batches_per_loop = SAMPLES // 10
    with running_router() as router:
        bus = open_bus(router)
        bus.subscribe(A1.selector("imu", "left_foot"), received.append)
        bus.subscribe(
            A1.selector("health"),
            lambda envelope: (
                healths.append(envelope.message) if isinstance(envelope.message, Health) else None
            ),
        )
        with gateway_process(config, "--router", router, "--speed", "40") as process:
            wait_until(lambda: len(received) > batches_per_loop + 20, what="a second loop")
            wait_until(lambda: any(health.counters.get("replay0.loops") for health in healths), what="health")
            process.terminate()
            assert process.wait(10.0) == 0
        bus.close()
    sequences = [envelope.message.sequence for envelope in received]
    times = [envelope.message.time_ns for envelope in received]
    for rising in (sequences, times):
        assert rising == sorted(set(rising))
    rates = [health.gauges.get("replay0.rate_hz.imu/left_foot", 0.0) for health in healths]
    assert max(rates) == pytest.approx(200.0, rel=0.1)


@pytest.mark.processes
def test_a_gateway_that_is_started_in_the_middle_of_a_walk_sends_what_is_still_to_come(
    tmp_path: Path,
) -> None:
    write_walk(tmp_path / "walk")
    started_s = time.time() - 10.0
    source = f'{{ kind = "replay", path = "walk", start_time_s = {started_s}, skip_past = true }}'
    received: list[Envelope] = []
    with running_router() as router, closing(open_bus(router)) as bus:
        bus.subscribe(A1.selector("imu", "left_foot"), received.append)
        with gateway_process(write_config(tmp_path, source), "--router", router):
            wait_until(lambda: len(received) >= 5, what="the rest of the walk")
    first = received[0].message
    assert first.time_ns > (started_s + 10.0) * 1e9 - 50 * 1e6  # of a batch that ends later
    assert first.sequence == round((first.time_ns / 1e9 - started_s) * 200.0 / 10.0)
    assert [one.message.sequence - first.sequence for one in received[:5]] == list(range(5))
