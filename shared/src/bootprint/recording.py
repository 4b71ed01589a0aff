"""Recordings of the bus: MCAP files that survive a power cut, and readers that lose nothing that is intact.

One channel per key. Messages stand in the file exactly as they were on the wire (MessagePack), with the message's
own time as log time and, if known, the time of reception as publish time. The MCAP registry knows ``msgpack``
as a message encoding and names no schema language for it; ``jsonschema`` is the only registered one that can
describe a map, so each channel carries the JSON schema of its struct, in which binary arrays stand as base64
text, JSON's nearest. Readers that do not speak MessagePack skip these channels; for their sake positions, tracks
and observations are written a second time as Foxglove's LocationFix and GeoJSON, in JSON.
"""

import heapq
import mmap
import os
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

import msgspec
import structlog
from mcap.writer import CompressionType, Writer

from bootprint import foxglove, mcap_survey, wire
from bootprint.bus import Envelope, matches
from bootprint.errors import RecordingError, WireError
from bootprint.salvage import address_of, survey_report
from bootprint.topics import Address

T = TypeVar("T")
LIBRARY = "bootprint"
CHUNK_BYTES = 256 * 1024
_MAX_LOG_TIME_NS = (1 << 64) - 1


class Stamp(msgspec.Struct, frozen=True):
    """What every message tells, whatever its type."""

    time_ns: int
    sequence: int = 0


_STAMP = msgspec.msgpack.Decoder(Stamp)


def _stamp(payload: bytes) -> Stamp | None:
    try:
        return _STAMP.decode(payload)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None


@lru_cache(maxsize=4096)
def _schema_of(topic: str, encoding: str) -> tuple[str, bytes]:
    """Name and JSON schema of what travels under a topic; empty if that is unknown.

    A message's root is the object itself: simple readers insist on ``"type": "object"`` there.
    """
    copy = foxglove.suffix_of(topic)
    if encoding == "json" and copy is not None:
        return foxglove.SCHEMA_NAMES[copy], foxglove.schema(copy)
    address = address_of(topic, encoding)
    if address is None:
        return "", b""
    type_ = address.topic.message
    _, components = msgspec.json.schema_components([type_])
    return f"bootprint.{type_.__name__}", msgspec.json.encode(
        components[type_.__name__], order="deterministic"
    )


class Recorder:
    """Writes envelopes to a new MCAP file; the same input gives the same bytes.

    Chunks are closed when they hold ``chunk_bytes`` and at every `flush`; both write and fsync them, so what a
    flush has covered survives the process and the power. Live recorders call `flush` about once a second.
    Not thread-safe.
    """

    def __init__(self, path: Path, *, chunk_bytes: int = CHUNK_BYTES, overwrite: bool = False) -> None:
        try:
            self._file = path.open("wb" if overwrite else "xb")
        except FileExistsError:
            raise RecordingError(f"{path}: exists already; choose another name or overwrite it") from None
        except OSError as error:
            raise RecordingError(f"{path}: cannot be written: {error.strerror}") from error
        self.path = path
        self.messages = 0
        self._chunk_bytes = chunk_bytes
        self._waiting_bytes = 0
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._new: dict[int, tuple[str, str]] = {}
        # Chunks are closed by this class, never by the writer: each is to be synced.
        self._writer = Writer(self._file, chunk_size=1 << 62, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library=LIBRARY)

    def write(self, envelope: Envelope, received_ns: int | None = None) -> None:
        """Record one message; one with a place also as Foxglove's map understands it."""
        self.write_payload(envelope.address.key, wire.encode(envelope.message), received_ns)

    def write_payload(self, key: str, payload: bytes, received_ns: int | None = None) -> None:
        """Record a message's bytes as they came from the bus, whether or not their type is known here.

        Bytes that tell no time stand at the time they were received.
        """
        stamp = _stamp(payload) or Stamp(time_ns=received_ns or 0)
        publish_ns = stamp.time_ns if received_ns is None else received_ns
        self.write_record(key, "msgpack", payload, stamp, publish_ns)
        self.messages += 1
        address = address_of(key, "msgpack")
        if address is not None and address.topic.message in foxglove.COPIED:
            self._write_copy(address, payload, stamp)

    def _write_copy(self, address: Address, payload: bytes, stamp: "Stamp") -> None:
        try:
            copy = foxglove.copy_of(address, wire.decode(address.subject, payload))
        except WireError:
            return
        if copy is not None:
            suffix, data = copy
            self.write_record(address.key + suffix, "json", data, stamp, stamp.time_ns)

    def write_record(self, topic: str, encoding: str, data: bytes, stamp: "Stamp", publish_ns: int) -> None:
        """Record bytes of any topic and encoding."""
        self._writer.add_message(
            channel_id=self._channel(topic, encoding),
            log_time=_log_time(stamp.time_ns),
            data=data,
            publish_time=_log_time(publish_ns),
            sequence=stamp.sequence & 0xFFFF_FFFF,
        )
        self._waiting_bytes += len(data)
        if self._waiting_bytes >= self._chunk_bytes:
            self.flush()

    def _channel(self, topic: str, encoding: str) -> int:
        if topic not in self._channels:
            name, schema = _schema_of(topic, encoding)
            if name and name not in self._schemas:
                self._schemas[name] = self._writer.register_schema(name, "jsonschema", schema)
            channel = self._writer.register_channel(topic, encoding, self._schemas.get(name, 0))
            self._channels[topic] = channel
            self._new[channel] = (encoding, topic)
        return self._channels[topic]

    def flush(self) -> None:
        """Close the chunk in progress and see it onto the disk; RecordingError if that is full."""
        if not self._waiting_bytes:
            return
        self._waiting_bytes = 0
        try:
            if self._new:
                self._writer.add_metadata(mcap_survey.DIRECTORY, mcap_survey.directory(self._new))
                self._new = {}
            self._writer.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be written: {error.strerror}") from error

    def close(self) -> None:
        """Write the last chunk, the index and the footer; safe to call twice."""
        if self._file.closed:
            return
        try:
            self.flush()
            with self._file:
                self._writer.finish()
                self._file.flush()
                os.fsync(self._file.fileno())
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be written: {error.strerror}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _log_time(time_ns: int) -> int:
    """MCAP knows no time before 1970; the message itself keeps its own."""
    return min(max(0, time_ns), _MAX_LOG_TIME_NS)


