"""A serial port that may be unplugged at any time: read, notice the loss, reopen, report."""

from collections import Counter
from collections.abc import Callable

import serial

from bootprint.clock import EventClock
from sensor_gateway.settings import SerialSource

_READ_TIMEOUT_S = 0.1
_MAX_READ = 4096
_BACKOFF_FIRST_S, _BACKOFF_LAST_S = 0.1, 2.0

OnBytes = Callable[[bytes, int], None]
OnCut = Callable[[int], None]
WaitStop = Callable[[float], bool]


class SerialReader:
    """Runs in a thread of its own; hands over bytes with the event time of their arrival."""

    def __init__(
        self, settings: SerialSource, clock: EventClock, on_bytes: OnBytes, on_cut: OnCut, wait_stop: WaitStop
    ) -> None:
        self._settings = settings
        self._clock = clock
        self._on_bytes = on_bytes
        self._on_cut = on_cut
        self._wait_stop = wait_stop
        self.counts = Counter(bytes=0, opened=0, lost=0)
        self.fault = f"{settings.port}: not open yet"

    def run(self) -> None:
        """Open and read until told to stop; every loss is followed by attempts to reopen."""
        backoff_s = _BACKOFF_FIRST_S
        while not self._wait_stop(0.0):
            opened = self.counts["opened"]
            try:
                self._read_port()
            except (serial.SerialException, OSError) as error:
                self.fault = f"{self._settings.port}: {error}"
            if self.counts["opened"] > opened:
                self.counts["lost"] += 1
                self._on_cut(self._clock.now_ns())
                backoff_s = _BACKOFF_FIRST_S
            if self._wait_stop(backoff_s):
                return
            backoff_s = min(2.0 * backoff_s, _BACKOFF_LAST_S)

    def _read_port(self) -> None:
        """Read until the port fails or the service stops."""
        settings = self._settings
        with serial.Serial(settings.port, settings.baud, timeout=_READ_TIMEOUT_S, exclusive=True) as port:
            self.counts["opened"] += 1
            self.fault = ""
            while not self._wait_stop(0.0):
                data = port.read(1)  # waits for the first byte; what else has come is taken with it
                if data:
                    self._deliver(data + port.read(min(port.in_waiting, _MAX_READ)))

    def _deliver(self, data: bytes) -> None:
        self.counts["bytes"] += len(data)
        self._on_bytes(data, self._clock.now_ns())
