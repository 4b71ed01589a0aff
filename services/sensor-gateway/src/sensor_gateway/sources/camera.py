"""A live stereo camera: two devices that OpenCV opens, grabbed together; odometry runs in the reader's thread."""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Any

import cv2

from bootprint.bus import Envelope
from bootprint.clock import EventClock
from bootprint.messages import CameraMotion, ImuBatch
from bootprint.topics import Identity
from sensor_gateway.settings import CameraSource
from sensor_gateway.stereo import InertialOdometry, Sample, StereoOdometry, Verdict
from sensor_gateway.stereo.images import Pixels

_AGAIN_S = 1.0  # until devices that fell silent are opened anew
_EARLY = 0.6  # of a period: stamps tremble, and no pair of a camera of the same rate is to be skipped
_PATIENCE_NS = 300_000_000  # a pair waits so long for the samples of the unit beside the camera
_SILENT_NS = 1_500_000_000
Told = CameraMotion | Verdict


class StereoReader:
    """Reads pairs until told to stop; devices that are unplugged are opened again."""

    def __init__(
        self,
        source: CameraSource,
        odometry: StereoOdometry,
        clock: EventClock,
        on_told: Callable[[Told], None],
        wait_stop: Callable[[float], bool],
    ) -> None:
        self.counts: dict[str, int] = Counter(pairs=0, pairs_skipped=0, openings=0)
        self.fault = ""
        self._source, self._odometry, self._clock = source, odometry, clock
        self._on_told, self._wait_stop = on_told, wait_stop
        self._period_ns = round(1e9 / source.rate_hz)
        self._due_ns = -(1 << 62)
        self._unit = None if source.imu is None else InertialOdometry(odometry)
        self._heard: deque[ImuBatch] = deque(maxlen=100)
        self._felt_ns = 0
        self._pairs: deque[tuple[int, Pixels, Pixels]] = deque(maxlen=10)

    def hear(self, envelopes: Iterable[Envelope]) -> None:
        """What other sources told; from the main loop."""
        for envelope in envelopes:
            if isinstance(envelope.message, ImuBatch) and envelope.address.source == self._source.imu:
                self._heard.append(envelope.message)

    def run(self) -> None:
        """Grab, follow, tell."""
        while not self._wait_stop(0.0):
            self._read_until_it_fails()
            self.fault = f"camera {self._source.left!r} or {self._source.right!r} gives no images"
            self._wait_stop(_AGAIN_S)

    def _read_until_it_fails(self) -> None:
        devices = [cv2.VideoCapture(device) for device in (self._source.left, self._source.right)]
        self.counts["openings"] += 1
        try:
            while not self._wait_stop(0.0) and self._read(devices):
                self.fault = ""
        finally:
            for device in devices:
                device.release()

    def _read(self, devices: list[Any]) -> bool:
        """One pair: both are grabbed before either is decoded, so that they are of one moment."""
        grabbed = [device.grab() for device in devices]
        time_ns = self._clock.now_ns()
        if not all(grabbed):
            return False
        if time_ns < self._due_ns:
            self.counts["pairs_skipped"] += 1
            return True
        self._due_ns = max(self._due_ns + self._period_ns, time_ns + round(_EARLY * self._period_ns))
        images = [device.retrieve() for device in devices]
        if not all(sound for sound, _ in images):
            return False
        self._pairs.append((time_ns, images[0][1], images[1][1]))
        self._feel()
        while self._pairs and self._is_felt(self._pairs[0][0], time_ns):
            self._follow(*self._pairs.popleft())
        return True

    def _feel(self) -> None:
        """Samples of the unit go to odometry."""
        while self._heard and self._unit is not None:
            batch = self._heard.popleft()
            for time_ns, force, rate in zip(batch.times.tolist(), batch.accel, batch.gyro, strict=True):
                self._unit.feed_sample(Sample(time_ns, force, rate))
                self._felt_ns = time_ns

    def _is_felt(self, pair_ns: int, now_ns: int) -> bool:
        """Whether the samples up to a pair are there, or will not come."""
        return self._unit is None or self._felt_ns >= pair_ns or now_ns - pair_ns > _PATIENCE_NS

    def _follow(self, time_ns: int, left: Pixels, right: Pixels) -> None:
        begin = time.perf_counter_ns()
        told = (self._unit or self._odometry).feed(time_ns, left, right)
        self.counts["pairs"] += 1
        self.counts["work_us"] = (time.perf_counter_ns() - begin) // 1000
        self._on_told(told)


class CameraIntake:
    """What a camera told, as envelopes and as health; in the main loop."""

    def __init__(self, identity: Identity, name: str) -> None:
        self._address = identity.address("camera_motion", name)
        self._name = name
        self._counts: Counter[str] = Counter()
        self._motion_ns: int | None = None
        self._verdict = "no image yet"

    def take(self, told: Told) -> list[Envelope]:
        """A motion goes out; a verdict is counted."""
        if isinstance(told, Verdict):
            self._counts[f"verdict_{told.condition}"] += 1
            self._verdict = told.words
            return []
        self._counts["motions"] += 1
        self._motion_ns = told.time_ns
        return [Envelope(self._address, told)]

    def tick(self, host_ns: int) -> list[Envelope]:
        """Nothing waits here."""
        return []

    def cut(self, host_ns: int) -> list[Envelope]:
        """Nothing waits here."""
        return []

    def counters(self) -> dict[str, int]:
        """Motions, and verdicts by condition."""
        return dict(self._counts)

    def gauges(self) -> dict[str, float]:
        """None."""
        return {}

    def silent(self, host_ns: int, opened_ns: int) -> list[str]:
        """Why no motion is told, if none has been for a while."""
        since_ns = opened_ns if self._motion_ns is None else self._motion_ns
        if host_ns - since_ns <= _SILENT_NS:
            return []
        return [f"camera_motion/{self._name} is silent: {self._verdict}"]

    def notes(self) -> list[str]:
        """None."""
        return []
