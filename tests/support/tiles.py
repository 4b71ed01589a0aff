"""Basemaps for tests: one tile for the whole world as PMTiles (version 3) or MBTiles, of pixels or of features."""

import gzip
import json
import sqlite3
import struct
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Final, Literal

_NONE = 1
_HEADER_BYTES = 127
EXTENT: Final = 4096
Kind = Literal["png", "pbf"]
_TILE_TYPES: Final = {"pbf": 1, "png": 2}
Ring = Sequence[tuple[int, int]]


def write_pmtiles(path: Path, tile: bytes, kind: Kind = "png", layers: Sequence[str] = ()) -> None:
    """One tile at zoom 0; vector tiles' layers stand in the metadata."""
    directory = b"\x01" + _varint(0) + _varint(1) + _varint(len(tile)) + _varint(1)
    metadata = _metadata(layers).encode()
    offsets = [_HEADER_BYTES, _HEADER_BYTES + len(directory)]
    leaves = offsets[1] + len(metadata)
    header = struct.pack(
        "<7sB11Q6B4iB2i",
        b"PMTiles",
        3,
        *(offsets[0], len(directory), offsets[1], len(metadata), leaves, 0, leaves, len(tile), 1, 1, 1),
        *(1, _NONE, _NONE, _TILE_TYPES[kind], 0, 0),
        *(-1_800_000_000, -850_000_000, 1_800_000_000, 850_000_000),
        0,
        *(0, 0),
    )
    assert len(header) == _HEADER_BYTES
    path.write_bytes(header + directory + metadata + tile)


def write_mbtiles(path: Path, tile: bytes, kind: Kind = "png", layers: Sequence[str] = ()) -> None:
    """One tile at zoom 0, gzipped if it is a vector tile, as the specification wants it."""
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("CREATE TABLE metadata (name TEXT, value TEXT)")
        file.execute(
            "CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_data BLOB)"
        )
        said = {"name": "test", "format": kind, "json": _metadata(layers)}
        file.executemany("INSERT INTO metadata VALUES (?, ?)", said.items())
        data = gzip.compress(tile) if kind == "pbf" else tile
        file.execute("INSERT INTO tiles VALUES (0, 0, 0, ?)", (data,))


def vector_tile(layer: str, polygon: Ring, **properties: str) -> bytes:
    """A Mapbox vector tile (specification 2.1) of one layer with one polygon, in 4096ths of the tile."""
    tags = b"".join(_varint(index) * 2 for index in range(len(properties)))
    feature = _field(2, tags) + _number(3, 3) + _field(4, _geometry(polygon))
    body = _field(1, layer.encode()) + _field(2, feature)
    body += b"".join(_field(3, key.encode()) for key in properties)
    body += b"".join(_field(4, _field(1, value.encode())) for value in properties.values())
    return _field(3, body + _number(5, EXTENT) + _number(15, 2))


def _geometry(ring: Ring) -> bytes:
    """MoveTo, LineTo, ClosePath with zigzag differences."""
    out, at = b"", (0, 0)
    for index, point in enumerate(ring):
        if index == 0:
            out += _varint(1 | 1 << 3)
        elif index == 1:
            out += _varint(2 | (len(ring) - 1) << 3)
        for axis in range(2):
            apart = point[axis] - at[axis]
            out += _varint(apart << 1 if apart >= 0 else (-apart << 1) - 1)
        at = point
    return out + _varint(7 | 1 << 3)


def _field(number: int, data: bytes) -> bytes:
    return _varint(number << 3 | 2) + _varint(len(data)) + data


def _number(number: int, value: int) -> bytes:
    return _varint(number << 3) + _varint(value)


def _metadata(layers: Sequence[str]) -> str:
    return json.dumps({"vector_layers": [{"id": each, "fields": {}} for each in layers]} if layers else {})


def _varint(value: int) -> bytes:
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])
