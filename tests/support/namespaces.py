"""Two network namespaces joined by a cable that is as slow and lossy as a radio; needs root, and says so."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

_TOOLS = ("ip", "tc", "iptables")


@dataclass(frozen=True)
class Place:
    """One namespace: its name, the cable's end in it, and its address."""

    name: str
    device: str
    address: str

    @property
    def within(self) -> tuple[str, ...]:
        """What stands before a command that is to run here."""
        return "ip", "netns", "exec", self.name

    def run(self, *command: str) -> str:
        """Run a command here."""
        return _run(*self.within, *command)

    def sent_bytes(self) -> int:
        """Bytes that left by the cable, Ethernet headers included, as the kernel counted them."""
        return int(self.run("cat", f"/sys/class/net/{self.device}/statistics/tx_bytes"))

    def link(self, state: str) -> None:
        """Pull the cable's end (``down``) or put it back (``up``)."""
        self.run("ip", "link", "set", self.device, state)


@contextmanager
def cable(rate_bits_per_s: int, loss: float) -> Iterator[tuple[Place, Place]]:
    """Two places joined; every direction is shaped to a rate and loses a share of its datagrams at random.

    Neighbours are told, IPv6 is off: nothing but what hubs say is on the cable.
    """
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if os.geteuid() != 0 or missing:
        pytest.skip(
            f"NEEDS ROOT and {', '.join(_TOOLS)} for network namespaces (missing: {missing or 'root'})"
        )
    mark = f"bp{os.getpid() % 100_000}"
    places = tuple(Place(f"{mark}n{n}", f"{mark}v{n}", f"10.77.0.{n}") for n in (1, 2))
    made: list[str] = []
    try:
        for place in places:
            try:
                _run("ip", "netns", "add", place.name)
            except subprocess.CalledProcessError as error:
                pytest.skip(f"NETWORK NAMESPACES cannot be made here: {error.stderr.strip()}")
            made.append(place.name)
        _run("ip", "link", "add", places[0].device, "type", "veth", "peer", "name", places[1].device)
        for place in places:
            _run("ip", "link", "set", place.device, "netns", place.name)
        for place in places:
            _prepare(place, rate_bits_per_s, loss)
        for place, other in (places, places[::-1]):
            address = other.run("cat", f"/sys/class/net/{other.device}/address").strip()
            place.run("ip", "neigh", "add", other.address, "lladdr", address, "dev", place.device)
        yield places[0], places[1]
    finally:
        for name in made:
            subprocess.run(["ip", "netns", "del", name], check=False)


def _prepare(place: Place, rate_bits_per_s: int, loss: float) -> None:
    # Before the cable is up: nothing shall be said on it by itself.
    place.run("sh", "-c", "echo 1 > /proc/sys/net/ipv6/conf/all/disable_ipv6")
    place.run("ip", "address", "add", f"{place.address}/24", "dev", place.device)
    place.run("ip", "link", "set", place.device, "up")
    shape = ("rate", f"{rate_bits_per_s}bit", "burst", "2000", "latency", "10s")
    place.run("tc", "qdisc", "add", "dev", place.device, "root", "tbf", *shape)
    drop = ("-m", "statistic", "--mode", "random", "--probability", str(loss), "-j", "DROP")
    place.run("iptables", "-A", "INPUT", "-p", "udp", *drop)


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=20).stdout
