"""Replay: a recording's messages published at the pace of the event clock."""

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Protocol

from bootprint.bus import Envelope
from bootprint.errors import BootprintError, RecordingError
from bootprint.messages import ImuBatch, Message
from bootprint.service import EXIT_BAD_INPUT, Context
from bootprint.topics import Address, Identity
from sensor_gateway.rates import RateMeter
from sensor_gateway.recordings.run import Run
from sensor_gateway.recordings.series import Pieces
from sensor_gateway.settings import ReplaySource
from sensor_gateway.sources.run_messages import run_messages, sensor_messages
from sensor_gateway.stamps import due_ns, restamped

__all__ = ["DEFAULT_START_NS", "Recording", "Replay", "open_recording", "run_messages"]

# Where event time begins when nothing says otherwise and no clock runs: 2026-01-01T00:00:00Z.
DEFAULT_START_NS = 1_767_225_600 * 1_000_000_000
_LEAD_NS = 500_000_000
_LOOP_PAUSE_NS = 1_000_000_000
_WAIT_FOR_S = 60.0
_TLOG, _MCAP = ".tlog", ".mcap"


class Recording(Protocol):
    """Something that can be played, any number of times."""

    counts: Counter[str]

    def messages(self, start_ns: int) -> Iterator[Envelope]:
        """All messages with the recording's beginning at ``start_ns``, in the order in which they are due."""


class RunRecording:
    """A run folder or a data set's run: ``pieces`` gives it from its beginning."""

    def __init__(self, pieces: Callable[[], Pieces], settings: ReplaySource, identity: Identity) -> None:
        self.counts: Counter[str] = Counter()
        self._pieces = pieces
        self._settings = settings
        self._identity = identity

    def messages(self, start_ns: int) -> Iterator[Envelope]:
        """The run's messages."""
        settings = self._settings
        return sensor_messages(
            self._pieces(), self._identity, start_ns, settings.batch_size, settings.batch_age_ns
        )


def open_recording(path: Path, settings: ReplaySource, identity: Identity) -> Recording:
    """Open whatever stands at ``path``; RecordingError says what is wrong with it."""
    if not path.exists():
        raise RecordingError(f"{path}: no such recording")
    if path.suffix == _TLOG:
        from sensor_gateway.sources.tlog import TlogRecording  # brings the decoders' libraries

        return TlogRecording(path, settings, identity)
    if path.suffix == _MCAP:
        from sensor_gateway.sources.bus_replay import BusRecording  # brings the MCAP library

        return BusRecording(path, identity, settings.soldier or identity.soldier)
    if _is_camera(path):
        return _open_camera(path, settings.run, identity)
    return RunRecording(_open_run(path, settings.run), settings, identity)


def _is_camera(path: Path) -> bool:
    from sensor_gateway.recordings import camera_folder

    return path.is_dir() and camera_folder.recognises(path)


def _open_camera(path: Path, name: str | None, identity: Identity) -> Recording:
    from sensor_gateway.stereo.recorded import CameraRecording  # brings OpenCV

    stereo = _choose_run(path, name).stereo
    assert stereo is not None
    return CameraRecording(stereo, path, identity)


def _open_run(path: Path, name: str | None) -> Callable[[], Pieces]:
    """A run folder is read while it is played, for it may be long; data sets are read at once."""
    from sensor_gateway.recordings import run_folder

    if path.is_dir() and name in (None, path.resolve().name) and run_folder.recognises_folder(path):
        from sensor_gateway.recordings.folder_stream import FolderStream

        return FolderStream(path).pieces
    return partial(Pieces.of, _choose_run(path, name))


def _choose_run(path: Path, name: str | None) -> Run:
    from sensor_gateway.recordings import load_runs  # brings every format's libraries

    runs = {run.name: run for run in load_runs([path])}
    if name is None and len(runs) == 1:
        return next(iter(runs.values()))
    if name is not None and name in runs:
        return runs[name]
    wanted = f"has no run {name!r}" if name else "holds several runs; choose one with run ="
    raise RecordingError(f"{path}: {wanted} (runs: {', '.join(sorted(runs)) or 'none'})")


