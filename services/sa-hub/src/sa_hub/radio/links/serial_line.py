"""A modem on a serial port: half duplex, paced to the line, and opened again whenever it was unplugged.

One thread owns the port. A frame waits alone: it goes when the last one has left at the line's rate and nobody was
heard for the guard time, to which up to as much again is added by chance, so that two who waited for the same
silence do not speak at once. Until then the link is busy, and the net keeps back what it has to say.
"""

import contextlib
import random
import selectors
import socket
import threading
import time
from collections.abc import Callable
from typing import Final

import serial
import structlog

from sa_hub.radio.link_profile import DEFAULT_BAUD, LinkProfile
from sa_hub.radio.links.framing import Deframer, framed

DEFAULT_GUARD_S: Final = 0.05
_BITS_PER_BYTE: Final = 10  # start bit, eight of data, stop bit
_MAX_READ: Final = 4096
_BACKOFF_FIRST_S, _BACKOFF_LAST_S = 0.1, 2.0


class SerialLink:
    """A modem's port; ``on_frame`` is called in the link's thread. ``garbled`` counts what was no frame."""

    def __init__(self, profile: LinkProfile, on_frame: Callable[[bytes], None]) -> None:
        assert profile.port is not None
        self.name = profile.name
        self.send_faults = 0
        self.fault = f"{profile.port}: not open yet"
        self._port = profile.port
        self._baud = profile.baud or DEFAULT_BAUD
        self._guard_s = DEFAULT_GUARD_S if profile.guard_s is None else profile.guard_s
        self._on_frame = on_frame
        self._deframer = Deframer()
        self._waiting: bytes | None = None
        self._quiet_at_s = 0.0
        """Host time from which on we may speak."""
        self._wake, self._woken = socket.socketpair()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"link {profile.name}", daemon=True)

    @property
    def garbled(self) -> int:
        """Pieces between delimiters that were no frame."""
        return self._deframer.garbled

    @property
    def busy(self) -> bool:
        """A frame waits or leaves, somebody was heard just now, or the port is not there."""
        return bool(self.fault) or self._waiting is not None or time.monotonic() < self._quiet_at_s

    def start(self) -> None:
        """Open the port, now or as soon as it is there."""
        self._thread.start()

    def poll(self) -> None:
        """Nothing to do: the link's thread hands over what arrives."""

    def send(self, data: bytes) -> None:
        """Have one frame wait for its turn; one that finds another waiting, or no port, is lost."""
        if self.fault or self._waiting is not None:
            self.send_faults += 1
            return
        self._waiting = framed(data)
        self._nudge()

    def close(self) -> None:
        """Close the port."""
        self._stopping.set()
        self._nudge()
        if self._thread.is_alive():
            self._thread.join()
        self._wake.close()
        self._woken.close()

    def _nudge(self) -> None:
        with contextlib.suppress(OSError):  # closed already
            self._wake.send(b"\x00")

    # -- the link's thread ------------------------------------------------------------------------------------

    def _run(self) -> None:
        backoff_s = _BACKOFF_FIRST_S
        while not self._stopping.is_set():
            try:
                with serial.Serial(
                    self._port, self._baud, timeout=0, write_timeout=0, exclusive=True
                ) as port:
                    backoff_s, self.fault = _BACKOFF_FIRST_S, ""
                    self._serve(port)
            except (serial.SerialException, OSError) as error:
                self._lost(error)
            self._stopping.wait(backoff_s)
            backoff_s = min(2.0 * backoff_s, _BACKOFF_LAST_S)

    def _lost(self, error: Exception) -> None:
        """The port is gone: what waited goes with it, since it will be old when the port is back."""
        if not self.fault:
            structlog.get_logger().warning("serial link lost", link=self.name, error=str(error))
        self.fault = f"{self._port}: {error}"
        self.send_faults += self._waiting is not None
        self._waiting = None

    def _serve(self, port: serial.Serial) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(port.fileno(), selectors.EVENT_READ)
            selector.register(self._woken, selectors.EVENT_READ)
            while not self._stopping.is_set():
                ready = [key.fileobj for key, _ in selector.select(self._wait_s())]
                if self._woken in ready:
                    self._woken.recv(64)
                if port.fileno() in ready:
                    self._hear(port.read(_MAX_READ))
                self._speak(port)

    def _wait_s(self) -> float | None:
        """Until what waits may go; for ever if nothing does."""
        return None if self._waiting is None else max(0.0, self._quiet_at_s - time.monotonic())

    def _hear(self, data: bytes) -> None:
        pause_s = self._guard_s * (1.0 + random.random())
        self._quiet_at_s = max(self._quiet_at_s, time.monotonic() + pause_s)
        for frame in self._deframer.feed(data):
            self._on_frame(frame)

    def _speak(self, port: serial.Serial) -> None:
        if self._waiting is None or time.monotonic() < self._quiet_at_s:
            return
        waiting = self._waiting
        written = port.write(waiting) or 0
        leaves_s = _BITS_PER_BYTE * written / self._baud
        self._quiet_at_s = time.monotonic() + leaves_s + self._guard_s
        self.send_faults += written < len(waiting)
        self._waiting = None
