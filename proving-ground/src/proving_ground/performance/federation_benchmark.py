"""`bootprint benchmark federation`: command posts whose routers are all joined over TLS, and what that costs.

Real guarded routers on loopback, each joined to every other, each with a hub's session that sends frames to all.
All in one process, so processor time and memory are those of the whole federation.
"""

import resource
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Final

import typer

from bootprint.commands.options import Json, write_json
from bootprint.config import Computer, load_computer
from bootprint.errors import BootprintError
from bootprint.keys.authority import Authority, create_authority
from bootprint.keys.bundle import install, new_code, open_bundle, pack
from bootprint.keys.contents import configuration_files
from bootprint.keys.routing import guarded_settings
from bootprint.topics import FRAMES
from bootprint.zenoh_bus import EmbeddedRouter, ZenohBus, open_bus
from proving_ground.exercises.processes.free_ports import free_ports

SIZES: Final = (2, 6, 12)
_REALM: Final = "brigade"
_FRAME_BYTES: Final = 120
_PATIENCE_S: Final = 60.0
_SETTLE_S: Final = 0.5
_PAGE_BYTES: Final = resource.getpagesize()


@dataclass(frozen=True, slots=True)
class FederationRow:
    """A federation: its posts, TLS links between them, until all hear all, cost of a frame by delivery, memory."""

    posts: int
    links: int
    joined_s: float
    frames_sent: int
    frames_heard: int
    cpu_us_per_delivery: float
    memory_mb_per_post: float


def measure(posts: int, rounds: int) -> FederationRow:
    """One federation of so many posts; each sends ``rounds`` frames that all others are to hear."""
    with TemporaryDirectory() as folder, ExitStack() as stack:
        computers = _computers(Path(folder), posts)
        before_mb, began_s = _resident_mb(), time.monotonic()
        for computer in computers:
            stack.enter_context(closing(EmbeddedRouter(computer.router, guarded_settings(computer))))
        members = [stack.enter_context(closing(_Member(computer))) for computer in computers]
        _until_all_hear_all(members)
        joined_s, memory_mb = time.monotonic() - began_s, _resident_mb() - before_mb
        time.sleep(_SETTLE_S)
        heard_before, cpu_s = sum(member.heard for member in members), time.process_time()
        for _ in range(rounds):
            for member in members:
                member.say()
            time.sleep(0.01)  # frames come one by one on a radio too, not all at once
        expected = rounds * posts * (posts - 1)
        _wait(lambda: sum(member.heard for member in members) - heard_before >= expected, patience_s=10.0)
        heard = sum(member.heard for member in members) - heard_before
        return FederationRow(
            posts=posts,
            links=posts * (posts - 1) // 2,
            joined_s=joined_s,
            frames_sent=rounds * posts,
            frames_heard=heard,
            cpu_us_per_delivery=1e6 * (time.process_time() - cpu_s) / max(1, heard),
            memory_mb_per_post=memory_mb / posts,
        )


class _Member:
    """A hub's session at its own post's router: it speaks for itself, and hears the others."""

    def __init__(self, computer: Computer) -> None:
        self.heard = 0
        self.senders: set[str] = set()
        self._own = f"{_REALM}/{FRAMES}/posts/{computer.member.number}"
        self._bus: ZenohBus = open_bus(computer.router, credentials=computer.credentials)
        self._bus.subscribe_raw(f"{_REALM}/{FRAMES}/posts/*", self._hear)
        self._put = self._bus.raw_publisher(self._own)

    def _hear(self, key: str, _payload: bytes) -> None:
        if key != self._own:
            self.heard += 1
            self.senders.add(key)

    def say(self) -> None:
        self._put(bytes(_FRAME_BYTES))

    def close(self) -> None:
        self._bus.close()


def _until_all_hear_all(members: Sequence[_Member]) -> None:
    def told() -> bool:
        for member in members:
            member.say()
        return all(len(member.senders) == len(members) - 1 for member in members)

    if not _wait(told, patience_s=_PATIENCE_S):
        raise BootprintError(f"{len(members)} posts did not hear each other within {_PATIENCE_S:g} s")


def _wait(condition: Callable[[], bool], patience_s: float) -> bool:
    deadline = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def _computers(folder: Path, posts: int) -> list[Computer]:
    """A realm of command posts, each with its certificate; every one joins those before it."""
    roster = "".join(
        f'    {{ id = "p{n}", number = {n}, unit = "hq{n}", role = "command_post" }},\n' for n in range(posts)
    )
    realm = f'id = "{_REALM}"\norigin = {{ latitude_deg = 59.35, longitude_deg = 18.07 }}\nroster = [\n{roster}]\n'
    authority = create_authority(folder / "authority", _REALM, 30, datetime.now(UTC))
    for number in range(posts):
        authority = authority.issue(f"p{number}", (), 20, datetime.now(UTC))
    routers = [f"tls/127.0.0.1:{port}" for port in free_ports(posts, socket.SOCK_STREAM)]
    return [_computer(folder, authority, realm, number, routers) for number in range(posts)]


def _computer(folder: Path, authority: Authority, realm: str, number: int, routers: list[str]) -> Computer:
    planned = folder / "planned" / str(number)
    planned.mkdir(parents=True)
    joined = ", ".join(f'"{router}"' for router in routers[:number])
    (planned / "realm.toml").write_text(realm, encoding="utf-8")
    (planned / "computer.toml").write_text(
        f'realm = "realm.toml"\nsoldier = "p{number}"\nrouter = "{routers[number]}"\n[bus]\nconnect = [{joined}]\n',
        encoding="utf-8",
    )
    name, code = f"p{number}", new_code()
    files = configuration_files(planned / "computer.toml", name, _REALM)
    install(open_bundle(pack(authority, name, files, code), code, name), folder / name, name, update=False)
    return load_computer(folder / name / "computer.toml")


def _resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * _PAGE_BYTES / 1e6


def federation(
    posts: Annotated[list[int] | None, typer.Option(help="So many posts; repeatable.", min=2, max=40)] = None,
    rounds: Annotated[int, typer.Option(help="Frames that each post sends.", min=1)] = 100,
    json: Json = None,
) -> None:
    """Join command posts over TLS, all with all, and measure what a frame from each to all others costs.

    Example: bootprint benchmark federation --posts 6
    """
    rows = [measure(size, rounds) for size in posts or SIZES]
    if json is not None:
        write_json([asdict(row) for row in rows], json)
        return
    for row in rows:
        typer.echo(
            f"{row.posts:>3} posts, {row.links:>3} links: all hear all after {row.joined_s:.1f} s; "
            f"{row.frames_heard} frames delivered, {row.cpu_us_per_delivery:.0f} us of processor each; "
            f"{row.memory_mb_per_post:.0f} MB a post"
        )
