"""Replay as fast as possible over real processes: nothing is lost, and positions are those of one process."""

from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from bootprint.bus import Envelope, MemoryBus
from bootprint.messages import Health, Position
from bootprint.processes import ProcessGroup, ProcessSpec
from bootprint.zenoh_bus import open_bus
from fusion.engine import SUBJECTS
from proving_ground.exercises.processes.exercise_files import write_toml
from proving_ground.inprocess import positions_of
from support.golden import FUSION, PDR, REALM, SOLDIER, WALK, play_small_walk, small_walk
from support.routers import running_router
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes")]


@dataclass
class Listener:
    """What the bus has told so far."""

    positions: list[Position] = field(default_factory=list)
    health: dict[str, Health] = field(default_factory=dict)

    def take(self, envelope: Envelope) -> None:
        match envelope.message:
            case Position() as position:
                self.positions.append(position)
            case Health() as health:
                self.health[health.service] = health

    def count(self, service: str, *names: str) -> int:
        counters = self.health[service].counters if service in self.health else {}
        return sum(counters.get(name, 0) for name in names)


def write_files(folder: Path, router: str) -> Path:
    def plain(section: object) -> dict[str, Any]:
        return without_none(msgspec.to_builtins(section))

    write_toml(folder / "realm.toml", plain(REALM))
    path = folder / "computer.toml"
    sources = [{"kind": "replay", "path": str(WALK)}]
    write_toml(
        path,
        {
            "realm": "realm.toml",
            "soldier": SOLDIER.soldier,
            "router": router,
            "pdr": plain(PDR),
            "fusion": plain(FUSION),
            "gateway": {"sources": sources},
        },
    )
    return path


def without_none(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: without_none(value) for key, value in values.items() if value is not None}
    return [without_none(value) for value in values] if isinstance(values, list) else values


def spec(service: str, config: Path, *more: str) -> ProcessSpec:
    arguments = ("--config", str(config), "--speed", "max", "--router-wait", "30", *more)
    return ProcessSpec(service, service, arguments, config.parent / f"{service}.log")


def messages_for_fusion(bus: MemoryBus) -> Counter[str]:
    return Counter(key.split("/")[4] for key, _ in bus.journal if key.split("/")[4] in SUBJECTS)


@pytest.fixture(scope="module")
def expected() -> MemoryBus:
    return play_small_walk()


@pytest.fixture(scope="module")
def heard(expected: MemoryBus, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Listener]:
    """The whole walk, each service stopped when it has had everything, in the direction of the flow."""
    listener, folder = Listener(), tmp_path_factory.mktemp("max")
    samples = sum(len(imu.time_s) for imu in small_walk().imus.values())
    inputs = messages_for_fusion(expected)
    with (
        running_router() as router,
        closing(open_bus(router, lossless=True)) as bus,
        ProcessGroup() as processes,
    ):
        for subject in ("position", "health"):
            bus.subscribe(SOLDIER.selector(subject), listener.take)
        config = write_files(folder, router)
        for service in ("pdr-engine", "fusion"):
            processes.start(spec(service, config))
        processes.start(spec("sensor-gateway", config, "--wait-for", "pdr-engine,fusion"))
        accepted = [f"{place}_accepted" for place in small_walk().imus]
        wait(processes, lambda: listener.count("pdr-engine", *accepted) == samples, "all samples")
        processes.stop(["pdr-engine"])
        names = [f"{subject}_messages" for subject in inputs]
        wait(processes, lambda: listener.count("fusion", *names) == inputs.total(), "all of fusion's inputs")
        processes.stop(["fusion"])
        wanted = len(list(positions_of(expected)))
        wait(processes, lambda: len(listener.positions) >= wanted, "all positions")
        yield listener


def wait(processes: ProcessGroup, condition: Any, what: str) -> None:
    wait_until(lambda: processes.check() or condition(), timeout_s=60.0, what=what)


def test_positions_at_full_speed_are_those_in_process_to_a_nanometre(
    expected: MemoryBus, heard: Listener
) -> None:
    wanted = list(positions_of(expected))
    assert len(wanted) > 90
    assert [position.time_ns for position in heard.positions] == [position.time_ns for position in wanted]
    for got, position in zip(heard.positions, wanted, strict=True):
        for name in ("east_m", "north_m", "up_m", "covariance_m2", "velocity_m_s"):
            np.testing.assert_allclose(getattr(got, name), getattr(position, name), atol=1e-9, rtol=0)
        assert (got.mode, got.sequence) == (position.mode, position.sequence)


def test_nothing_was_late_lost_or_refused(heard: Listener) -> None:
    for service, health in heard.health.items():
        faults = {
            name: count
            for name, count in health.counters.items()
            if count
            and any(word in name for word in ("late", "lost", "error", "dropped", "rejected", "implausible"))
        }
        assert faults == {}, service
