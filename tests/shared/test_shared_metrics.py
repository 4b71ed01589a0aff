"""What Prometheus is told: read back by its own parser."""

import subprocess
import sys
from contextlib import closing
from pathlib import Path
from urllib.request import urlopen

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.commands.metrics import BusMetrics
from bootprint.messages import Health, Pressure
from bootprint.topics import Identity
from bootprint.zenoh_bus import open_bus
from support.routers import running_router
from support.waiting import wait_until

ME = Identity("bp", "alpha", "a1")
HEALTH = Health(
    time_ns=5,
    service="sensor-gateway",
    state="degraded",
    counters={"mavlink0.bytes": 12},
    gauges={"memory_mb": 40.5},
)
WHO = (("service", "sensor-gateway"), ("soldier", "a1"))


def samples(text: str) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def told(collector: BusMetrics) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    registry = CollectorRegistry(auto_describe=False)
    registry.register(collector)
    return samples(generate_latest(registry).decode())


def test_health_becomes_counters_gauges_and_a_state() -> None:
    collector = BusMetrics()
    collector.observe(ME.address("health", "sensor-gateway").key, wire.encode(HEALTH))
    found = told(collector)
    assert found["bootprint_mavlink0_bytes_total", WHO] == 12
    assert found["bootprint_memory_mb", WHO] == 40.5
    states = {
        dict(labels)["state"]: value for (name, labels), value in found.items() if name == "bootprint_state"
    }
    assert states["degraded"] == 1
    assert sum(states.values()) == 1
    assert 0.0 <= found["bootprint_health_age_seconds", WHO] < 60.0


def test_rates_stand_beside_what_is_expected() -> None:
    collector = BusMetrics()
    key = ME.address("pressure", "baro").key
    for number in range(11):
        collector.observe(key, wire.encode(Pressure(time_ns=number * 1_000_000_000, pressure_pa=1e5)))
    collector.observe("bp/@v1/alpha/a1/health/fusion", b"\xc1 no health")
    found = told(collector)
    assert found["bootprint_rate_hz", (("key", key),)] == 1.0
    assert found["bootprint_rate_expected_hz", (("key", key),)] == 10.0
    assert found["bootprint_rate_off", (("key", key), ("state", "slow"))] == 1.0
    assert found["bootprint_messages_total", (("key", key),)] == 11


def test_the_command_writes_what_the_bus_tells(tmp_path: Path) -> None:
    path = tmp_path / "bootprint.prom"
    with running_router() as router, closing(open_bus(router)) as bus:
        options = ("--router", router, "--textfile", str(path), "--duration", "60", "--port", "0")
        command = [str(Path(sys.executable).parent / "bootprint"), "bus", "metrics", *options]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        url = process.stderr.readline().strip()

        def scraped() -> str:
            bus.publish(Envelope(ME.address("health", "sensor-gateway"), HEALTH))
            with urlopen(url) as answer:
                return str(answer.read().decode())

        wait_until(lambda: "bootprint_memory_mb" in scraped(), what="the service's memory")
        process.terminate()
        assert process.wait(15.0) == 0
        process.stderr.close()
    assert samples(path.read_text())["bootprint_memory_mb", WHO] == 40.5
