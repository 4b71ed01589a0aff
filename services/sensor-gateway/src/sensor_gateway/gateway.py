"""The gateway's inside: one reader thread a source, and all thinking in the main loop.

A reader's thread only moves bytes; decoding, clocks and batches live in an `Intake` that the main loop alone
calls. A replay publishes finished messages from its own thread, at the pace of the event clock.
"""

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, ParamSpec, Protocol, TypeVar

from bootprint.bus import Envelope
from bootprint.errors import ConfigError
from bootprint.figures import Figures
from bootprint.service import Context, Part
from sensor_gateway import settings as config
from sensor_gateway.host_utc import HostUtc
from sensor_gateway.sources.replay import Replay

if TYPE_CHECKING:
    from sensor_gateway.intake import Intake
    from sensor_gateway.sources.camera import CameraIntake, StereoReader

_JOIN_S = 2.0
_IDLE_BEAT_S = 0.5  # of a gateway that only replays: its main loop has nothing to wait for
P = ParamSpec("P")
Value = TypeVar("Value")


class Reader(Protocol):
    """A live source of bytes."""

    @property
    def counts(self) -> dict[str, int]:
        """Bytes and faults since the start."""

    @property
    def fault(self) -> str:
        """What is wrong now; empty while all is well."""

    def run(self) -> None:
        """Read until told to stop."""


@dataclass(frozen=True, slots=True)
class LiveSource:
    """A reader, and the intake that its bytes go to."""

    name: str
    reader: Reader
    intake: "Intake | CameraIntake"


@dataclass(frozen=True, slots=True)
class ReplayedSource:
    """A recording that is played."""

    name: str
    reader: Replay


