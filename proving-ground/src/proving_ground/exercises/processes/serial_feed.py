"""Sensors on a line: every soldier's units as MAVLink bytes on a pseudo-terminal, which gateways read as ports.

Each place is a MAVLink system of its own; stamps are UTC, and a SYSTEM_TIME a second says so. Ranges have no
MAVLink message (DISTANCE_SENSOR tells of surfaces), so they stay away.
"""

import heapq
import os
import threading
import tty
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bootprint.clock import EventClock
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.exercises.processes.mavlink_out import PLACES, mavlink_frames

_SLICE_S = 0.01
_WAITING_BYTES = 1 << 16  # what a line holds back before it loses bytes, as a full buffer does
_BAUD = 921_600


class SerialFeed:
    """A pseudo-terminal for each soldier, all written by one thread from `start` on."""

    def __init__(self, exercise: Exercise, folder: Path, clock: EventClock) -> None:
        self._clock = clock
        self._lines = {
            soldier.id: _Line(soldier, folder / soldier.id / "tty") for soldier in exercise.soldiers
        }
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def source(self, soldier: Soldier) -> dict[str, Any]:
        """The gateway's source for a soldier."""
        return self._lines[soldier.id].source()

    def start(self, start_ns: int) -> None:
        """Begin to send: every frame when its sample has been taken."""
        self._thread = threading.Thread(target=self._run, args=(start_ns,), name="serial feed", daemon=True)
        self._thread.start()

    def _run(self, start_ns: int) -> None:
        for line in self._lines.values():
            line.begin(start_ns)
        while not self._stop.wait(_SLICE_S):
            now_ns = self._clock.now_ns()
            for line in self._lines.values():
                line.send_until(now_ns)

    @property
    def lost_bytes(self) -> int:
        """What lines lost because nobody read."""
        return sum(line.lost_bytes for line in self._lines.values())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        for line in self._lines.values():
            line.close()


class _Line:
    """One soldier's pseudo-terminal, under a path that stays."""

    def __init__(self, soldier: Soldier, path: Path) -> None:
        self._soldier = soldier
        self._path = path
        self._frames: Iterator[tuple[int, bytes]] = iter(())
        self._next: tuple[int, bytes] | None = None
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self.lost_bytes = 0
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(slave))
        self._slave = slave  # held open: a line without a reader is no hang-up

    def source(self) -> dict[str, Any]:
        run = self._soldier.run
        found: dict[str, Any] = {
            "kind": "serial",
            "port": str(self._path.absolute()),
            "baud": _BAUD,
            "imus": [{"system": PLACES[place], "place": place} for place in run.imus],
        }
        for name, key in (("pressure", "body"), ("gnss", "gnss"), ("camera", "camera")):
            if getattr(run, name) is not None:
                found[name] = [{"system": PLACES[key], "place": key}]
        return found

    def begin(self, start_ns: int) -> None:
        self._frames = heapq.merge(*mavlink_frames(self._soldier.run, start_ns), key=lambda frame: frame[0])
        self._next = next(self._frames, None)

    def send_until(self, now_ns: int) -> None:
        while self._next is not None and self._next[0] <= now_ns:
            self._queue(self._next[1])
            self._next = next(self._frames, None)
        while self._waiting:
            try:
                written = os.write(self._master, self._waiting[0])
            except BlockingIOError:
                return
            self._waiting_bytes -= written
            rest = self._waiting.popleft()[written:]
            if rest:
                self._waiting.appendleft(rest)

    def _queue(self, frame: bytes) -> None:
        if self._waiting_bytes + len(frame) > _WAITING_BYTES:
            self.lost_bytes += len(frame)
            return
        self._waiting.append(frame)
        self._waiting_bytes += len(frame)

    def close(self) -> None:
        self._path.unlink(missing_ok=True)
        os.close(self._slave)
        os.close(self._master)
