"""What is intact in an MCAP file, however the rest of it fared.

The `mcap` library's readers stop at the first thing that is wrong. A soldier's computer loses power at any time
and cards rot, so this module walks the file itself (https://mcap.dev/spec): every record must fit the file and
its own length fields, every chunk its checksum; behind a damaged place it goes on at the next sound chunk. The
library's record classes and decompression do the decoding.
"""

import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO

import zstandard
from mcap import records as rec
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC as MAGIC

DIRECTORY = "bootprint.channels"
MAX_CHUNK_BYTES = 1 << 30
_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK_FIXED_BYTES = 8 + 8 + 8 + 4 + 4 + 8
_FOOTER_BYTES = _HEAD.size + 8 + 8 + 4
_READERS = {
    Opcode.HEADER: rec.Header.read,
    Opcode.SCHEMA: rec.Schema.read,
    Opcode.CHANNEL: rec.Channel.read,
    Opcode.CHUNK_INDEX: rec.ChunkIndex.read,
    Opcode.ATTACHMENT: rec.Attachment.read,
    Opcode.ATTACHMENT_INDEX: rec.AttachmentIndex.read,
    Opcode.STATISTICS: rec.Statistics.read,
    Opcode.METADATA: rec.Metadata.read,
    Opcode.METADATA_INDEX: rec.MetadataIndex.read,
    Opcode.SUMMARY_OFFSET: rec.SummaryOffset.read,
    Opcode.DATA_END: rec.DataEnd.read,
    Opcode.FOOTER: rec.Footer.read,
}
_KNOWN = frozenset(Opcode)
# What the library's decoders may raise on bytes that are not what they should be.
_DECODING = (
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
    MemoryError,
    OverflowError,
)

Buffer = bytes | mmap.mmap


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong, and the offset in the file where it is; None if it has no one place."""

    offset: int | None
    what: str

    def __str__(self) -> str:
        return self.what if self.offset is None else f"{self.what} at byte {self.offset}"


@dataclass(frozen=True, slots=True)
class Entry:
    """One message as it stands in the file."""

    channel_id: int
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Block:
    """A stretch of intact messages (a chunk, or one message outside any chunk): its place and time span."""

    offset: int
    end: int
    first_ns: int
    last_ns: int


@dataclass(slots=True)
class Survey:
    """What a file holds: intact blocks, the channels' definitions, and everything that is wrong with it."""

    blocks: list[Block] = field(default_factory=list)
    channels: dict[int, rec.Channel] = field(default_factory=dict)
    directory: dict[int, rec.Channel] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    spans: dict[int, tuple[int, int]] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    truncated_at: int | None = None
    promised: int | None = None

    @property
    def found(self) -> int:
        """Intact messages."""
        return sum(self.counts.values())


def survey(data: Buffer) -> Survey:
    """Walk the whole file once; whatever is wrong with it becomes a fault, nothing is raised."""
    result = Survey()
    footer = _footer(data)
    start = _after_magic(data, result)
    end, summary = (len(data), []) if footer is None else _summary(data, footer, result)
    for offset, opcode, content in _walk(data, start, end, result, complete=footer is not None):
        _take(offset, opcode, content, result)
    for _, opcode, content in summary:
        _take_summary(opcode, content, result)
    if footer is None and result.truncated_at is None:
        result.truncated_at = len(data)
    _balance(result)
    return result


def _balance(result: Survey) -> None:
    """Fill channels in from the directory, and compare what was found with what was promised."""
    result.channels = result.directory | result.channels
    for channel_id, count in sorted(result.counts.items()):
        if channel_id not in result.channels:
            result.faults.append(
                Fault(None, f"{count} messages of channel {channel_id}, which is defined nowhere")
            )
    if not result.faults and result.promised not in (None, result.found):
        result.faults.append(Fault(None, f"{result.found} messages instead of {result.promised}"))


def entries(data: Buffer, block: Block) -> Iterator[Entry]:
    """The messages of a block that the survey found intact, in file order."""
    opcode, content = _record(data, block.offset, block.end)
    for inner, inner_content in _inner_records(opcode, content):
        if inner == Opcode.MESSAGE:
            yield _entry(inner_content)


def _entry(content: bytes) -> Entry:
    channel_id, sequence, log_time_ns, publish_time_ns = _MESSAGE.unpack_from(content)
    return Entry(channel_id, sequence, log_time_ns, publish_time_ns, content[_MESSAGE.size :])


