"""Puts an exercise on stage: a router per computer, two radio nets, every service as a real process, observers.

Nothing but the radio nets joins the computers: each has a router of its own, so what the command post shows has
come over the air.
"""

import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from bootprint.clock import NS_PER_S, ScaledClock
from bootprint.errors import BootprintError
from bootprint.geodesy import LocalFrame
from bootprint.stopping import Stop
from bootprint.zenoh_bus import EmbeddedRouter
from pdr_engine.foot import warm_up
from proving_ground.exercises.emulated_radio import EmulatedNet, NetProfile
from proving_ground.exercises.exercise import COMMAND_POST, LEADER, REALM, Exercise
from proving_ground.exercises.exercise_files import Ports, write_computer, write_gateway, write_realm
from proving_ground.exercises.observer import Observer
from proving_ground.exercises.processes import ProcessGroup, ProcessSpec

SQUAD_NET = NetProfile("squad", rate_bits_per_s=9600.0, latency_s=0.05, header_bytes=28, seed=1)
COMPANY_NET = NetProfile("company", rate_bits_per_s=4800.0, latency_s=0.15, header_bytes=28, seed=2)
GATEWAY = "sensor-gateway"
_READY_TIMEOUT_S = 90.0
_LEAD_S = (3.0, 10.0, 40.0)  # host seconds for the gateways to start before the walks do: one try each


class StageError(BootprintError):
    """The exercise could not be put on stage."""


@dataclass(frozen=True)
class Play:
    """How the exercise is played."""

    folder: Path
    speed: float = 1.0
    loss: float = 0.0


class Stage:
    """An exercise's routers, nets, processes and observers; a context manager that leaves nothing behind."""

    def __init__(self, exercise: Exercise, play: Play) -> None:
        self.exercise = exercise
        self.speed = play.speed
        self.clock = ScaledClock(play.speed, time.time_ns())
        self.frame = LocalFrame(exercise.origin)
        self.start_ns = 0
        self._play = play
        self._origin_s = self.clock.origin_ns / NS_PER_S
        self._stack = ExitStack()
        self.processes = ProcessGroup()
        self.observers: dict[str, Observer] = {}
        self.nets: dict[str, EmulatedNet] = {}
        self._routers: dict[str, str] = {}

    @property
    def computers(self) -> list[str]:
        """Every computer: the soldiers', the squad leader's, the command post's."""
        return [*(soldier.id for soldier in self.exercise.soldiers), LEADER, COMMAND_POST]

    def __enter__(self) -> "Stage":
        try:
            self._build()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _build(self) -> None:
        warm_up()  # compiles the foot filter once, if nobody has yet, rather than four times at once
        self._start_routers()
        ports = self._start_nets()
        write_realm(self._play.folder, self.exercise)
        self._stack.enter_context(self.processes)
        for computer in self.computers:
            write_computer(self._play.folder, self.exercise, computer, self._routers[computer], ports)
            self._watch(computer)
            self._start_services(computer)

    def _start_routers(self) -> None:
        endpoints = [f"tcp/127.0.0.1:{port}" for port in free_ports(len(self.computers), socket.SOCK_STREAM)]
        with ThreadPoolExecutor(len(endpoints)) as pool:  # a router takes half a second to come up
            routers = list(pool.map(EmbeddedRouter, endpoints))
        for computer, router in zip(self.computers, routers, strict=True):
            self._routers[computer] = router.endpoint
            self._stack.callback(router.close)

    def _start_nets(self) -> Ports:
        squad = [*(soldier.id for soldier in self.exercise.soldiers), LEADER]
        numbers = free_ports(len(squad) + 2, socket.SOCK_DGRAM)
        members = {
            "squad": dict(zip(squad, numbers, strict=False)),
            "company": {LEADER: numbers[-2], COMMAND_POST: numbers[-1]},
        }
        for profile in (SQUAD_NET, COMPANY_NET):
            lossy = NetProfile(**{**profile.__dict__, "loss": self._play.loss})
            net = EmulatedNet(lossy, list(members[profile.name].values()), self._play.speed)
            net.start()
            self._stack.callback(net.close)
            self.nets[profile.name] = net
        return Ports(members, {name: net.port for name, net in self.nets.items()})

    def _watch(self, computer: str) -> None:
        observer = Observer(computer, self._routers[computer], REALM, self.clock)
        self.observers[computer] = observer
        self._stack.callback(observer.close)

    def _start_services(self, computer: str) -> None:
        for service in self._services(computer):
            self._spawn(computer, service, "computer.toml")

    def _services(self, computer: str) -> tuple[str, ...]:
        return ("sa-hub",) if computer in (LEADER, COMMAND_POST) else ("pdr-engine", "fusion", "sa-hub")

    def _spawn(self, computer: str, service: str, config: str) -> None:
        folder = self._play.folder / computer
        self.processes.start(
            ProcessSpec(
                name=f"{computer}/{service}",
                command=service,
                arguments=(
                    *("--config", str(folder / config)),
                    *("--speed", str(self._play.speed)),
                    *("--clock-origin", f"{self._origin_s:.6f}"),
                    *("--router-wait", "30"),
                ),
                log=folder / f"{service}.log",
            )
        )

    def wait_ready(self, stop: Stop) -> None:
        """Wait until every service lives (or ``stop`` is set); StageError names those that do not."""
        deadline = time.monotonic() + _READY_TIMEOUT_S
        while missing := self._missing():
            self.processes.check()
            if time.monotonic() > deadline:
                raise StageError(f"not running after {_READY_TIMEOUT_S:g} s: {', '.join(missing)}")
            if stop.wait(0.1):
                return

    def _missing(self) -> list[str]:
        return [
            f"{computer}/{service}"
            for computer, observer in self.observers.items()
            for service in sorted(set(self._services(computer)) - observer.alive())
        ]

    def start_walks(self, stop: Stop) -> None:
        """Start the gateways; all walks begin at ``start_ns`` of event time, a whole second.

        A gateway that is not there by then would have to hurry after its walk, so on a busy machine they are
        started again with more time; StageError if even that is not enough.
        """
        gateways = [f"{soldier.id}/{GATEWAY}" for soldier in self.exercise.soldiers]
        for lead_s in _LEAD_S:
            ready_ns = self.clock.now_ns() + round(lead_s * self.speed * NS_PER_S)
            self.start_ns = -(-ready_ns // NS_PER_S) * NS_PER_S
            for soldier in self.exercise.soldiers:
                write_gateway(self._play.folder, soldier, self._routers[soldier.id], self.start_ns)
                self._spawn(soldier.id, GATEWAY, "gateway.toml")
            if self._gateways_in_time(stop) or stop.is_set():
                return
            self.processes.stop(gateways)
        raise StageError(f"the gateways did not start within {_LEAD_S[-1]:g} s: this machine is too busy")

    def _gateways_in_time(self, stop: Stop) -> bool:
        """Whether all gateways live before the walks begin."""
        while not all(GATEWAY in self.observers[soldier.id].alive() for soldier in self.exercise.soldiers):
            self.processes.check()
            if self.elapsed_s >= 0.0 or stop.wait(0.1):
                return False
        return self.elapsed_s < 0.0

    @property
    def elapsed_s(self) -> float:
        """Event seconds since the walks began; negative before."""
        return (self.clock.now_ns() - self.start_ns) / NS_PER_S

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()


def free_ports(count: int, kind: socket.SocketKind) -> list[int]:
    """Ports that are free on loopback now (all held open at once, so they differ)."""
    sockets = [socket.socket(socket.AF_INET, kind) for _ in range(count)]
    try:
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]
    finally:
        for each in sockets:
            each.close()