class Gateway:
    """All sources of this computer."""

    def __init__(self, context: Context, settings: config.GatewaySettings) -> None:
        self._context = context
        self._settings = settings
        self._live: list[LiveSource] = []
        self._replayed: list[ReplayedSource] = []
        self._cameras: list[StereoReader] = []
        self._threads: list[threading.Thread] = []
        self._opened_ns = 0
        self._host = HostUtc()
        self._logged_steps = 0

    def start(self) -> None:
        """Open every source, so that what is wrong is said at once; then let them run."""
        for number, source in enumerate(self._settings.sources):
            self._open(source, f"{source.__struct_config__.tag}{number}")
        if not self._live:
            self._context.beat_s = max(self._context.beat_s, _IDLE_BEAT_S)
        self._opened_ns = self._context.clock.now_ns()
        bodies = {opened.name: opened.reader.run for opened in self._live}
        bodies |= {opened.name: opened.reader.run for opened in self._replayed}
        self._threads = [
            threading.Thread(target=body, name=name, daemon=True) for name, body in bodies.items()
        ]
        for thread in self._threads:
            thread.start()

    def _open(self, source: config.Source, name: str) -> None:
        if isinstance(source, config.ReplaySource):
            self._replayed.append(ReplayedSource(name, Replay(self._context, source)))
            return
        if isinstance(source, config.CameraSource):
            self._live.append(self._camera(source, name))
            return
        from sensor_gateway.intake import (
            Intake,
        )  # brings the decoders' libraries, which a replay has no use for

        intake = Intake(self._context.identity, source, self._host)
        self._live.append(LiveSource(name, self._reader(source, intake), intake))

    def _camera(self, source: config.CameraSource, name: str) -> LiveSource:
        from sensor_gateway.recordings.camera_folder import projections
        from sensor_gateway.sources.camera import CameraIntake, StereoReader  # brings OpenCV
        from sensor_gateway.stereo import StereoCalibration, StereoOdometry

        context = self._context
        path = context.computer.relative(source.calibration)
        try:
            odometry = StereoOdometry(StereoCalibration.of_projections(*projections(path)))
        except ValueError as error:
            raise ConfigError(f"{path}: {error}") from error
        intake = CameraIntake(context.identity, source.name)
        reader = StereoReader(source, odometry, context.clock, self._posted(intake.take), context.wait_stop)
        self._cameras.append(reader)
        return LiveSource(name, reader, intake)

    def _heard(self, job: Callable[P, list[Envelope]]) -> Callable[P, list[Envelope]]:
        """The same call, whose outcome the cameras hear too: a unit that sits beside one is of another source."""

        def call(*args: P.args, **kwargs: P.kwargs) -> list[Envelope]:
            envelopes = job(*args, **kwargs)
            for camera in self._cameras:
                camera.hear(envelopes)
            return envelopes

        return call

    def _reader(self, source: config.SerialSource | config.UdpSource, intake: "Intake") -> Reader:
        from sensor_gateway.sources.serial import SerialReader
        from sensor_gateway.sources.udp import UdpReader

        context = self._context
        on_bytes = self._posted(self._heard(intake.feed))
        if isinstance(source, config.UdpSource):
            return UdpReader(source, context.clock, on_bytes, context.wait_stop)
        return SerialReader(source, context.clock, on_bytes, self._posted(intake.cut), context.wait_stop)

    def _posted(self, job: Callable[P, Iterable[Envelope]]) -> Callable[P, None]:
        """The same call, but made by the main loop, which publishes its outcome."""

        def post(*args: P.args, **kwargs: P.kwargs) -> None:
            self._context.post(partial(job, *args, **kwargs))

        return post

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """The gateway listens to nobody."""
        return ()

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """Batches whose sensors fell silent."""
        if self._host.steps > self._logged_steps:
            self._logged_steps = self._host.steps
            self._context.log.warning("host clock against UTC", utc_offset_s=self._host.offset_ns / 1e9)
        return [envelope for source in self._live for envelope in source.intake.tick(now_ns)]

    def figures(self) -> Figures:
        """Faults, counts and rates of every source; degraded while one is unplugged, silent or dead."""
        now_ns = self._context.clock.now_ns()
        counters: dict[str, int] = {"utc_offset_steps": self._host.steps}
        gauges: dict[str, float] = {"utc_offset_s": self._host.offset_ns / 1e9}
        faults = [f"{thread.name}: reader ended" for thread in self._dead()]
        notes = [self._host.note] if self._host.note else []
        for live in self._live:
            counters |= _prefixed(live.name, {**live.reader.counts, **live.intake.counters()})
            gauges |= _prefixed(live.name, live.intake.gauges())
            fault = live.reader.fault
            found = [fault] if fault else live.intake.silent(now_ns, self._opened_ns)
            faults += [f"{live.name}: {text}" for text in found]
            notes += [f"{live.name}: {text}" for text in live.intake.notes()]
        for replayed in self._replayed:
            counters |= _prefixed(replayed.name, replayed.reader.counters())
            gauges |= _prefixed(replayed.name, replayed.reader.gauges())
        return Figures(
            state="degraded" if faults else "ok",
            counters=counters,
            gauges=gauges,
            note="; ".join(faults + notes),
        )

    def _dead(self) -> list[threading.Thread]:
        """Readers that ended although neither the service nor their recording did."""
        done = {replayed.name for replayed in self._replayed if replayed.reader.finished}
        if self._context.stopping.is_set():
            return []
        return [thread for thread in self._threads if not thread.is_alive() and thread.name not in done]

    def close(self) -> Iterable[Envelope]:
        """Let the readers end; what waits in batches still goes out."""
        for thread in self._threads:
            thread.join(_JOIN_S)
        now_ns = self._context.clock.now_ns()
        return [envelope for source in self._live for envelope in source.intake.cut(now_ns)]


def build(context: Context) -> Part:
    """The gateway of this computer; ConfigError on anything wrong in ``[gateway]``."""
    settings = context.computer.section("gateway", config.GatewaySettings)
    config.check(settings, f"{context.computer.path}: [gateway]")
    live = any(not isinstance(source, config.ReplaySource) for source in settings.sources)
    if live and (context.options.speed == "max" or float(context.options.speed) != 1.0):
        raise ConfigError(
            f"--speed {context.options.speed}: live sensors run at speed 1; only replay can be faster"
        )
    return Gateway(context, settings)


def _prefixed(name: str, values: dict[str, Value]) -> dict[str, Value]:
    return {f"{name}.{key}": value for key, value in values.items()}
