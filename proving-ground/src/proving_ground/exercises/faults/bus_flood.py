"""A flood on a computer's bus: half of it rubbish where samples are expected, half valid and needed by nobody."""

import random
import time

import numpy as np

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.errors import BusError
from bootprint.messages import ImuBatch
from bootprint.topics import BY_SUBJECT, Identity
from bootprint.zenoh_bus import ZenohBus, open_bus

_UNITS = 3
_RUBBISH_BYTES = 900  # about a batch of ten samples
_MOST_AT_ONCE_S = 1.0
_PLACE = "flood"


class BusFlood:
    """Pours ``times`` as many messages as three inertial units send, whenever `pour` is called."""

    def __init__(self, router: str, identity: Identity, times: float, clock: EventClock) -> None:
        self._bus: ZenohBus = open_bus(router)
        self._rubbish = self._bus.raw_publisher(identity.address("imu", "left_foot").key)
        self._address = identity.address("imu", _PLACE)
        self._clock = clock
        rate_hz = BY_SUBJECT["imu"].rate_hz or 0.0
        self._each_s = 1.0 / (times * _UNITS * rate_hz)
        self._poured_s = time.monotonic()
        self._random = random.Random(1)
        self._count = 0

    def pour(self) -> None:
        """What is due since the last time, of a second at most."""
        now_s = time.monotonic()
        self._poured_s = max(self._poured_s, now_s - _MOST_AT_ONCE_S)
        while self._poured_s < now_s:
            self._poured_s += self._each_s
            self._count += 1
            self._drop()

    def _drop(self) -> None:
        if self._count % 2:
            try:
                self._rubbish(self._random.randbytes(_RUBBISH_BYTES))
            except BusError:
                return  # no router: nobody to flood
            return
        times = self._clock.now_ns() + np.arange(10, dtype=np.int64) * 5_000_000
        batch = ImuBatch.from_arrays(self._count, times, np.zeros((10, 3)), np.zeros((10, 3)))
        self._bus.publish(Envelope(self._address, batch))

    def close(self) -> None:
        """No more."""
        self._bus.close()
