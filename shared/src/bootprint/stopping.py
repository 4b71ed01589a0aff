"""How whatever runs for a while ends: Ctrl-C, SIGTERM, a time limit, a parent that is gone; all of them cleanly."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Self

_POLL_S = 0.1


class Stop:
    """While entered, SIGINT, SIGTERM and SIGHUP only ask for the end; so does a duration (host s) that has passed.

    The handler sets a plain flag: setting a `threading.Event` there can deadlock with a wait on it.
    """

    def __init__(self, duration_s: float | None = None) -> None:
        self._asked = False
        self._duration_s = duration_s
        self._deadline: float | None = None
        self._before: dict[signal.Signals, Callable[[int, FrameType | None], Any] | int | None] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            self._before[number] = signal.signal(number, self._ask)
        self.restart()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self._asked = True

    def watch_input(self) -> None:
        """Ask for the end when standard input closes: a parent that dies, however it dies, closes it."""
        threading.Thread(target=self._read_to_the_end, name="standard input", daemon=True).start()

    def _read_to_the_end(self) -> None:
        # Not sys.stdin: a thread inside its buffer when the interpreter ends makes the process abort.
        while os.read(sys.stdin.fileno(), 1024):
            pass
        self.finish()

    def restart(self) -> None:
        """Count the duration from now on."""
        self._deadline = None if self._duration_s is None else time.monotonic() + self._duration_s

    def finish(self) -> None:
        """Ask for the end."""
        self._asked = True

    def is_set(self) -> bool:
        """Whether the end has come."""
        return self._asked or (self._deadline is not None and time.monotonic() >= self._deadline)

    def wait(self, timeout_s: float) -> bool:
        """Sleep for ``timeout_s`` or until the end; whether it has come."""
        until = time.monotonic() + timeout_s
        while not self.is_set() and (left := until - time.monotonic()) > 0:
            time.sleep(min(left, _POLL_S))
        return self.is_set()
