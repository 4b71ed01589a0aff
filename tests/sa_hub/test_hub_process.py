"""The sa-hub process: two real hubs with routers of their own, joined by nothing but a UDP link."""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.messages import Health, Message, Position, Track
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus
from sa_hub.keys import create_group_key
from support.hub_squad import START_NS, S, Walk, position
from support.routers import running_router
from support.waiting import wait_until

pytestmark = pytest.mark.processes
REALM = """
id = "bp"
origin = { latitude_deg = 59.35, longitude_deg = 18.07, height_m = 50.0 }
roster = [
    { id = "a1", number = 1, unit = "alpha", callsign = "Alpha 1" },
    { id = "cp", number = 100, unit = "hq" },
]
"""
A1, CP = Identity("bp", "alpha", "a1"), Identity("bp", "hq", "cp")


def free_ports() -> list[int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


@pytest.fixture
def realm(tmp_path: Path) -> Path:
    """A folder with realm and key."""
    (tmp_path / "realm.toml").write_text(REALM)
    create_group_key(tmp_path / "keys" / "group.key")
    return tmp_path


def write_computer(realm: Path, soldier: str, role: str, port: int, peer: int) -> Path:
    path = realm / soldier / "computer.toml"
    path.parent.mkdir()
    path.write_text(
        f"""
realm = "../realm.toml"
soldier = "{soldier}"
keys_dir = "../keys"
[hub]
role = "{role}"
[[hub.links]]
name = "net"
bind = "127.0.0.1:{port}"
peers = ["127.0.0.1:{peer}"]
rate_bits_per_s = 9600
"""
    )
    return path


def command(config: Path, *extra: str) -> list[str]:
    code = "from sa_hub.main import main; main()"
    return [sys.executable, "-c", code, "--config", str(config), *extra]


@contextmanager
def running(config: Path, identity: Identity) -> Iterator[ZenohBus]:
    """A hub's process, alive, and a bus at its router."""
    with running_router() as router:
        process = subprocess.Popen(command(config, "--router", router), stderr=subprocess.DEVNULL)
        bus = open_bus(router)
        try:
            wait_until(lambda: bus.alive(identity.selector("health")), what="the hub's liveliness token")
            yield bus
            process.terminate()
            assert process.wait(timeout=10) == 0
        finally:
            bus.close()
            process.kill()
            process.wait()


def test_a_position_crosses_the_radio_and_becomes_a_track(realm: Path) -> None:
    one, two = free_ports()
    soldier = write_computer(realm, "a1", "soldier", one, two)
    post = write_computer(realm, "cp", "command_post", two, one)
    shown: list[Message] = []
    health: list[Message] = []
    with running(soldier, A1) as a1_bus, running(post, CP) as cp_bus:
        cp_bus.subscribe(CP.selector("track"), lambda envelope: shown.append(envelope.message))
        a1_bus.subscribe(A1.selector("health"), lambda envelope: health.append(envelope.message))
        template = position("a1", START_NS, Walk()).message
        assert isinstance(template, Position)

        def tell() -> bool:
            now = Position(**{**_fields(template), "time_ns": time.time_ns()})
            a1_bus.publish(Envelope(A1.address("position", "fusion"), now))
            return bool(shown)

        wait_until(tell, what="the track at the command post")
        wait_until(lambda: any(_has_latency(message) for message in health), what="the latency gauge")
    track = shown[0]
    assert isinstance(track, Track)
    assert (track.soldier, track.callsign, track.via, track.state) == ("a1", "Alpha 1", "net", "fresh")
    assert track.latitude_deg == pytest.approx(59.35, abs=2e-5)
    assert abs(track.time_ns - time.time_ns()) < 60 * S
    assert (realm / "cp" / "state" / "radio" / "net.heard").exists()
    assert (realm / "a1" / "state" / "radio" / "net.counters").exists()


def _fields(message: Position) -> dict[str, object]:
    return {name: getattr(message, name) for name in message.__struct_fields__}


def _has_latency(message: Message) -> bool:
    return isinstance(message, Health) and 0.0 < message.gauges.get("latency_p99_ms", 0.0) < 5000.0


@pytest.mark.parametrize(
    "fault", ["no key", "open key", "short key", "unknown key in [hub]", "bad counters", "lost counters"]
)
def test_what_is_wrong_is_said_in_one_line_and_exit_2(realm: Path, fault: str) -> None:
    config = write_computer(realm, "a1", "soldier", 0, 9)
    key = realm / "keys" / "group.key"
    match fault:
        case "no key":
            key.unlink()
        case "open key":
            key.chmod(0o644)
        case "short key":
            key.write_text("00" * 16)
        case "unknown key in [hub]":
            config.write_text(config.read_text().replace("[hub]", "[hub]\nheartbeat = 3"))
        case "lost counters":
            (realm / "a1" / "state" / "radio").mkdir(parents=True)
            (realm / "a1" / "state" / "radio" / "net.heard").write_text('{"clean": true, "senders": {}}')
        case _:
            (realm / "a1" / "state" / "radio").mkdir(parents=True)
            (realm / "a1" / "state" / "radio" / "net.counters").write_text("{")
    ended = subprocess.run(command(config), capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert str(realm) in ended.stderr
