"""MAVLink ``.tlog`` files: before every frame its time of arrival, UTC µs, 8 bytes, big-endian."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.topics import Identity
from sensor_gateway.decoders.mavlink_frame import MARKERS, checksum_holds, stated_length
from sensor_gateway.intake import Intake
from sensor_gateway.settings import Device
from sensor_gateway.stamps import restamped

_STAMP_BYTES = 8
_MAX_FRAME_BYTES = 280
_US_2000, _US_2100 = 946_684_800_000_000, 4_102_444_800_000_000


def frames(data: bytes, counts: Counter[str]) -> Iterator[tuple[int, bytes]]:
    """(received UTC ns, frame) of every sound record; damaged stretches are skipped byte by byte and counted."""
    at, skipping = 0, False
    while at < len(data):
        length = _record_length(data, at)
        if length == 0:
            counts["bytes_skipped"] += 1
            counts["stretches_damaged"] += not skipping
            at, skipping = at + 1, True
            continue
        micros = int.from_bytes(data[at : at + _STAMP_BYTES], "big")
        yield micros * 1000, data[at + _STAMP_BYTES : at + length]
        at, skipping = at + length, False


def _record_length(data: bytes, at: int) -> int:
    """The length of the sound record at ``at``, 0 if there is none."""
    if not _may_begin(data, at):
        return 0
    start = at + _STAMP_BYTES
    frame = bytearray(data[start : start + _MAX_FRAME_BYTES])
    length = stated_length(frame, 0)
    if length <= 0:
        return 0
    holds, end = checksum_holds(frame, 0), start + length
    if holds is None:  # a message of another dialect is known by what follows it
        holds = end == len(data) or _may_begin(data, end)
    return end - at if holds else 0


def _may_begin(data: bytes, at: int) -> bool:
    """Whether a time of this century and the start of a frame stand here."""
    start = at + _STAMP_BYTES
    if start >= len(data) or data[start] not in MARKERS:
        return False
    return _US_2000 <= int.from_bytes(data[at:start], "big") < _US_2100


class TlogRecording:
    """The messages of a tlog, through the same decoder, clock and batches as a live stream."""

    def __init__(self, path: Path, device: Device, identity: Identity) -> None:
        self.counts: Counter[str] = Counter()
        self._device = device
        self._identity = identity
        self._data = path.read_bytes()
        self._first_ns = next((received_ns for received_ns, _ in frames(self._data, Counter())), None)
        if self._first_ns is None:
            raise RecordingError(
                f"{path}: holds no MAVLink frame behind an 8-byte time stamp, so it is no tlog"
            )
        if not device.expected():
            raise RecordingError(
                f"{path}: no MAVLink sensor is mapped to a place; add [[gateway.sources.imus]] (or gnss, "
                "pressure, camera) with system and place"
            )

    def messages(self, start_ns: int) -> Iterator[Envelope]:
        """All messages, shifted so that the first frame arrives at ``start_ns``."""
        shift_ns = start_ns - (self._first_ns or 0)
        intake = Intake(self._identity, self._device)
        found: Counter[str] = Counter()
        received_ns = 0
        for received_ns, frame in frames(self._data, found):
            yield from _shifted(intake.feed(frame, received_ns), shift_ns)
        yield from _shifted(intake.cut(received_ns), shift_ns)
        self.counts.update(found)
        self.counts.update(intake.counters())


def _shifted(envelopes: list[Envelope], shift_ns: int) -> Iterator[Envelope]:
    for envelope in envelopes:
        message = restamped(envelope.message, shift_ns, envelope.message.sequence)
        yield Envelope(envelope.address, message)
