"""Frames on a line of bytes: COBS (Cheshire & Baker 1999) between zero bytes, with a check sum of 16 bits.

A zero stands before and after every frame, so that garbage before it ends there and costs no good frame. The check
sum (CRC-16/XMODEM) only keeps noise from the seal; it is the seal that tells who speaks.
"""

import binascii
from collections.abc import Iterator
from typing import Final

from cobs import cobs

DELIMITER: Final = b"\x00"
_CRC_BYTES: Final = 2
_LONGEST: Final = 254 + 2
"""Of what stands between two delimiters: more is garbage, and is forgotten as it comes."""


def framed(data: bytes) -> bytes:
    """A frame as it goes down the line."""
    return DELIMITER + bytes(cobs.encode(data + _check_sum(data))) + DELIMITER


def _check_sum(data: bytes) -> bytes:
    return binascii.crc_hqx(data, 0).to_bytes(_CRC_BYTES, "big")


class Deframer:
    """Bytes in, frames out; resynchronises at the next delimiter. ``garbled``: pieces that were no frame."""

    def __init__(self) -> None:
        self.garbled = 0
        self._piece = bytearray()

    def feed(self, data: bytes) -> Iterator[bytes]:
        """The frames that these bytes complete, in order; memory stays bounded whatever comes."""
        *ended, rest = data.split(DELIMITER)
        for piece in ended:
            self._keep(piece)
            if (frame := self._taken()) is not None:
                yield frame
        self._keep(rest)

    def _keep(self, piece: bytes) -> None:
        self._piece += piece[: _LONGEST + 1 - len(self._piece)]

    def _taken(self) -> bytes | None:
        """What stands between the last two delimiters, if it is a frame."""
        piece = bytes(self._piece)
        self._piece.clear()
        if not piece:
            return None
        frame = _opened(piece)
        self.garbled += frame is None
        return frame


def _opened(piece: bytes) -> bytes | None:
    if len(piece) > _LONGEST:
        return None
    try:
        decoded = bytes(cobs.decode(piece))
    except cobs.DecodeError:
        return None
    data, check_sum = decoded[:-_CRC_BYTES], decoded[-_CRC_BYTES:]
    return data if len(decoded) >= _CRC_BYTES and _check_sum(data) == check_sum else None