class Replay:
    """Opened when it is built; `run` is for a thread of its own.

    Messages go out together on the services' beat, in event time: their readers look at the bus no more often, and
    a wake-up for each would cost more than the message.
    """

    def __init__(self, context: Context, settings: ReplaySource) -> None:
        self._context = context
        self._settings = settings
        self._recording = open_recording(context.computer.relative(settings.path), settings, context.identity)
        self._beat_ns = round(context.options.beat_s * 1e9)
        self._rates = RateMeter()
        self._position_ns = 0
        self._start_ns = 0
        self._from_ns = 0
        self._published: Counter[str] = Counter(messages=0, loops=0, skipped=0)
        self.finished = False

    def run(self) -> None:
        """Wait for those who listen, then publish everything at its time, once or in a loop."""
        try:
            if self._wait_for_listeners() and self._play_all(self._first_start_ns()):
                self.finished = True
                self._context.log.info("replay finished", messages=self._published["messages"])
                if self._settings.exit_when_done:
                    self._context.finish()
        except BootprintError as error:
            self._context.log.error("replay failed", error=str(error))
            self._context.finish(EXIT_BAD_INPUT)

    def _wait_for_listeners(self) -> bool:
        context, wanted = self._context, self._context.options.wait_for
        if not wanted or context.wait_alive(wanted, _WAIT_FOR_S):
            return True
        if not context.stopping.is_set():
            context.log.error("replay not started: services missing", wanted=",".join(wanted))
            context.finish(1)
        return False

    def counters(self) -> dict[str, int]:
        """Messages played, loops, and what was damaged in the recording."""
        return {**self._recording.counts, **self._published}

    def gauges(self) -> dict[str, float]:
        """Rates, and how far into the recording the replay is."""
        return {**self._rates.take(), "replayed_s": (self._position_ns - self._start_ns) / 1e9}

    def _first_start_ns(self) -> int:
        if self._settings.start_time_s is not None:
            return round(self._settings.start_time_s * 1e9)
        if self._context.options.speed == "max":
            return DEFAULT_START_NS
        return self._context.clock.now_ns() + _LEAD_NS

    def _play_all(self, start_ns: int) -> bool:
        """Whether the replay came to its end (and was not stopped)."""
        numbering = _Numbering()
        self._from_ns = self._context.clock.now_ns() if self._settings.skip_past else 0
        self._context.log.info("replay begins", path=self._settings.path, start_ns=start_ns)
        while self._play_once(start_ns, numbering):
            if not self._settings.loop:
                return True
            self._published["loops"] += 1
            numbering.begin_loop()
            start_ns = self._position_ns + _LOOP_PAUSE_NS
        return False

    def _play_once(self, start_ns: int, numbering: "_Numbering") -> bool:
        self._start_ns = self._position_ns = start_ns
        reached_ns = 0
        for envelope in self._recording.messages(start_ns):
            due = due_ns(envelope.message)
            if due < self._from_ns:
                numbering.renumbered(envelope)
                self._published["skipped"] += 1
                continue
            if due > reached_ns:
                reached_ns = -(-due // self._beat_ns) * self._beat_ns
                if not self._wait_until(reached_ns):
                    return False
            self._context.publish(numbering.renumbered(envelope))
            self._note(envelope, due)
        return True

    def _wait_until(self, event_ns: int) -> bool:
        """Whether that event time was reached before the service was stopped."""
        clock, context = self._context.clock, self._context
        while (wait_s := clock.host_seconds_until(event_ns)) > 0.0:
            if context.wait_stop(wait_s):
                return False
        return not context.wait_stop(0.0)

    def _note(self, envelope: Envelope, due: int) -> None:
        self._context.clock.observe(due)
        self._position_ns = max(self._position_ns, due)
        self._published["messages"] += 1
        address, message = envelope.address, envelope.message
        self._rates.count(address.subject, address.source, _samples(message), due)


class _Numbering:
    """Keeps sequence numbers rising from one loop to the next."""

    def __init__(self) -> None:
        self._base: dict[Address, int] = {}
        self._next: dict[Address, int] = {}

    def begin_loop(self) -> None:
        """What comes now continues behind what was sent."""
        self._base = dict(self._next)

    def renumbered(self, envelope: Envelope) -> Envelope:
        """The envelope with its number counted on from the loops before."""
        address = envelope.address
        sequence = envelope.message.sequence + self._base.get(address, 0)
        self._next[address] = sequence + 1
        if sequence == envelope.message.sequence:
            return envelope
        return Envelope(address, restamped(envelope.message, 0, sequence))


def _samples(message: Message) -> int:
    return len(message.times) if isinstance(message, ImuBatch) else 1
