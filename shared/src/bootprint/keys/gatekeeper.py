"""A guarded router at work: it tells on the bus, once a second, how it is and who tried what they may not."""

import fcntl
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import structlog

from bootprint.bus import Envelope
from bootprint.config import Computer
from bootprint.keys.guard import KINDS, LOG_FILTER, Attempts, LogReader
from bootprint.keys.register import Certificate
from bootprint.keys.routing import guarded_settings, load_own_register
from bootprint.messages import Health
from bootprint.stopping import Stop
from bootprint.zenoh_bus import EmbeddedRouter, log_to_standard_output

_SERVICE: Final = "router"
_TELL_S: Final = 1.0
_DAY_S: Final = 86_400.0
_SOON_DAYS: Final = 14.0
_PIPE_BYTES: Final = 1 << 20
_READ_BYTES: Final = 1 << 16
_PAUSE_S: Final = 0.05


def run_guarded(computer: Computer, stop: Stop) -> None:
    """Route for this computer until stopped; ConfigError if its keys are not in order."""
    settings = guarded_settings(computer)
    own = load_own_register(computer).of(computer.member.id)
    with _captured_output() as output:
        router = EmbeddedRouter(computer.router, settings)
        try:
            _Gatekeeper(computer, router, own).run(output, stop)
        finally:
            router.close()


@contextmanager
def _captured_output() -> Iterator[int]:
    """What is written to standard output comes out of a pipe while this lasts: zenoh's log."""
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
    sys.stdout.flush()
    before = os.dup(1)
    os.dup2(writing, 1)
    os.close(writing)
    log_to_standard_output(LOG_FILTER)
    try:
        yield reading
    finally:
        os.dup2(before, 1)
        os.close(before)


class _Gatekeeper:
    def __init__(self, computer: Computer, router: EmbeddedRouter, own: Certificate | None) -> None:
        self._computer = computer
        self._own = own
        self._router = router
        self._bus = router.bus()
        self._reader = LogReader(router.name_of)
        self._attempts = Attempts()
        self._lock = threading.Lock()
        self._sequence = 0
        self._log = structlog.get_logger().bind(service=_SERVICE, soldier=computer.member.id)

    def run(self, output: int, stop: Stop) -> None:
        threading.Thread(target=self._listen, args=(output,), name="router's log", daemon=True).start()
        while not stop.wait(_TELL_S):
            self._bus.publish(self._health())
        self._bus.publish(self._health(stopped=True))

    def _listen(self, output: int) -> None:
        """Read what is logged, in few large pieces: a guarded router logs every message."""
        while data := os.read(output, _READ_BYTES):
            attempts = self._reader.read(data)
            with self._lock:
                fresh = self._attempts.note(attempts, time.monotonic())
            for attempt in fresh:
                self._log.warning("attempt", kind=attempt.kind, who=attempt.who, told=str(attempt))
            if len(data) < _READ_BYTES:
                time.sleep(_PAUSE_S)

    def _health(self, *, stopped: bool = False) -> Envelope:
        with self._lock:
            counts, note = dict(self._attempts.counts), self._attempts.told(time.monotonic())
        days = self._days_left()
        if not note and days is not None and days < _SOON_DAYS:
            note = f"this computer's certificate ends in {days:.0f} days; renew it"
        self._sequence += 1
        message = Health(
            time_ns=time.time_ns(),
            sequence=self._sequence,
            service=_SERVICE,
            state="stopped" if stopped else "degraded" if note else "ok",
            counters={f"refused_{kind}": counts.get(kind, 0) for kind in KINDS},
            gauges={
                "sessions": float(self._router.sessions),
                **({} if days is None else {"certificate_days": days}),
            },
            note=note,
        )
        return Envelope(self._computer.identity.address("health", _SERVICE), message)

    def _days_left(self) -> float | None:
        return None if self._own is None else (self._own.until_s - time.time()) / _DAY_S
