"""The sa-hub process: two real hubs with routers of their own, joined by nothing but a UDP link."""

import socket
import subprocess
import time
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.messages import Health, Position
from proving_ground.exercises.processes.free_ports import free_ports
from support.hub_processes import A1, CP, command, running, write_computer, write_realm
from support.hub_squad import START_NS, S, Walk, position
from support.waiting import wait_until

pytestmark = pytest.mark.processes
LINK = 'bind = "127.0.0.1:{}"\npeers = ["127.0.0.1:{}"]\nrate_bits_per_s = 9600'


@pytest.fixture
def realm(tmp_path: Path) -> Path:
    """A folder with realm and key."""
    write_realm(tmp_path)
    return tmp_path


def test_a_position_crosses_the_radio_and_becomes_a_track(realm: Path) -> None:
    one, two = free_ports(2, socket.SOCK_DGRAM)
    soldier = write_computer(realm, "a1", 'role = "soldier"', LINK.format(one, two))
    post = write_computer(realm, "cp", 'role = "command_post"', LINK.format(two, one))
    with running(soldier, A1) as a1, running(post, CP) as cp:
        template = position("a1", START_NS, Walk()).message
        assert isinstance(template, Position)

        def tell() -> bool:
            now = Position(**{**_fields(template), "time_ns": time.time_ns()})
            a1.bus.publish(Envelope(A1.address("position", "fusion"), now))
            return bool(cp.tracks)

        wait_until(tell, what="the track at the command post")
        wait_until(lambda: any(_has_latency(message) for message in a1.health), what="the latency gauge")
    track = cp.tracks[0]
    assert (track.soldier, track.callsign, track.via, track.state) == ("a1", "Alpha 1", "net", "fresh")
    assert track.latitude_deg == pytest.approx(59.35, abs=2e-5)
    assert abs(track.time_ns - time.time_ns()) < 60 * S
    assert (realm / "cp" / "state" / "radio" / "net.heard").exists()
    assert (realm / "a1" / "state" / "radio" / "net.counters").exists()


def _fields(message: Position) -> dict[str, object]:
    return {name: getattr(message, name) for name in message.__struct_fields__}


def _has_latency(message: Health) -> bool:
    return 0.0 < message.gauges.get("latency_p99_ms", 0.0) < 5000.0


@pytest.mark.parametrize(
    "fault", ["no key", "open key", "short key", "unknown key in [hub]", "bad counters", "lost counters"]
)
def test_what_is_wrong_is_said_in_one_line_and_exit_2(realm: Path, fault: str) -> None:
    config = write_computer(realm, "a1", 'role = "soldier"', LINK.format(0, 9))
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