def _after_magic(data: Buffer, result: Survey) -> int:
    head = bytes(data[: len(MAGIC)])
    if head == MAGIC:
        return len(MAGIC)
    if not MAGIC.startswith(head):
        result.faults.append(Fault(0, "does not begin as an MCAP file does"))
    return min(len(MAGIC), len(data))


def _footer(data: Buffer) -> rec.Footer | None:
    """The footer, if the file was finished."""
    at = len(data) - len(MAGIC) - _FOOTER_BYTES
    if at < 0 or data[-len(MAGIC) :] != MAGIC or data[at : at + _HEAD.size] != _HEAD.pack(Opcode.FOOTER, 20):
        return None
    return rec.Footer.read(ReadDataStream(BytesIO(data[at + _HEAD.size :])))


def _summary(data: Buffer, footer: rec.Footer, result: Survey) -> tuple[int, list[tuple[int, int, bytes]]]:
    """Where the data section ends, and the records of the summary behind it if its checksum holds."""
    footer_at = len(data) - len(MAGIC) - _FOOTER_BYTES
    start = footer.summary_start or footer_at
    if not len(MAGIC) <= start <= footer_at:
        result.faults.append(Fault(footer_at, "the footer points outside the file"))
        return footer_at, []
    # The checksum covers the summary and the footer up to the checksum itself.
    if footer.summary_crc and zlib.crc32(data[start : len(data) - len(MAGIC) - 4]) != footer.summary_crc:
        result.faults.append(Fault(start, "the summary's checksum does not match"))
        return footer_at, []
    return start, list(_walk(data, start, footer_at, result, complete=True))


def _walk(
    data: Buffer, offset: int, end: int, result: Survey, *, complete: bool
) -> Iterator[tuple[int, int, bytes]]:
    """(offset, opcode, content) of every sound record; what is between them becomes a fault."""
    while offset < end:
        if _is_sound(data, offset, end):
            opcode, content = _record(data, offset, end)
            yield offset, opcode, content
            offset += _HEAD.size + len(content)
            continue
        next_chunk = _next_chunk(data, offset + 1, end)
        if next_chunk is None and not complete and _may_be_cut_off(data, offset, end):
            result.truncated_at = offset
            return
        skipped = (end if next_chunk is None else next_chunk) - offset
        result.faults.append(Fault(offset, f"{skipped} bytes are no record"))
        offset += skipped


def _record(data: Buffer, offset: int, end: int) -> tuple[int, bytes]:
    opcode, length = _HEAD.unpack_from(data, offset)
    return opcode, bytes(data[offset + _HEAD.size : min(end, offset + _HEAD.size + length)])


def _may_be_cut_off(data: Buffer, offset: int, end: int) -> bool:
    """Whether a record that began here simply goes on past the end of the file."""
    if end - offset < _HEAD.size:
        return True
    opcode, length = _HEAD.unpack_from(data, offset)
    return opcode in _KNOWN and offset + _HEAD.size + length > end


def _is_sound(data: Buffer, offset: int, end: int) -> bool:
    """Whether a whole record stands here whose length agrees with the lengths inside it."""
    if end - offset < _HEAD.size:
        return False
    opcode, length = _HEAD.unpack_from(data, offset)
    start = offset + _HEAD.size
    if start + length > end:
        return False
    if opcode == Opcode.CHUNK:
        return _is_chunk(data, start, length)
    if opcode == Opcode.MESSAGE:
        return bool(length >= _MESSAGE.size)
    if opcode == Opcode.MESSAGE_INDEX:
        return bool(length >= 6 and length == 6 + int.from_bytes(data[start + 2 : start + 6], "little"))
    return opcode in _READERS and _fills(_READERS[opcode], data[start : start + length])


def _is_chunk(data: Buffer, start: int, length: int) -> bool:
    """Whether the chunk's length is the sum of its parts: fixed fields, compression's name, compressed data."""
    if length < _CHUNK_FIXED_BYTES:
        return False
    name_bytes = int.from_bytes(data[start + 28 : start + 32], "little")
    if length < _CHUNK_FIXED_BYTES + name_bytes:
        return False
    at = start + 32 + name_bytes
    return length == _CHUNK_FIXED_BYTES + name_bytes + int.from_bytes(data[at : at + 8], "little")


def _fills(reader: object, content: bytes) -> bool:
    stream = ReadDataStream(BytesIO(content))
    try:
        reader(stream)  # type: ignore[operator]
    except _DECODING:
        return False
    return bool(stream.count == len(content))


