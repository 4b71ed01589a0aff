"""All that runs on one computer, kept running: its router, its services, and what systemd is told of them."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import structlog

from bootprint.bus import Envelope
from bootprint.config import Computer
from bootprint.errors import BusError, ConfigError
from bootprint.messages import Health
from bootprint.notify import notify
from bootprint.processes import ProcessGroup, ProcessSpec
from bootprint.stopping import Stop
from bootprint.supervision import Supervisor
from bootprint.zenoh_bus import ZenohBus, open_bus

ROUTER: Final = "router"
SENSING: Final = ("pdr-engine", "fusion", "sensor-gateway")
HUB: Final = "sa-hub"
_ROUTER_COMMAND: Final = "bootprint"
LOOK_S: Final = 0.1
"""Between two looks at the processes: how late an end is noticed."""
_NOTIFY_S: Final = 1.0
_ROUTER_WAIT_S: Final = 30


def configured(computer: Computer) -> tuple[str, ...]:
    """The services that have work on this computer, by the sections of its file."""
    sensing = SENSING if computer.sections["gateway"] else ()
    return (*sensing, *((HUB,) if computer.sections["hub"] else ()))


def chosen(computer: Computer, only: str) -> tuple[str, ...]:
    """Those named in ``only`` (``a,b``), all if it is empty; ConfigError if there is nothing to run."""
    services = configured(computer)
    if not services:
        raise ConfigError(f"{computer.path}: nothing to run; want a section [gateway] or [hub]")
    asked = tuple(name for name in only.split(",") if name)
    if strangers := sorted(set(asked) - set(services)):
        raise ConfigError(
            f"--only {', '.join(strangers)}: not configured here (configured: {', '.join(services)})"
        )
    return asked or services


def keep_up(
    computer: Computer,
    services: Sequence[str],
    logs: Path | None,
    log_level: str,
    *,
    stop_on_eof: bool = False,
) -> None:
    """Run these services, and a router if none answers, until stopped; ConfigError if one cannot run as it is."""
    specs = _specs(computer, services, logs, log_level)
    with Stop() as stop, ProcessGroup(forked=(*services, _ROUTER_COMMAND)) as group:
        if stop_on_eof:
            stop.watch_input()
        supervisor = Supervisor(group, specs, watched=lambda name: name != ROUTER)
        _Upkeep(computer, supervisor, services).run(stop)
    if supervisor.refused:
        where = "its message above" if logs is None else f"its log in {logs}"
        raise ConfigError(f"{', '.join(supervisor.refused)} cannot run as configured: see {where}")


def _specs(
    computer: Computer, services: Sequence[str], logs: Path | None, log_level: str
) -> list[ProcessSpec]:
    if logs is not None:
        logs.mkdir(parents=True, exist_ok=True)

    def spec(name: str, command: str, *arguments: str) -> ProcessSpec:
        log = None if logs is None else logs / f"{name}.log"
        return ProcessSpec(name, command, arguments, log, append=True)

    common = (
        *("--config", str(computer.path)),
        *("--router-wait", str(_ROUTER_WAIT_S)),
        *("--log-level", log_level),
    )
    router = spec(ROUTER, _ROUTER_COMMAND, "router", "--config", str(computer.path))
    return [
        *([] if answers(computer) else [router]),
        *(spec(name, name, *common) for name in services),
    ]


def answers(computer: Computer) -> bool:
    """Whether its router is there."""
    bus = _try_bus(computer)
    if bus is not None:
        bus.close()
    return bus is not None


def _try_bus(computer: Computer) -> ZenohBus | None:
    try:
        return open_bus(computer.router, credentials=computer.credentials, timeout_s=0.0)
    except BusError:
        return None


class _Upkeep:
    """The loop: processes, their health from the bus, and what systemd is told."""

    def __init__(self, computer: Computer, supervisor: Supervisor, services: Sequence[str]) -> None:
        self._computer = computer
        self._supervisor = supervisor
        self._silent = set(services)
        self._heard: list[str] = []
        self._bus: ZenohBus | None = None
        self._notify_s = 0.0

    def run(self, stop: Stop) -> None:
        """Until stopped, or until something cannot run as it is configured."""
        try:
            while not self._supervisor.refused:
                self._look(time.monotonic())
                if stop.wait(LOOK_S):
                    return
        finally:
            notify("STOPPING=1")
            if self._bus is not None:
                self._bus.close()

    def _look(self, now_s: float) -> None:
        while self._heard:
            name = self._heard.pop()
            self._supervisor.heard(name, now_s)
            self._first_heard(name)
        self._supervisor.watch(now_s)
        if now_s >= self._notify_s:
            self._notify_s = now_s + _NOTIFY_S
            self._listen()
            notify("WATCHDOG=1")

    def _first_heard(self, name: str) -> None:
        if name not in self._silent:
            return
        self._silent.remove(name)
        if not self._silent:
            structlog.get_logger().info("all services are up")
            notify("READY=1\nSTATUS=all services are up")

    def _listen(self) -> None:
        """Health comes over the bus, as soon as there is one; zenoh finds a router that is replaced by itself."""
        if self._bus is not None:
            return
        self._bus = _try_bus(self._computer)
        if self._bus is not None:
            self._bus.subscribe(self._computer.identity.selector("health"), self._take)

    def _take(self, envelope: Envelope) -> None:
        """In the bus's thread."""
        health = envelope.message
        if isinstance(health, Health) and health.state != "stopped":
            self._heard.append(health.service)
