"""The serial source on a real pseudo-terminal: unplugged, replugged, fed with garbage and half messages."""

import queue
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bootprint.bus import Envelope
from bootprint.clock import ScaledClock
from bootprint.messages import GnssFix, ImuBatch
from bootprint.topics import Identity
from sensor_gateway.intake import Intake
from sensor_gateway.settings import Sensor, SerialSource
from sensor_gateway.sources.serial import SerialReader
from support.sensor_device import MavlinkSender, PtyDevice, nmea
from support.waiting import PATIENCE_S, wait_until

A1 = Identity("bp", "alpha", "a1")


class Rig:
    """A reader in its thread, and an intake that takes what it hands over."""

    def __init__(self, settings: SerialSource) -> None:
        self.stop = threading.Event()
        self.waiting: queue.Queue[Callable[[], list[Envelope]]] = queue.Queue()
        self.intake = Intake(A1, settings)
        self.envelopes: list[Envelope] = []
        self.cuts = 0
        self.reader = SerialReader(
            settings, ScaledClock(1.0, 0), self._on_bytes, self._on_cut, self.stop.wait
        )
        self.thread = threading.Thread(target=self.reader.run)

    def _on_bytes(self, data: bytes, received_ns: int) -> None:
        self.waiting.put(lambda: self.intake.feed(data, received_ns))

    def _on_cut(self, received_ns: int) -> None:
        self.cuts += 1
        self.waiting.put(lambda: self.intake.cut(received_ns))

    def wait_for(self, condition: Callable[[], bool]) -> None:
        """Take what the reader hands over until the condition holds."""
        while not condition():
            self.envelopes += self.waiting.get(timeout=PATIENCE_S)()

    def wait_open(self, times: int) -> None:
        """Opening a port throws away what came before it."""
        wait_until(lambda: self.reader.counts["opened"] == times, what=f"port opened {times} times")

    def numbers(self) -> list[int]:
        """The samples that arrived, by the number in their x acceleration."""
        batches = [envelope.message for envelope in self.envelopes]
        return [int(x) for batch in batches if isinstance(batch, ImuBatch) for x in batch.accel[:, 0]]


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PtyDevice]:
    yield from PtyDevice(tmp_path).running()


def run_rig(settings: SerialSource) -> Iterator[Rig]:
    rig = Rig(settings)
    rig.thread.start()
    yield rig
    rig.stop.set()
    rig.thread.join(5.0)
    assert not rig.thread.is_alive()


@pytest.fixture
def rig(device: PtyDevice) -> Iterator[Rig]:
    settings = SerialSource(port=str(device.path), imus=(Sensor(system=1, place="left_foot"),), batch_size=5)
    for rig in run_rig(settings):
        rig.wait_open(1)
        yield rig


def test_frames_arrive_in_batches_with_rising_numbers(rig: Rig, device: PtyDevice) -> None:
    device.write(b"".join(MavlinkSender().imus(0, 20)))
    rig.wait_for(lambda: len(rig.numbers()) == 20)
    assert rig.numbers() == list(range(20))
    assert [envelope.message.sequence for envelope in rig.envelopes] == [0, 1, 2, 3]
    assert {envelope.address.key for envelope in rig.envelopes} == {"bp/@v1/alpha/a1/imu/left_foot"}
    assert rig.reader.fault == ""


def test_unplugged_and_replugged(rig: Rig, device: PtyDevice) -> None:
    """The loss is noticed and told; afterwards the same path is read again and numbers go on."""
    sender = MavlinkSender()
    device.write(b"".join(sender.imus(0, 10)))
    rig.wait_for(lambda: len(rig.numbers()) == 10)
    device.unplug()
    rig.wait_for(lambda: rig.cuts == 1)
    wait_until(lambda: str(device.path) in rig.reader.fault)
    device.plug()
    rig.wait_open(2)
    device.write(b"".join(sender.imus(400, 10)))
    rig.wait_for(lambda: len(rig.numbers()) == 20)
    assert rig.numbers() == [*range(10), *range(400, 410)]
    assert [envelope.message.sequence for envelope in rig.envelopes] == [0, 1, 2, 3]
    assert (rig.reader.counts["lost"], rig.reader.fault) == (1, "")


def test_a_sensor_that_restarted_while_unplugged_keeps_its_stamps_rising(rig: Rig, device: PtyDevice) -> None:
    device.write(b"".join(MavlinkSender().imus(1000, 5)))
    rig.wait_for(lambda: len(rig.numbers()) == 5)
    device.unplug()
    rig.wait_for(lambda: rig.cuts == 1)
    device.plug()
    rig.wait_open(2)
    device.write(b"".join(MavlinkSender().imus(0, 5)))
    rig.wait_for(lambda: len(rig.numbers()) == 10)
    first, second = (envelope.message for envelope in rig.envelopes)
    assert isinstance(first, ImuBatch)
    assert second.time_ns > first.times[-1]
    assert rig.intake.counters()["clock_resets"] == 1


def test_garbage_between_frames_costs_no_frame(rig: Rig, device: PtyDevice) -> None:
    garbage = b"\xfd\xff\x00\x00" + bytes(range(256)) + b"\xfe\x09"
    for frame in MavlinkSender().imus(0, 10):
        device.write(garbage + frame)
    # Frames behind a false start that claims 255 bytes come out when these bytes are there.
    device.write(bytes(300))
    rig.wait_for(lambda: len(rig.numbers()) == 10)
    assert rig.numbers() == list(range(10))
    assert rig.intake.counters()["bytes_skipped"] >= 10 * len(garbage)


def test_a_half_message_is_completed_later(rig: Rig, device: PtyDevice) -> None:
    frames = MavlinkSender().imus(0, 5)
    device.write(b"".join(frames[:4]) + frames[4][:30])
    rig.wait_for(lambda: rig.reader.counts["bytes"] == 4 * len(frames[0]) + 30 and rig.waiting.empty())
    assert rig.numbers() == []
    device.write(frames[4][30:])
    rig.wait_for(lambda: len(rig.numbers()) == 5)


def test_a_half_message_cut_by_the_unplug_takes_nothing_with_it(rig: Rig, device: PtyDevice) -> None:
    """What was whole before comes out at once; the half one is dropped; the first one after is read."""
    sender = MavlinkSender()
    frames = sender.imus(0, 4)
    device.write(b"".join(frames[:3]) + frames[3][:30])
    rig.wait_for(lambda: rig.reader.counts["bytes"] == 3 * len(frames[0]) + 30 and rig.waiting.empty())
    device.unplug()
    rig.wait_for(lambda: len(rig.numbers()) == 3)
    device.plug()
    rig.wait_open(2)
    device.write(b"".join(sender.imus(300, 5)))
    rig.wait_for(lambda: len(rig.numbers()) == 8)
    assert rig.numbers() == [0, 1, 2, *range(300, 305)]
    assert rig.intake.counters()["frames_broken"] == 1


def test_a_port_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    device = PtyDevice(tmp_path)
    settings = SerialSource(port=str(device.path), protocol="nmea")
    for rig in run_rig(settings):
        wait_until(lambda: "could not open port" in rig.reader.fault)  # noqa: B023
        device.plug()
        rig.wait_open(1)
        device.write(nmea("GPGGA,123519.00,4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,"))
        device.write(nmea("GPGGA,123520.00,4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,"))
        rig.wait_for(lambda: len(rig.envelopes) == 2)  # noqa: B023
        assert [type(envelope.message) for envelope in rig.envelopes] == [GnssFix, GnssFix]
    device.unplug()
