"""A UDP socket that listens for sensor datagrams. A bridge may cut frames across datagrams: it is one stream."""

import socket
from collections import Counter
from collections.abc import Callable

from bootprint.clock import EventClock
from bootprint.errors import ConfigError
from sensor_gateway.settings import UdpSource

_READ_TIMEOUT_S = 0.1
_MAX_DATAGRAM = 65_535


class UdpReader:
    """Bound when it is built; `run` is for a thread of its own."""

    def __init__(
        self,
        settings: UdpSource,
        clock: EventClock,
        on_bytes: Callable[[bytes, int], None],
        wait_stop: Callable[[float], bool],
    ) -> None:
        self._clock = clock
        self._on_bytes = on_bytes
        self._wait_stop = wait_stop
        self.counts = Counter(bytes=0, datagrams=0, socket_errors=0)
        self.fault = ""
        self._socket = _bound(settings)

    @property
    def port(self) -> int:
        """The port it listens on (the system's choice if the settings say 0)."""
        return int(self._socket.getsockname()[1])

    def run(self) -> None:
        """Hand over datagrams until told to stop."""
        with self._socket:
            while not self._wait_stop(0.0):
                self._receive()

    def _receive(self) -> None:
        try:
            data = self._socket.recv(_MAX_DATAGRAM)
        except TimeoutError:
            return
        except OSError as error:
            self.counts["socket_errors"] += 1
            self.fault = str(error)
            self._wait_stop(_READ_TIMEOUT_S)
            return
        self.counts["datagrams"] += 1
        self.counts["bytes"] += len(data)
        self._on_bytes(data, self._clock.now_ns())


def _bound(settings: UdpSource) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.settimeout(_READ_TIMEOUT_S)
    try:
        listener.bind((settings.bind, settings.port))
    except OSError as error:
        listener.close()
        raise ConfigError(f"cannot listen on UDP {settings.bind}:{settings.port}: {error}") from error
    return listener
