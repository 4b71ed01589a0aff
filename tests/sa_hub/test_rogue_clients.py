"""Strangers at a command post: without certificate, with another's, with a revoked one, with a recorded radio.

A real router and a real hub process; whatever they try, its picture is that of the honest soldier alone, and the
router's or the hub's health tells of each attempt.
"""

import json
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import pytest
import zenoh

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Computer
from bootprint.errors import BusError
from bootprint.keys.authority import Authority
from bootprint.keys.credentials import Credentials
from bootprint.messages import Fix, Health, Message, Track
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus
from bootprint.zenoh_config import client_settings
from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.assembly import build_hub
from sa_hub.keys import load_group_key
from sa_hub.radio.counters import MemoryCounters
from sa_hub.settings import HubSettings, LinkProfile
from support.guarded import (
    A3,
    A4,
    CP,
    guarded_process,
    make_authority,
    make_computer,
    secure_endpoint,
    shown_by,
    strangers,
)
from support.hub_processes import command
from support.hub_squad import START_NS, Walk, position
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes")]
LATITUDE, LONGITUDE = 59.35, 18.07


@dataclass
class Post:
    """A command post at work, and what an honest listener on its bus hears."""

    authority: Authority
    computer: Computer
    bus: ZenohBus
    port: int
    tracks: list[Track] = field(default_factory=list)
    health: dict[str, Health] = field(default_factory=dict)

    def listen(self) -> None:
        for subject in ("track", "health"):
            self.bus.subscribe(CP.selector(subject), lambda envelope: self._keep(envelope.message))

    def _keep(self, message: Message) -> None:
        match message:
            case Track():
                self.tracks.append(message)
            case Health():
                self.health[message.service] = message

    def count(self, service: str, counter: str) -> int:
        return self.health[service].counters.get(counter, 0) if service in self.health else 0

    def shown(self, soldier: str) -> set[tuple[float, float]]:
        """Where a soldier was ever shown, to about 10 m."""
        return {
            (round(track.latitude_deg, 4), round(track.longitude_deg, 4))
            for track in self.tracks
            if track.soldier == soldier
        }

    def rogue(self, name: str) -> zenoh.Session:
        """A session that keeps to none of our manners, with a certificate that it got hold of."""
        settings = client_settings(self.computer.router, shown_by(self.authority, name))
        return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))

    def open(self, credentials: Credentials | None, timeout_s: float = 5.0) -> ZenohBus:
        return open_bus(self.computer.router, credentials=credentials, timeout_s=timeout_s)


@pytest.fixture(scope="module")
def post(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Post]:
    folder = tmp_path_factory.mktemp("post")
    authority = make_authority(folder, "a5")
    (port,) = free_ports(1, socket.SOCK_DGRAM)
    computer = make_computer(
        authority,
        "cp",
        f'router = "{secure_endpoint()}"\n[hub]\nrole = "command_post"\n'
        f'[[hub.links]]\nname = "net"\nbind = "127.0.0.1:{port}"\nrate_bits_per_s = 9600\n',
    )
    with (
        guarded_process(computer),
        _hub(computer),
        closing(open_bus(computer.router, credentials=computer.credentials, timeout_s=30.0)) as bus,
    ):
        made = Post(authority, computer, bus, port)
        made.listen()
        wait_until(lambda: len(made.health) == 2, 30.0, "health of router and hub")
        wait_until(lambda: placed(made), what="the post's own place")
        yield made


def placed(post: Post) -> bool:
    """The control: the same message that strangers will try moves the post's own track, if the post says it."""
    fix = Fix(time_ns=time.time_ns(), latitude_deg=LATITUDE, longitude_deg=LONGITUDE, accuracy_m=1.0)
    post.bus.publish(Envelope(CP.address("fix", "person"), fix))
    return (LATITUDE, LONGITUDE) in post.shown("cp")


@contextmanager
def _hub(computer: Computer) -> Iterator[None]:
    waiting = ("--router-wait", "30")
    process = subprocess.Popen([*command(computer.path, *waiting)], stderr=subprocess.DEVNULL)
    try:
        yield
        process.terminate()
        assert process.wait(timeout=30) == 0
    finally:
        process.kill()
        process.wait()


def frames_of_a3(post: Post, count: int) -> list[bytes]:
    """What the air carries of an honest soldier who stands at the realm's origin."""
    realm = post.computer.realm
    key = load_group_key(post.computer.keys_dir / "group.key")
    settings = HubSettings(links=(LinkProfile(name="net", rate_bits_per_s=9600),), heartbeat_s=1.0)
    core = build_hub(realm, realm.member("a3"), settings, key, lambda _net: MemoryCounters())
    now_ns = time.time_ns()
    standing = position("a3", START_NS, Walk()).message
    frames: list[bytes] = []
    for step in range(600):
        stamp_ns = now_ns - (600 - step) * 100_000_000
        message = msgspec.structs.replace(standing, time_ns=stamp_ns)
        core.handle(Envelope(A3.address("position", "fusion"), message))
        core.tick(stamp_ns)
        frames += [frame.data for frame in core.take_frames()]
    assert len(frames) >= count
    return frames[-count:]


