"""kill -9 of a real pdr-engine in a corner: its successor tells the steps that would have been told, to the bit."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.messages import FootStep, Health, ImuBatch
from bootprint.saved_state import StateFile
from bootprint.topics import Identity
from bootprint.zenoh_bus import ZenohBus, open_bus
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.memory import FILE, FORM
from support.foot_streams import Stream, walk
from support.routers import running_router
from support.waiting import wait_until

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes")]
ME = Identity("killed", "alpha", "a1")
BATCH = 10
CORNER_S = 2.0 + 4.5 * 1.1  # in the swing of the fifth stride, which turns by a quarter
GONE_S = 1.5


def batches(stream: Stream) -> list[Envelope]:
    cuts = [slice(k, k + BATCH) for k in range(0, len(stream.time_ns), BATCH)]
    return [
        Envelope(
            ME.address("imu", "left_foot"),
            ImuBatch.from_arrays(number, stream.time_ns[cut], stream.accel[cut], stream.gyro[cut]),
        )
        for number, cut in enumerate(cuts)
    ]


def write_computer(folder: Path) -> Path:
    (folder / "realm.toml").write_text(
        'id = "killed"\norigin = { latitude_deg = 59.35, longitude_deg = 18.07 }\n'
        'roster = [{ id = "a1", number = 1, unit = "alpha" }]\n'
    )
    path = folder / "computer.toml"
    path.write_text('realm = "realm.toml"\nsoldier = "a1"\n[pdr]\nplaces = ["left_foot"]\n')
    return path


@contextmanager
def engine(config: Path, router: str, bus: ZenohBus) -> Iterator[subprocess.Popen[bytes]]:
    """A pdr-engine that has told of its health; killed at the end."""
    heard: list[Health] = []
    command = [str(Path(sys.executable).parent / "pdr-engine"), "--config", str(config), "--router", router]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        bus.subscribe(ME.selector("health"), lambda one: heard.append(one.message))  # type: ignore[arg-type]
        wait_until(lambda: any(one.sequence == 1 for one in heard), 30.0, "the engine's health")
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_corner_is_gone_round_by_two_engines_as_by_one(tmp_path: Path) -> None:
    stream = walk(10)
    inputs = batches(stream)
    core = EngineCore(PdrConfig(places=("left_foot",)), ME, Origin(59.35, 18.07))
    expected = {
        s.sequence: wire.encode(s) for s in steps(one for each in inputs for one in core.handle(each))
    }
    corner = round(CORNER_S * 200.0 / BATCH)
    back = corner + round(GONE_S * 200.0 / BATCH)
    config = write_computer(tmp_path)
    state = tmp_path / "state" / FILE
    told: dict[int, bytes] = {}
    with running_router() as router, closing(open_bus(router)) as gateway, closing(open_bus(router)) as ear:
        ear.subscribe(ME.selector("foot_step"), lambda one: told.update(coded(one)))
        with engine(config, router, ear):
            publish(gateway, inputs[: corner - 10])
            wait_until(lambda: saved_ns(state) >= inputs[corner - 11].message.time_ns, what="saved state")
            publish(gateway, inputs[corner - 10 : corner])
        publish(gateway, inputs[corner:back])  # to nobody
        with engine(config, router, ear):
            publish(gateway, inputs[back:])
            wait_until(lambda: set(told) == set(expected), what="all steps")
    assert told == expected


def steps(said: Iterator[Envelope]) -> list[FootStep]:
    return [one.message for one in said if isinstance(one.message, FootStep)]


def coded(envelope: Envelope) -> dict[int, bytes]:
    return {envelope.message.sequence: wire.encode(envelope.message)}


def publish(bus: ZenohBus, envelopes: list[Envelope]) -> None:
    for envelope in envelopes:
        bus.publish(envelope)


def saved_ns(path: Path) -> int:
    kept = StateFile(path, FORM).load()
    return 0 if kept is None else kept.time_ns
