"""A crowd on the air: every soldier's own frames, twice a second, to a command post's real process.

``python -m support.crowd FOLDER PORT SOLDIERS`` is the crowd, a process of its own that ends with its standard
input; `crowded_post` is the command post, with archive and page, among them.
"""

import math
import random
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import psutil

from bootprint.config import load_realm
from bootprint.geodesy import LocalFrame
from bootprint.messages import Health
from bootprint.zenoh_bus import ZenohBus, open_bus
from proving_ground.exercises.processes.free_ports import free_ports
from sa_hub.keys import load_group_key
from sa_hub.radio.content import Report, Reports
from sa_hub.radio.counters import MemoryCounters
from sa_hub.radio.frame import Codec
from sa_hub.radio.net_keys import NetKeys
from sa_hub.radio.seal import Sealer
from support.hub_processes import CP, command, write_computer, write_realm
from support.routers import running_router
from support.waiting import wait_until

PERIOD_S: Final = 0.5
_SQUAD: Final = 12
_SPREAD_M: Final = 700.0
_PACE_M_S: Final = 1.3
_TURN_RAD: Final = 0.05
_RESOLUTION: Final = 1
_SLOT_S: Final = 0.02
_NET: Final = "net"
_TAG_BYTES: Final = 8


@dataclass
class CrowdedPost:
    """A running command post's process among a crowd; ``address`` is its page's."""

    address: str
    process: psutil.Process
    bus: ZenohBus

    def cpu_s(self) -> float:
        """Processor time that its hub has taken."""
        times = self.process.cpu_times()
        return float(times.user + times.system)

    def counters(self) -> dict[str, int]:
        """The hub's, by its newest word on its health."""
        inlet = self.bus.open_inlet(CP.selector("health", "sa-hub"))
        heard: list[Health] = []

        def has_told() -> bool:
            heard.extend(each.message for each in inlet.take() if isinstance(each.message, Health))
            return bool(heard)

        wait_until(has_told, what="the hub's health")
        return heard[-1].counters


@contextmanager
def crowded_post(folder: Path, soldiers: int) -> Iterator[CrowdedPost]:
    """Start hub and crowd; the page answers."""
    (page,), (radio,) = free_ports(1, socket.SOCK_STREAM), free_ports(1, socket.SOCK_DGRAM)
    write_realm(folder, _roster(soldiers))
    hub = f'role = "command_post"\n[hub.history]\n[hub.page]\nport = {page}\nreads_per_s = 1000.0'
    way = f'bind = "127.0.0.1:{radio}"\npeers = ["127.0.0.1:9"]\nrate_bits_per_s = 1_000_000'
    config = write_computer(folder, "cp", hub, way)
    crowd = [sys.executable, "-m", "support.crowd", str(folder), str(radio), str(soldiers)]
    with (
        running_router(f"unixsock-stream/{folder / 'router'}") as router,
        _ended(subprocess.Popen(command(config, "--router", router), stderr=subprocess.DEVNULL)) as process,
        _ended(subprocess.Popen(crowd, stdin=subprocess.PIPE)),
    ):
        bus = open_bus(router)
        address = f"http://127.0.0.1:{page}/"
        wait_until(lambda: _answers(address), what="the page")
        yield CrowdedPost(address, psutil.Process(process.pid), bus)
        bus.close()


@contextmanager
def _ended(process: "subprocess.Popen[bytes]") -> "Iterator[subprocess.Popen[bytes]]":
    """End a process in the end."""
    try:
        yield process
    finally:
        process.terminate()
        process.wait(timeout=60)
        if process.stdin is not None:
            process.stdin.close()


def _answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(f"{address}api/v1/post", timeout=30.0):
            return True
    except OSError:
        return False


def _roster(soldiers: int) -> list[str]:
    """Squads of twelve, and the post."""
    squads = [
        f'{{ id = "s{n}", number = {n}, unit = "squad-{(n - 1) // _SQUAD + 1:02d}", callsign = "S{n}" }}'
        for n in range(1, soldiers + 1)
    ]
    return [*squads, f'{{ id = "cp", number = {soldiers + 1}, unit = "hq", callsign = "Zero" }}']


class _Walker:
    """One of the crowd: walks in wide circles, and seals reports of it."""

    def __init__(
        self, number: int, keys: NetKeys, codec: Codec, frame: LocalFrame, dice: random.Random
    ) -> None:
        self._number, self._codec, self._frame = number, codec, frame
        self._sealer = Sealer(keys, number, MemoryCounters())
        self._place_m = [dice.uniform(-_SPREAD_M, _SPREAD_M) for _ in range(2)]
        self._heading_rad = dice.uniform(0.0, 2.0 * math.pi)

    def sealed(self, now_ns: int) -> bytes:
        """The next report's frame."""
        self._heading_rad += _TURN_RAD
        east_m_s, north_m_s = (_PACE_M_S * turn(self._heading_rad) for turn in (math.sin, math.cos))
        self._place_m[0] += PERIOD_S * east_m_s
        self._place_m[1] += PERIOD_S * north_m_s
        latitude_deg, longitude_deg, height_m = self._frame.to_geodetic(
            self._place_m[0], self._place_m[1], 0.0
        )
        report = Report(
            self._number,
            now_ns,
            latitude_deg,
            longitude_deg,
            1.5,
            east_m_s,
            north_m_s,
            height_m,
            floor=self._number % 3,
        )
        payload = self._codec.encode(self._number, Reports((report,)), _RESOLUTION, 1000)
        return self._sealer.seal(payload, now_ns)


def main(folder: Path, port: int, soldiers: int) -> None:
    """Walk and report until standard input ends, evenly over time."""
    ended = threading.Event()
    threading.Thread(target=_wait_for_end, args=(ended,), daemon=True).start()
    realm, dice = load_realm(folder / "realm.toml"), random.Random(2)
    keys = NetKeys(load_group_key(folder / "keys" / "group.key"), _NET, _TAG_BYTES)
    codec, frame = Codec(realm.origin), LocalFrame(realm.origin)
    crowd = [_Walker(n, keys, codec, frame, dice) for n in range(1, soldiers + 1)]
    began, told = time.monotonic(), 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as radio:
        while not ended.wait(_SLOT_S):
            due = int((time.monotonic() - began) / PERIOD_S * soldiers)
            for turn in range(told, due):
                radio.sendto(crowd[turn % soldiers].sealed(time.time_ns()), ("127.0.0.1", port))
            told = due


def _wait_for_end(ended: threading.Event) -> None:
    sys.stdin.read()
    ended.set()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
