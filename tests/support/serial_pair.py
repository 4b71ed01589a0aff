"""Two pseudo-terminals joined by a line of a given baud rate that can be disturbed, unplugged, and counted."""

import os
import selectors
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path

BITS_PER_BYTE = 10


class _End:
    """One end: ``path`` is where its modem's port stands, as under /dev/serial/by-id."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.master = -1
        self.passed: list[tuple[float, bytes]] = []
        """(host time, bytes) that this end sent, as they left the line."""

    def plug(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.path.symlink_to(os.ttyname(slave))
        os.close(slave)

    def unplug(self) -> None:
        self.path.unlink()
        master, self.master = self.master, -1
        os.close(master)


class SerialPair:
    """What one end sends comes out of the other at ``baud``; a thread carries it from `start` to `close`."""

    def __init__(self, folder: Path, baud: int) -> None:
        self.ends = (_End(folder / "one"), _End(folder / "two"))
        self._byte_s = BITS_PER_BYTE / baud
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._threads = [
            threading.Thread(target=self._carry, args=pair, daemon=True) for pair in ((0, 1), (1, 0))
        ]
        for end in self.ends:
            end.plug()

    def start(self) -> None:
        """Put the line into service."""
        for thread in self._threads:
            thread.start()

    def inject(self, end: int, garbage: bytes) -> None:
        """Noise that comes out of the line at this end."""
        with self._lock:
            os.write(self.ends[end].master, garbage)

    def unplug(self, end: int) -> None:
        """Pull this end's modem out of its computer."""
        with self._lock:
            self.ends[end].unplug()

    def plug(self, end: int) -> None:
        """Put it back."""
        with self._lock:
            self.ends[end].plug()

    def close(self) -> None:
        """End the line."""
        self._stopping.set()
        for thread in self._threads:
            thread.join()
        for end in self.ends:
            if end.master >= 0:
                end.unplug()

    def _carry(self, source: int, sink: int) -> None:
        """Byte by byte, each when its time on the line is over."""
        begin, end = self.ends[source], self.ends[sink]
        free_at_s = 0.0
        while not self._stopping.is_set():
            data = self._taken(begin)
            for byte in data:
                free_at_s = max(free_at_s, time.monotonic()) + self._byte_s
                while (left_s := free_at_s - time.monotonic()) > 0.0:
                    self._stopping.wait(left_s)
                begin.passed.append((free_at_s, bytes([byte])))
                with self._lock, suppress(OSError):
                    os.write(end.master, bytes([byte]))

    def _taken(self, end: _End) -> bytes:
        """Up to a few bytes that the end has sent; waits a moment for them."""
        with self._lock:
            master = end.master
        if master < 0:
            self._stopping.wait(0.01)
            return b""
        with selectors.DefaultSelector() as selector, suppress(OSError, ValueError):
            selector.register(master, selectors.EVENT_READ)
            if selector.select(0.02):
                return os.read(master, 8)
        self._stopping.wait(0.01)  # nobody has the port open, or it was pulled just now
        return b""
