"""The header of a frame, in clear: who sends, and as much of its counter as a receiver needs to find the nonce."""

from dataclasses import dataclass

from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import (
    COUNTER_LOW_BITS,
    FULL_HEADER_BYTES,
    HEADER,
    SHORT_HEADER_BYTES,
    VERSION,
    read_fields,
    write_fields,
)


@dataclass(frozen=True, slots=True)
class Header:
    """What stands in clear; epoch and the whole counter only in full headers. ``length_bytes`` is its own."""

    sender: int
    counter_low: int
    length_bytes: int
    full: tuple[int, int] | None = None
    """(epoch, counter), if they are told."""


def read_header(frame: bytes) -> Header:
    """The header; nothing in it is to be trusted yet. FrameError if there is none, or of another version."""
    values = read_fields(BitReader(frame[:FULL_HEADER_BYTES]), HEADER, {})
    if values["version"] != VERSION:
        raise FrameError("version", f"version {values['version']}")
    sender, low = values["sender"], values["counter_low"]
    if not values["full"]:
        return Header(sender, low, SHORT_HEADER_BYTES)
    counter = values["counter_high"] << COUNTER_LOW_BITS | low
    return Header(sender, low, FULL_HEADER_BYTES, (values["epoch"], counter))


def write_header(sender: int, epoch: int, counter: int, *, full: bool) -> bytes:
    """2 bytes, or 8 with epoch and counter in full."""
    writer = BitWriter()
    values = {
        "version": VERSION,
        "sender": sender,
        "full": int(full),
        "counter_low": counter % (1 << COUNTER_LOW_BITS),
        "epoch": epoch,
        "counter_high": counter >> COUNTER_LOW_BITS,
    }
    write_fields(writer, HEADER, values)
    return writer.to_bytes()


def nonce(sender: int, epoch: int, counter: int) -> bytes:
    """13 bytes: sender 2, epoch 4, counter 4, zeros."""
    return sender.to_bytes(2) + epoch.to_bytes(4) + counter.to_bytes(4) + bytes(3)
