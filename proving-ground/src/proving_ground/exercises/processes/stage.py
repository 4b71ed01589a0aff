"""Puts an exercise on stage: a router per computer, the radio nets, every service as a real process, observers.

Nothing but the radio nets joins the computers: each has a router of its own, so what the command post shows has
come over the air. As many processes are starting at a time as the machine's processors can bear; gateways last.
"""

import os
import socket
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from bootprint.clock import NS_PER_S, ScaledClock
from bootprint.errors import BootprintError, ConfigError
from bootprint.geodesy import LocalFrame
from bootprint.processes import ProcessGroup, ProcessSpec
from bootprint.recording import Recorder
from bootprint.stopping import Stop
from bootprint.zenoh_bus import EmbeddedRouter
from pdr_engine.foot import warm_up
from proving_ground.exercises.exercise import COMMAND_POST_ROLE, REALM, Exercise, Soldier
from proving_ground.exercises.faults.process_faults import Outage, ProcessFaults
from proving_ground.exercises.processes.emulated_radio import EmulatedNet
from proving_ground.exercises.processes.exercise_files import (
    Ports,
    check_exercise,
    forget_history,
    write_computer,
    write_gateway,
    write_plan,
    write_realm,
)
from proving_ground.exercises.processes.free_ports import free_ports, is_free
from proving_ground.exercises.processes.observer import Observers
from proving_ground.exercises.processes.run_files import with_files
from proving_ground.exercises.processes.serial_feed import SerialFeed
from proving_ground.exercises.scoring.truth_record import record_truth

GATEWAY, HUB = "sensor-gateway", "sa-hub"
SOLDIER_SERVICES = ("pdr-engine", "fusion", "sa-hub")
POST_SERVICES = ("sa-hub",)
_READY_TIMEOUT_S = 120.0  # for one process
_AT_ONCE_PER_PROCESSOR = 3
_BUSY_BEATS_S = ((15, 0.2), (6, 0.1))  # from so many computers on each processor of this machine
# Host seconds for the gateways to start before the walks do: a base, each one's imports, each second of a unit.
_LEAD_S, _LEAD_PER_GATEWAY_S, _LEAD_PER_PLAYED_S = 5.0, 1.0, 2e-4
_LEAD_TRIES = (1.0, 3.0, 9.0)
_LAST_CALL_S = 3.0  # host seconds before the walks: who is not there then will not be

OnProgress = Callable[[int, int], None]
"""Is told how many processes run, of how many."""


class StageError(BootprintError):
    """The exercise could not be put on stage."""


@dataclass(frozen=True)
class Play:
    """How it is played: files below ``folder``; ``serial``: sensors by pseudo-terminal; ``record``: a file.

    ``page_port``: where the command post's page is wanted, 0 for anywhere; None is for no page.
    """

    folder: Path
    speed: float = 1.0
    serial: bool = False
    record: Path | None = None
    page_port: int | None = None


