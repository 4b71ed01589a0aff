"""A soldier's four services for hours of event time: by how much their memory grows.

python -m proving_ground.exercises.faults.soak FOLDER [--speed 8] [--minutes 20]

A walk round a yard is replayed in a loop, so many times as fast. Every minute a line tells how much memory each
service has; at the end stands by how much it grew, once it had settled (`memory_growth`).
"""

import socket
import time
from contextlib import closing
from pathlib import Path
from typing import Annotated, Final

import typer

from bootprint.geodesy import LocalFrame
from bootprint.processes import ProcessGroup, ProcessSpec
from bootprint.topics import Identity
from bootprint.zenoh_bus import EmbeddedRouter, ZenohBus, open_bus
from proving_ground.exercises.exercise import ORIGIN, Exercise, Soldier
from proving_ground.exercises.faults.memory_growth import memory_growth
from proving_ground.exercises.processes.exercise_files import Ports, write_computer, write_realm, write_toml
from proving_ground.exercises.processes.free_ports import free_ports
from proving_ground.exercises.processes.stage import GATEWAY, SOLDIER_SERVICES
from proving_ground.exercises.scoring.heard import Heard
from proving_ground.exercises.squad import squad_of
from proving_ground.sensors.run_writer import write_run_folder
from proving_ground.simulation.walker import simulate_walk

_ROUND_M: Final = [(0.0, 0.0, 0.0), (12.0, 0.0, 0.0), (12.0, 8.0, 0.0), (0.0, 8.0, 0.0), (0.0, 0.5, 0.0)]
_START: Final = {"east_m": 0.0, "north_m": 0.0, "azimuth_deg": 90.0}
_SOLDIER: Final = "a1"
_LOOK_S: Final = 1.0
_LINE_EVERY: Final = 60


def soak(
    folder: Path,
    speed: Annotated[float, typer.Option(help="Event time runs so many times as fast.")] = 8.0,
    minutes: Annotated[float, typer.Option(help="How long, of the host's time.")] = 20.0,
) -> None:
    """Run, and tell."""
    exercise = _one_soldier(folder)
    clock = ("--speed", f"{speed:g}", "--clock-origin", f"{time.time():.3f}")
    (port,) = free_ports(1, socket.SOCK_STREAM)
    with closing(EmbeddedRouter(f"tcp/127.0.0.1:{port}")) as router:
        _write(folder, exercise, router.endpoint)
        services = (*SOLDIER_SERVICES, GATEWAY)
        with ProcessGroup(forked=services) as group, closing(open_bus(router.endpoint)) as bus:
            for service in services:
                group.start(_spec(folder, service, router.endpoint, clock))
            heard = _listen(group, bus, exercise.identity(_SOLDIER), 60.0 * minutes)
    typer.echo(memory_growth({_SOLDIER: heard}))


def _one_soldier(folder: Path) -> Exercise:
    run = simulate_walk("yard", _ROUND_M, ORIGIN, seed=1)
    write_run_folder(run, folder / "yard")
    soldier = Soldier(_SOLDIER, 1, "Adler", run, run.truth["body"], _START, simulated=True)
    return squad_of((soldier,), "soak")


def _write(folder: Path, exercise: Exercise, router: str) -> None:
    write_realm(folder, exercise)
    ports = free_ports(2 * len(exercise.nets), socket.SOCK_DGRAM)
    of_nets = {net.profile.name: ports[2 * index : 2 * index + 2] for index, net in enumerate(exercise.nets)}
    members = {name: dict.fromkeys(exercise.computers, mine) for name, (mine, _) in of_nets.items()}
    airs = {name: air for name, (_, air) in of_nets.items()}
    write_computer(folder, exercise, _SOLDIER, router, Ports(members, airs))
    source = {"kind": "replay", "path": "../yard", "loop": True}
    common = {"realm": "../realm.toml", "soldier": _SOLDIER, "router": router}
    write_toml(folder / _SOLDIER / "gateway.toml", {**common, "gateway": {"sources": [source]}})


def _spec(folder: Path, service: str, router: str, clock: tuple[str, ...]) -> ProcessSpec:
    config = folder / _SOLDIER / ("gateway.toml" if service == GATEWAY else "computer.toml")
    arguments = ("--config", str(config), "--router", router, *clock)
    return ProcessSpec(service, service, arguments, folder / f"{service}.log")


def _listen(group: ProcessGroup, bus: ZenohBus, who: Identity, lasts_s: float) -> Heard:
    """Take in health until the time is over; ProcessError if a service ends before."""
    heard, frame = Heard(), LocalFrame(ORIGIN)
    inlet = bus.open_inlet(who.selector("health"))
    for look in range(round(lasts_s / _LOOK_S)):
        time.sleep(_LOOK_S)
        group.check()
        for envelope in inlet.take():
            heard.take(envelope, envelope.message.time_ns, frame)
        if look % _LINE_EVERY == _LINE_EVERY - 1:
            newest = {service: round(samples[-1][2], 2) for service, samples in heard.memory_mb.items()}
            typer.echo(f"{(look + 1) * _LOOK_S / 60.0:.0f} min: {newest} MB")
    return heard


if __name__ == "__main__":
    typer.run(soak)
