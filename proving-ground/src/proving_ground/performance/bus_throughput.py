"""How many messages a second a computer's router carries, and what each costs: publisher, router, subscriber.

All three are sessions of one process over loopback TCP, so its processor time is that of the whole way, encoding
and decoding included. Inertial batches of ten samples, the most frequent message there is; publishers wait for who
is slower, so none is lost.
"""

import socket
import threading
import time
from contextlib import closing
from typing import Final

import numpy as np

from bootprint.bus import Bus, Envelope
from bootprint.errors import BootprintError
from bootprint.messages import ImuBatch
from bootprint.topics import Identity
from bootprint.zenoh_bus import EmbeddedRouter, open_bus
from proving_ground.exercises.processes.free_ports import free_ports
from proving_ground.performance.figures import Table

_WHO: Final = Identity("benchmark", "benchmark", "benchmark")
_SAMPLES: Final = 10
_PLACE: Final = "left_foot"
_PATIENCE_S: Final = 60.0
_BETWEEN_TRIALS_S: Final = 0.02


def bus_throughput(messages: int) -> Table:
    """Messages a second and µs of processor time each, as fast as it goes."""
    (port,) = free_ports(1, socket.SOCK_STREAM)
    with (
        closing(EmbeddedRouter(f"tcp/127.0.0.1:{port}")) as router,
        closing(open_bus(router.endpoint, lossless=True)) as listener,
        closing(open_bus(router.endpoint, lossless=True)) as speaker,
    ):
        counter = Counter(messages)
        listener.subscribe(_WHO.selector("imu"), counter.take)
        until_heard(speaker, counter)
        began_s, cpu_s = time.monotonic(), time.process_time()
        for sequence in range(messages):
            speaker.publish(Envelope(_WHO.address("imu", _PLACE), _batch(sequence)))
        if not counter.all_came.wait(_PATIENCE_S):
            raise BootprintError(f"of {messages} messages {counter.came} came within {_PATIENCE_S:g} s")
        seconds, cpu_s = time.monotonic() - began_s, time.process_time() - cpu_s
    return {"inertial batches": {"messages_per_s": messages / seconds, "us_each": 1e6 * cpu_s / messages}}


class Counter:
    """Takes what is published: tells of the first that comes, and counts the measured ones."""

    def __init__(self, expected: int) -> None:
        self.came = 0
        self.hears = threading.Event()
        self.all_came = threading.Event()
        self._expected = expected

    def take(self, envelope: Envelope) -> None:
        """In the bus's thread."""
        self.hears.set()
        if envelope.address.source != _PLACE:
            return
        self.came += 1
        if self.came == self._expected:
            self.all_came.set()


def until_heard(speaker: Bus, counter: Counter) -> None:
    """Publish what is not counted until some of it comes: the router knows of the subscription then."""
    until_s = time.monotonic() + _PATIENCE_S
    while not counter.hears.is_set():
        if time.monotonic() > until_s:
            raise BootprintError(f"nothing came within {_PATIENCE_S:g} s of subscribing")
        speaker.publish(Envelope(_WHO.address("imu", "trial"), _batch(0)))
        counter.hears.wait(_BETWEEN_TRIALS_S)


def _batch(sequence: int) -> ImuBatch:
    time_ns = np.arange(_SAMPLES, dtype=np.int64) * 5_000_000 + sequence * 50_000_000 + 1
    return ImuBatch.from_arrays(sequence, time_ns, np.ones((_SAMPLES, 3)), np.zeros((_SAMPLES, 3)))