class Stage:
    """An exercise's routers, nets, processes and observers; a context manager that leaves nothing behind."""

    def __init__(self, exercise: Exercise, play: Play) -> None:
        if play.serial and play.speed != 1.0:
            raise ConfigError("--serial pty: sensors on a line are live, so --speed must be 1")
        check_exercise(exercise)
        self.exercise = with_files(exercise, play.folder)
        self.speed = play.speed
        self.clock = ScaledClock(play.speed, time.time_ns())
        self.frame = LocalFrame(exercise.origin)
        self.start_ns = 0
        self.page_address: str | None = None
        self.processes = ProcessGroup(forked=(*SOLDIER_SERVICES, GATEWAY))  # as `bootprint up` does
        self.nets: dict[str, EmulatedNet] = {}
        self.observers: Observers
        self._play = play
        self._origin_s = self.clock.origin_ns / NS_PER_S
        self._stack = ExitStack()
        self._routers: dict[str, EmbeddedRouter] = {}
        self._endpoints: dict[str, str] = {}
        self._recorder: Recorder | None = None
        self._serial: SerialFeed | None = None
        self._faults = ProcessFaults(self)
        self.jumps_s: dict[str, float] = {}
        """By how much the clocks of hubs are off, by computer; for those that are started from now on."""

    def __enter__(self) -> "Stage":
        try:
            self._build()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _build(self) -> None:
        warm_up()  # compiles the foot filter once, if nobody has yet, rather than in every process at once
        self._start_routers()
        ports = self._start_nets()
        write_realm(self._play.folder, self.exercise)
        forget_history(self._play.folder)
        if ports.page is not None and self.exercise.site:
            write_plan(self._play.folder, self.exercise)
        for computer in self.exercise.computers:
            write_computer(self._play.folder, self.exercise, computer, self._endpoints[computer], ports)
        if self._play.record is not None:
            self._recorder = self._stack.enter_context(Recorder(self._play.record, overwrite=True))
        self.observers = Observers(
            self._endpoints, REALM, self.clock, self.frame, self._recorder, self.exercise.clock_jumps_s
        )
        self._stack.callback(self.observers.close)
        self._stack.enter_context(self.processes)
        if self._play.serial:
            self._serial = self._stack.enter_context(SerialFeed(self.exercise, self._play.folder, self.clock))

    def _start_routers(self) -> None:
        computers = self.exercise.computers
        endpoints = [f"tcp/127.0.0.1:{port}" for port in free_ports(len(computers), socket.SOCK_STREAM)]
        with ThreadPoolExecutor(min(8, len(endpoints))) as pool:  # a router takes half a second to come up
            routers = list(pool.map(EmbeddedRouter, endpoints))
        for computer, router in zip(computers, routers, strict=True):
            self._routers[computer] = router
            self._endpoints[computer] = router.endpoint
        self._stack.callback(self._close_routers)

    def _close_routers(self) -> None:
        for computer in list(self._routers):
            self.close_router(computer)

    def close_router(self, computer: str) -> None:
        """A computer's router dies."""
        router = self._routers.pop(computer, None)
        if router is not None:
            router.close()

    def open_router(self, computer: str) -> None:
        """A router at the same address again."""
        self._routers[computer] = EmbeddedRouter(self._endpoints[computer])

    def endpoint(self, computer: str) -> str:
        """The address of a computer's router."""
        return self._endpoints[computer]

    def _start_nets(self) -> Ports:
        nets = self.exercise.nets
        numbers = iter(free_ports(sum(len(net.members) for net in nets), socket.SOCK_DGRAM))
        ports = Ports()
        for net in nets:
            name = net.profile.name
            ports.members[name] = {member: next(numbers) for member in net.members}
            emulated = EmulatedNet(
                net.profile,
                ports.members[name],
                self.speed,
                self.exercise.silences_s(net),
                self.exercise.partings(net),
            )
            emulated.start()
            self._stack.callback(emulated.close)
            self.nets[name] = emulated
            ports.nets[name] = emulated.port
        ports.page = self._page_port()
        return ports

    def _page_port(self) -> int | None:
        """The port of the command post's page: the one that was asked for, or any if somebody has that."""
        wanted = self._play.page_port
        if wanted is None or self.exercise.hub_role(self.exercise.command_post) != COMMAND_POST_ROLE:
            return None
        port = (
            wanted if wanted and is_free(wanted, socket.SOCK_STREAM) else free_ports(1, socket.SOCK_STREAM)[0]
        )
        self.page_address = f"http://127.0.0.1:{port}/"
        return port

    # -- processes --------------------------------------------------------------------------------------------

    @property
    def process_count(self) -> int:
        """How many processes the exercise has, gateways included."""
        return sum(len(self._services(computer)) for computer in self.exercise.computers) + len(
            self.exercise.soldiers
        )

    def services_of(self, computer: str) -> tuple[str, ...]:
        """All services of a computer, its gateway last."""
        soldiers = {soldier.id for soldier in self.exercise.soldiers}
        return (*self._services(computer), *((GATEWAY,) if computer in soldiers else ()))

    def _services(self, computer: str) -> tuple[str, ...]:
        posts = {hub.id for hub in self.exercise.hubs}
        return POST_SERVICES if computer in posts else SOLDIER_SERVICES

    def spawn(self, computer: str, service: str) -> None:
        """Start one service of a computer."""
        folder = self._play.folder / computer
        config = "gateway.toml" if service == GATEWAY else "computer.toml"
        self.observers.forget(computer, service)
        self.processes.start(
            ProcessSpec(
                name=f"{computer}/{service}",
                command=service,
                arguments=(
                    *("--config", str(folder / config)),
                    *("--speed", str(self._play.speed)),
                    *("--clock-origin", f"{self._origin_s:.6f}"),
                    *("--clock-offset", f"{self._clock_off_s(computer, service):g}"),
                    *("--router-wait", "30"),
                    *self._beat(),
                ),
                log=folder / f"{service}.log",
                append=True,
            )
        )

    def _clock_off_s(self, computer: str, service: str) -> float:
        """By how many host seconds a process's clock is off."""
        return self.jumps_s.get(computer, 0.0) / self._play.speed if service == HUB else 0.0

    def _beat(self) -> tuple[str, ...]:
        """Services look at their bus as often as they choose, if the machine has the processors for it."""
        of_each = len(self.exercise.computers) / (os.cpu_count() or 1)
        beats_s = [beat_s for computers, beat_s in _BUSY_BEATS_S if of_each > computers]
        return ("--beat", f"{beats_s[0]:.3f}") if beats_s else ()

    def wait_ready(self, stop: Stop, on_progress: OnProgress = lambda _done, _of: None) -> None:
        """Start all services but the gateways; StageError names those that do not come up."""
        wanted = [
            (computer, service)
            for computer in self.exercise.computers
            for service in self._services(computer)
        ]
        self._start(wanted, stop, on_progress, lambda: False)

    def _start(
        self,
        wanted: Sequence[tuple[str, str]],
        stop: Stop,
        on_progress: OnProgress,
        too_late: Callable[[], bool],
    ) -> bool:
        """Start them, the next as soon as one is there; False if stopped, or too late."""
        waiting, starting = deque(wanted), dict[tuple[str, str], float]()
        while waiting or starting:
            while waiting and len(starting) < _AT_ONCE_PER_PROCESSOR * (os.cpu_count() or 1):
                starting[waiting[0]] = time.monotonic() + _READY_TIMEOUT_S
                self.spawn(*waiting.popleft())
            if too_late() or stop.wait(0.05):
                return False
            self._note_ready(starting)
            on_progress(len(self.processes.pids) - len(starting), self.process_count)
        return not too_late()

    def _note_ready(self, starting: dict[tuple[str, str], float]) -> None:
        """Strike out what runs; StageError on what does not by its deadline."""
        self.processes.check()
        for computer, service in [one for one in starting if one[1] in self.observers.alive(one[0])]:
            del starting[computer, service]
        if missing := [f"{c}/{s}" for (c, s), at in starting.items() if time.monotonic() > at]:
            raise StageError(f"not running after {_READY_TIMEOUT_S:g} s: {', '.join(missing)}")

    def start_walks(self, stop: Stop, on_progress: OnProgress = lambda _done, _of: None) -> None:
        """Start the gateways; all walks begin at ``start_ns`` of event time, a whole second.

        A gateway that is not there by then would have to hurry after its walk, so on a busy machine all are killed
        before the first has sent anything, and started again with more time; StageError if that is not enough.
        """
        gateways = [(soldier.id, GATEWAY) for soldier in self.exercise.soldiers]
        least_s = _lead_s(self.exercise.soldiers)
        for patience in _LEAD_TRIES:
            self._set_start(least_s * patience)
            for soldier in self.exercise.soldiers:
                self._write_gateway(soldier)
            if self._start(gateways, stop, on_progress, self._is_too_late) or stop.is_set():
                self._begin()
                return
            for computer, service in gateways:
                self.processes.kill(f"{computer}/{service}")
        raise StageError(
            f"the gateways did not start within {least_s * _LEAD_TRIES[-1]:.0f} s: this machine is too busy"
        )

    def _is_too_late(self) -> bool:
        return self.elapsed_s > -_LAST_CALL_S * self.speed

    def _set_start(self, lead_s: float) -> None:
        ready_ns = self.clock.now_ns() + round(lead_s * self.speed * NS_PER_S)
        self.start_ns = -(-ready_ns // NS_PER_S) * NS_PER_S

    def _write_gateway(self, soldier: Soldier) -> None:
        serial = None if self._serial is None else self._serial.source(soldier)
        write_gateway(self._play.folder, soldier, self._endpoints[soldier.id], self.start_ns, serial)

    def _begin(self) -> None:
        for net in self.nets.values():
            net.begin(self.clock.host_seconds_until(self.start_ns))
        if self._serial is not None:
            self._serial.start(self.start_ns)

    def play_faults(self) -> None:
        """Do what is to break by now, and mend what was broken long enough."""
        self._faults.play(self.elapsed_s)

    @property
    def outages(self) -> list[Outage]:
        """Who was gone for how long, by faults of processes."""
        return self._faults.outages

    def end(self) -> None:
        """The exercise is over: take in what has been said, let everybody go, and record the truth beside it."""
        self._faults.close()
        self.observers.close()
        self.processes.stop()  # before the scoring, which wants the processors
        if self._recorder is not None:
            record_truth(self._recorder, self.exercise, self.start_ns)

    @property
    def elapsed_s(self) -> float:
        """Event seconds since the walks began; negative before."""
        return (self.clock.now_ns() - self.start_ns) / NS_PER_S

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()


def _lead_s(soldiers: Sequence[Soldier]) -> float:
    """How long all gateways may take to start and to read what they play, by this machine's processors."""
    played_s = sum(soldier.run.duration_s * len(soldier.run.imus) for soldier in soldiers)
    work_s = _LEAD_PER_GATEWAY_S * len(soldiers) + _LEAD_PER_PLAYED_S * played_s
    return _LEAD_S + work_s / (os.cpu_count() or 1)