def _next_chunk(data: Buffer, offset: int, end: int) -> int | None:
    """The next place where a sound chunk begins."""
    mark = bytes([Opcode.CHUNK])
    while (offset := data.find(mark, offset, end)) >= 0:
        if _is_sound(data, offset, end):
            return offset
        offset += 1
    return None


def _inner_records(opcode: int, content: bytes) -> Iterator[tuple[int, bytes]]:
    """The records inside a chunk, or the bare record itself; raises one of _DECODING if the chunk is damaged."""
    if opcode != Opcode.CHUNK:
        yield opcode, content
        return
    inner = _decompress(content)
    offset = 0
    while offset < len(inner):
        kind, length = _HEAD.unpack_from(inner, offset)
        offset += _HEAD.size
        if offset + length > len(inner) or (kind == Opcode.MESSAGE and length < _MESSAGE.size):
            raise ValueError("a record in the chunk goes past its end")
        yield kind, inner[offset : offset + length]
        offset += length


def _decompress(content: bytes) -> bytes:
    chunk = rec.Chunk.read(ReadDataStream(BytesIO(content)))
    if chunk.uncompressed_size > MAX_CHUNK_BYTES:
        raise ValueError(f"the chunk claims {chunk.uncompressed_size} bytes")
    if chunk.compression == "zstd":
        claimed = zstandard.frame_content_size(chunk.data)
        if claimed not in (-1, chunk.uncompressed_size):
            raise ValueError("the chunk's sizes disagree")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    if size != chunk.uncompressed_size:
        raise ValueError(f"the chunk has {size} bytes instead of {chunk.uncompressed_size}")
    return bytes(stream.read(size))


def _take(offset: int, opcode: int, content: bytes, result: Survey) -> None:
    """Note what a record of the data section holds; a damaged chunk becomes a fault."""
    if opcode == Opcode.METADATA:
        _take_directory(content, result)
    if opcode not in (Opcode.CHUNK, Opcode.MESSAGE, Opcode.CHANNEL):
        return
    try:
        inner = list(_inner_records(opcode, content))
        channels = [_channel(part) for kind, part in inner if kind == Opcode.CHANNEL]
    except _DECODING:
        result.faults.append(Fault(offset, f"damaged chunk of {len(content)} bytes"))
        return
    # The first definition stands: it is inside a chunk, under a checksum.
    result.channels = {channel.id: channel for channel in channels} | result.channels
    stamps = [_stamp(part, result) for kind, part in inner if kind == Opcode.MESSAGE]
    if stamps:
        result.blocks.append(Block(offset, offset + _HEAD.size + len(content), min(stamps), max(stamps)))


def _channel(content: bytes) -> rec.Channel:
    return rec.Channel.read(ReadDataStream(BytesIO(content)))


def _stamp(content: bytes, result: Survey) -> int:
    """Count a message and widen its channel's time span; its log time."""
    channel_id, _, log_time_ns, _ = _MESSAGE.unpack_from(content)
    first_ns, last_ns = result.spans.get(channel_id, (log_time_ns, log_time_ns))
    result.counts[channel_id] = result.counts.get(channel_id, 0) + 1
    result.spans[channel_id] = (min(first_ns, log_time_ns), max(last_ns, log_time_ns))
    return int(log_time_ns)


def directory(channels: dict[int, tuple[str, str]]) -> dict[str, str]:
    """Channels' (message encoding, topic) as a metadata record: a second copy of what chunks define."""
    return {str(channel_id): f"{encoding} {topic}" for channel_id, (encoding, topic) in channels.items()}


def _take_directory(content: bytes, result: Survey) -> None:
    """Read `directory` back, for the case that the chunk which defines a channel is damaged."""
    metadata = rec.Metadata.read(ReadDataStream(BytesIO(content)))
    if metadata.name != DIRECTORY:
        return
    for number, definition in metadata.metadata.items():
        encoding, _, topic = definition.partition(" ")
        if number.isdecimal():
            result.directory[int(number)] = rec.Channel(int(number), topic, encoding, {}, 0)


def _take_summary(opcode: int, content: bytes, result: Survey) -> None:
    if opcode == Opcode.CHANNEL:
        channel = _channel(content)
        result.channels.setdefault(channel.id, channel)
    elif opcode == Opcode.STATISTICS:
        result.promised = rec.Statistics.read(ReadDataStream(BytesIO(content))).message_count
