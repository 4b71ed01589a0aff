"""Examines one computer: configuration, folders, clock, router, services, and what each room knows of its own."""

import ctypes
import platform
import sys
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Final

from bootprint.config import Computer, load_computer
from bootprint.errors import BusError, ConfigError
from bootprint.findings import GROUP, Finding, folder
from bootprint.keys.findings import key_findings
from bootprint.upkeep import configured
from bootprint.zenoh_bus import open_bus

_CLOCK_UNSYNCHRONISED: Final = 5  # TIME_ERROR of adjtimex(2)
_TIMEX_BYTES: Final = 512
_ROUTER_WAIT_S: Final = 1.0


def examine(config: Path) -> Iterator[Finding]:
    """Everything, in the order in which it is best mended."""
    yield _versions()
    yield _clock()
    try:
        computer = load_computer(config)
    except ConfigError as error:
        yield Finding("fault", "configuration", str(error))
        return
    yield _belongs(computer)
    yield from folder("state", computer.state_dir)
    yield from key_findings(computer, datetime.now(UTC))
    yield from _rooms(computer)
    yield from _running(computer)


def _versions() -> Finding:
    python = platform.python_version()
    what = f"bootprint {version('bootprint')}, Python {python}, zenoh {version('eclipse-zenoh')}"
    return Finding(
        "ok" if sys.version_info >= (3, 11) else "fault", "versions", f"{what}, {platform.machine()}"
    )


def _clock() -> Finding:
    """Whether the kernel thinks that its clock is kept right by somebody (NTP, GPS)."""
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    if state == _CLOCK_UNSYNCHRONISED:
        mend = "`timedatectl set-ntp true`, or leave it to a GNSS receiver: the gateway corrects its stamps by one"
        return Finding("warning", "clock", "not synchronised", mend)
    return (
        Finding("ok", "clock", "synchronised")
        if state >= 0
        else Finding("warning", "clock", "cannot be asked")
    )


def _belongs(computer: Computer) -> Finding:
    member, services = computer.member, configured(computer)
    callsign = member.callsign or "no callsign"
    who = f"{computer.path}: {member.id} ({callsign}) of {member.unit} in realm {computer.realm.id}"
    if not services:
        return Finding("fault", "configuration", f"{who} runs nothing", "add a section [gateway] or [hub]")
    return Finding("ok", "configuration", f"{who} runs {', '.join(services)}")


def _rooms(computer: Computer) -> Iterable[Finding]:
    """What the rooms whose services run here know; each examines its own section."""
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        if entry.name in configured(computer):
            yield from entry.load()(computer)


def _running(computer: Computer) -> Iterator[Finding]:
    try:
        bus = open_bus(computer.router, credentials=computer.credentials, timeout_s=_ROUTER_WAIT_S)
    except BusError as error:
        yield Finding("warning", "router", str(error), f"`bootprint up {computer.path}` runs everything")
        return
    yield Finding("ok", "router", f"answers at {computer.router}")
    try:
        alive = {key.rsplit("/", 1)[1] for key in bus.alive(computer.identity.selector("health"))}
    finally:
        bus.close()
    for name in configured(computer):
        if name in alive:
            yield Finding("ok", name, "runs")
        else:
            yield Finding(
                "warning", name, "does not run", f"`bootprint up {computer.path}`, or start it alone"
            )