class Recording:
    """An MCAP recording opened for reading: surveyed once as a whole, then read in the order of log time.

    Raises RecordingError for a file that is missing or is no MCAP at all, and for a damaged one unless
    ``salvage``. One that merely ends early (killed recorder, power cut) is read up to its last whole record,
    with a warning.
    """

    def __init__(self, path: Path, *, salvage: bool = False) -> None:
        self._data = _map(path)
        self._survey = mcap_survey.survey(self._data)
        self.report = survey_report(path, self._survey)
        if self._survey.faults and not self._survey.found:
            raise RecordingError(f"{path}: no intact MCAP recording ({self._survey.faults[0]})")
        if self._survey.faults and not salvage:
            raise RecordingError(
                f"{self.report.sentence()}; salvage them with `bootprint info --salvage OUT`"
            )
        if self._survey.faults or self.report.truncated_at is not None:
            structlog.get_logger().warning("recording is not whole", what=self.report.sentence())

    def envelopes(self, selector: str = "**") -> Iterator[tuple[int, Envelope]]:
        """(log time UTC ns, envelope) of every known, valid message whose key matches, in log-time order.

        A lone ``**`` selects everything, although on the bus no wildcard matches a version.
        """
        for address, entry in self._in_order(self._selected(selector)):
            try:
                message = wire.decode(address.subject, entry.data)
            except WireError:
                self.report.invalid[address.key] += 1
                continue
            yield entry.log_time_ns, Envelope(address, message)

    def copy_to(self, recorder: Recorder) -> None:
        """Write every intact message, known or not, to another recording, byte for byte."""
        for channel, entry in self._in_order(self._survey.channels):
            stamp = Stamp(entry.log_time_ns, entry.sequence)
            recorder.write_record(
                channel.topic, channel.message_encoding, entry.data, stamp, entry.publish_time_ns
            )

    def _selected(self, selector: str) -> dict[int, Address]:
        """The channels whose key matches, by number."""
        selected = {}
        for number, channel in self._survey.channels.items():
            address = address_of(channel.topic, channel.message_encoding)
            if address is not None and (selector == "**" or matches(selector, address.key)):
                selected[number] = address
        return selected

    def _in_order(self, wanted: Mapping[int, T]) -> Iterator[tuple[T, mcap_survey.Entry]]:
        """Messages of the wanted channels by log time, then as they stand in the file."""
        waiting: list[tuple[int, int, int, mcap_survey.Entry]] = []
        for block in sorted(self._survey.blocks, key=lambda block: (block.first_ns, block.offset)):
            # Whatever is older than this block's first message can no longer be overtaken.
            while waiting and waiting[0][0] < block.first_ns:
                entry = heapq.heappop(waiting)[3]
                yield wanted[entry.channel_id], entry
            for index, entry in enumerate(mcap_survey.entries(self._data, block)):
                if entry.channel_id in wanted:
                    heapq.heappush(waiting, (entry.log_time_ns, block.offset, index, entry))
        while waiting:
            entry = heapq.heappop(waiting)[3]
            yield wanted[entry.channel_id], entry


def read_envelopes(
    path: Path, selector: str = "**", *, salvage: bool = False
) -> Iterator[tuple[int, Envelope]]:
    """(log time UTC ns, envelope) of a recording's messages in log-time order; errors as of `Recording`."""
    return Recording(path, salvage=salvage).envelopes(selector)


def _map(path: Path) -> mcap_survey.Buffer:
    try:
        with path.open("rb") as file:
            if not os.fstat(file.fileno()).st_size:
                return b""
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such recording") from None
    except (OSError, ValueError) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
