"""One companion: a bounded queue, a thread that empties it in batches, and a sink that makes something of them."""

import queue
import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final, Literal, Protocol

import structlog

from bootprint.bus import Envelope
from bootprint.errors import BootprintError
from bootprint.figures import Figures

_RETRY_S: Final = 1.0
_LEAVE_S: Final = 10.0

Fate = Literal["waiting", "kept", "unkept"]
"""What becomes of what somebody was told; ``unkept``: it may never be, and nobody is to wait for it."""
Promise = Callable[[], Fate]
"""Tells the fate by now, whenever asked."""


class Sink(Protocol):
    """What a companion does; all methods but `wants` and `counters` are called in its thread.

    ``name`` prefixes its counters. `take` is called at least every ``interval_s`` (host time), with at most
    ``most`` envelopes, perhaps none; an OSError or BootprintError is counted and told in health. With ``keeps``
    the same envelopes are then offered again until they are taken.
    """

    name: str
    interval_s: float
    most: int
    keeps: bool

    def wants(self, envelope: Envelope) -> bool:
        """Whether this envelope is for it; called in the hub's thread, so quick."""

    def take(self, envelopes: list[Envelope]) -> None:
        """Make something of these, in the order in which they came."""

    def counters(self) -> dict[str, int]:
        """Counts of its own, from any thread."""

    def close(self) -> None:
        """Let go of everything."""


class Worker:
    """Runs a sink. Counts what was taken, what found the queue full (``dropped``), and faults.

    Told by the hub's thread and by those of the bus: what is laid into the queue is counted in the same step, or a
    promise would be of less than what lies before it.
    """

    def __init__(self, sink: Sink, capacity: int = 20_000) -> None:
        self._sink = sink
        self._queue: queue.Queue[Envelope] = queue.Queue(capacity)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=sink.name, daemon=True)
        self._telling = threading.Lock()
        self._taken = self._dropped = self._faults = 0
        self._told = self._done = self._given_up = 0
        self._note = ""

    def start(self) -> None:
        """Begin to work."""
        self._thread.start()

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """Lay what the sink wants into its queue; never waits."""
        self.entrust(envelopes)

    def entrust(self, envelopes: Iterable[Envelope]) -> Promise:
        """`tell`, and whether these are kept. Who keeps nothing need not be waited for."""
        with self._telling:
            told, dropped, given_up = self._told, self._dropped, self._given_up
            for envelope in filter(self._sink.wants, envelopes):
                self._lay(envelope)
            if not self._sink.keeps:
                return lambda: "kept"
            if self._dropped != dropped:
                return lambda: "unkept"
            return partial(self._fate, told, self._told, given_up)

    def _lay(self, envelope: Envelope) -> None:
        try:
            self._queue.put_nowait(envelope)
        except queue.Full:
            self._dropped += 1
        else:
            self._told += 1

    def _fate(self, begin: int, end: int, given_up: int) -> Fate:
        """Of the envelopes after ``begin`` up to ``end``; unkept, too, if anything was given up since they came."""
        if begin == end:
            return "kept"
        if self._done >= end:
            return "kept" if self._given_up == given_up else "unkept"
        return "unkept" if self._note else "waiting"

    def figures(self) -> Figures:
        """Counters and gauges under the sink's name; what is wrong as a note."""
        name = self._sink.name
        counts = {"taken": self._taken, "dropped": self._dropped, "faults": self._faults}
        counters = {f"{name}_{key}": count for key, count in (counts | self._sink.counters()).items()}
        gauges = {f"{name}_waiting": float(self._queue.qsize())}
        return Figures("degraded" if self._note else "ok", counters, gauges, self._note)

    def close(self) -> None:
        """Work off what waits (a sink that fails now has had its chance), then stop."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(_LEAVE_S)

    def _run(self) -> None:
        batch: list[Envelope] = []
        while not self._stopping.is_set() or not self._queue.empty():
            batch = batch or self._collect()
            if self._taken_by_sink(batch):
                batch = self._dispose(batch)
            elif self._stopping.is_set():
                break
            else:
                batch = batch if self._sink.keeps else self._dispose(batch)
                self._stopping.wait(_RETRY_S)
        self._sink.close()

    def _dispose(self, batch: list[Envelope]) -> list[Envelope]:
        """These are kept or given up."""
        self._done += len(batch)
        return []

    def _collect(self) -> list[Envelope]:
        """What comes within an interval, up to as many as the sink takes at once."""
        until = time.monotonic() + self._sink.interval_s
        batch: list[Envelope] = []
        while len(batch) < self._sink.most:
            left_s = 0.0 if self._stopping.is_set() else max(0.0, until - time.monotonic())
            try:
                batch.append(self._queue.get(timeout=left_s) if left_s else self._queue.get_nowait())
            except queue.Empty:
                break
        return batch

    def _taken_by_sink(self, batch: list[Envelope]) -> bool:
        try:
            self._sink.take(batch)
        except (OSError, BootprintError) as error:
            self._faults += 1
            self._warn(f"{self._sink.name}: {error}")
            return False
        except Exception:
            # A bug in what accompanies the hub must not end it: as in the scaffold, told and survived.
            self._faults += 1
            self._note = f"{self._sink.name}: a fault of the program, see the log"
            self._given_up += len(batch)
            structlog.get_logger().exception("companion failed", companion=self._sink.name)
            return True
        self._taken += len(batch)
        self._note = ""
        return True

    def _warn(self, note: str) -> None:
        """Log what is wrong once, until it changes."""
        if note != self._note:
            structlog.get_logger().warning(note)
        self._note = note