def rogue_fix() -> Fix:
    """The command post is in the sea, says somebody."""
    return Fix(time_ns=time.time_ns(), latitude_deg=58.0, longitude_deg=19.5, accuracy_m=1.0)


def test_who_is_admitted_is_heard(post: Post) -> None:
    assert post.shown("cp") == {(LATITUDE, LONGITUDE)}
    assert post.health["router"].gauges["sessions"] >= 2.0
    assert 19.0 < post.health["router"].gauges["certificate_days"] < 20.0


def test_without_a_certificate_of_the_realm_nobody_comes_in(post: Post) -> None:
    before = post.count("router", "refused_no_certificate")
    with pytest.raises(BusError, match="wants a certificate"):
        post.open(None)
    with pytest.raises(BusError, match="no router at"):
        post.open(strangers(post.authority.folder.parent), timeout_s=0.5)
    host, _, port = post.computer.router.removeprefix("tls/").partition(":")
    with socket.create_connection((host, int(port)), timeout=5) as plain:
        plain.sendall(b"\x01\x00 no TLS at all")
        plain.recv(64)
    wait_until(lambda: post.count("router", "refused_no_certificate") >= before + 2, what="the report")
    assert post.health["router"].state == "degraded"
    assert "without a valid certificate" in post.health["router"].note


def test_another_soldiers_certificate_says_nothing_for_others_and_hears_nothing(post: Post) -> None:
    at_post: list[str] = []
    post.bus.subscribe_raw("bp/@v1/alpha/a4/**", lambda key, _: at_post.append(key))
    before = post.count("router", "refused_denied")
    with post.rogue("a4.1") as rogue, post.rogue("a4.1") as spy:
        selectors = ("bp/@v1/hq/cp/**", "bp/@v1/**", "**")
        heard = [spy.declare_subscriber(each, zenoh.handlers.RingChannel(10)) for each in selectors]
        for source in ("person", "page"):
            rogue.put(CP.address("fix", source).key, wire.encode(rogue_fix()))
        rogue.delete(CP.address("fix", "person").key)
        # What is a4's own to say passes the same router.
        own = A4.address("fix", "person").key
        wait_until(lambda: (rogue.put(own, wire.encode(rogue_fix())), at_post)[1], what="a4's own words")
        wait_until(lambda: post.count("router", "refused_denied") >= before + 6, what="the report")
        assert [each.handler.try_recv() for each in heard] == [None] * 3
    assert "a4.1 was denied" in post.health["router"].note
    assert post.shown("cp") == {(LATITUDE, LONGITUDE)}


def test_a_revoked_certificate_does_nothing(post: Post) -> None:
    with post.rogue("a5.1") as rogue:
        for identity in (CP, Identity("bp", "alpha", "a5")):
            rogue.put(identity.address("fix", "person").key, wire.encode(rogue_fix()))
        wait_until(lambda: post.count("router", "refused_not_admitted") >= 1, what="the report")
    assert "a5.1" in post.health["router"].note
    assert post.shown("cp") == {(LATITUDE, LONGITUDE)}


def test_a_recording_of_the_air_played_again_changes_nothing(post: Post) -> None:
    frames = frames_of_a3(post, 12)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as air:
        for frame in frames:
            air.sendto(frame, ("127.0.0.1", post.port))
        wait_until(lambda: post.shown("a3"), what="the honest soldier's track")
        wait_until(lambda: post.count("sa-hub", "radio_replayed") == 0 and post.tracks, what="no report yet")
        told = len([track for track in post.tracks if track.soldier == "a3" and track.via == "net"])
        for frame in frames * 2:
            air.sendto(frame, ("127.0.0.1", post.port))
        wait_until(lambda: post.count("sa-hub", "radio_replayed") == 2 * len(frames), what="the report")
    assert post.shown("a3") == {(LATITUDE, LONGITUDE)}
    newest = max(track.time_ns for track in post.tracks if track.soldier == "a3")
    assert newest <= time.time_ns()
    assert told > 0


def test_secrets_stand_in_no_process_list(post: Post) -> None:
    secrets = [path.read_text().strip() for path in post.computer.keys_dir.glob("*.key")]
    assert len(secrets) == 2
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = path.read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
        except OSError:
            continue
        assert not any(secret in line for secret in secrets)
