"""The UDP source over loopback."""

import queue
import socket
import threading
from itertools import pairwise

import pytest

from bootprint.clock import ScaledClock
from bootprint.errors import ConfigError
from bootprint.messages import ImuBatch
from bootprint.topics import Identity
from sensor_gateway.intake import Intake
from sensor_gateway.settings import Sensor, UdpSource
from sensor_gateway.sources.udp import UdpReader
from support.sensor_device import MavlinkSender
from support.waiting import PATIENCE_S

SETTINGS = UdpSource(port=0, imus=(Sensor(system=1, place="body"),))


def test_datagrams_are_one_stream_even_if_a_bridge_cuts_frames() -> None:
    stop = threading.Event()
    received: queue.Queue[tuple[bytes, int]] = queue.Queue()
    reader = UdpReader(SETTINGS, ScaledClock(1.0, 0), lambda *item: received.put(item), stop.wait)
    thread = threading.Thread(target=reader.run)
    thread.start()
    stream = b"".join(MavlinkSender().imus(0, 10))
    cuts = [0, 5, 100, 101, 400, len(stream)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for begin, end in pairwise(cuts):
            sender.sendto(stream[begin:end], ("127.0.0.1", reader.port))
    intake = Intake(Identity("bp", "alpha", "a1"), SETTINGS)
    envelopes = [envelope for _ in range(5) for envelope in intake.feed(*received.get(timeout=PATIENCE_S))]
    stop.set()
    thread.join(5.0)
    assert not thread.is_alive()
    assert len(envelopes) == 1
    assert isinstance(envelopes[0].message, ImuBatch)
    assert envelopes[0].message.accel[:, 0].tolist() == list(range(10))
    assert reader.counts == {"bytes": len(stream), "datagrams": 5, "socket_errors": 0}


def test_a_taken_port_is_said_at_once() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(ConfigError, match=f"cannot listen on UDP 127.0.0.1:{port}"):
            UdpReader(UdpSource(port=port), ScaledClock(1.0, 0), lambda *_: None, lambda _: True)
