"""A PMTiles file (version 3) with one picture for the whole world: the least that a basemap can be."""

import struct
from pathlib import Path

_NONE, _PNG = 1, 2
_HEADER_BYTES = 127


def write_pmtiles(path: Path, tile: bytes) -> None:
    """One PNG at zoom 0."""
    directory = b"\x01" + _varint(0) + _varint(1) + _varint(len(tile)) + _varint(1)
    metadata = b"{}"
    offsets = [_HEADER_BYTES, _HEADER_BYTES + len(directory)]
    leaves = offsets[1] + len(metadata)
    header = struct.pack(
        "<7sB11Q6B4iB2i",
        b"PMTiles",
        3,
        *(offsets[0], len(directory), offsets[1], len(metadata), leaves, 0, leaves, len(tile), 1, 1, 1),
        *(1, _NONE, _NONE, _PNG, 0, 0),
        *(-1_800_000_000, -850_000_000, 1_800_000_000, 850_000_000),
        0,
        *(0, 0),
    )
    assert len(header) == _HEADER_BYTES
    path.write_bytes(header + directory + metadata + tile)


def _varint(value: int) -> bytes:
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])
