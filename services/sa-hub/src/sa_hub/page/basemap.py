"""The basemap's file: PMTiles, served by ranges of bytes as it is, or MBTiles, served tile by tile.

MBTiles (specification 1.3) is an SQLite file: ``metadata`` (name, value) and ``tiles`` (zoom_level, tile_column,
tile_row counted from the south, tile_data; vector tiles gzipped).
"""

import contextlib
import gzip
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Literal

import msgspec

from bootprint.errors import ConfigError

BasemapKind = Literal["pmtiles", "mbtiles"]
_SQLITE: Final = b"SQLite format 3\0"
_PMTILES: Final = b"PMTiles\x03"
_GZIP: Final = b"\x1f\x8b"
_VECTOR: Final = "pbf"
_MEDIA: Final = {
    "png": "image/png",
    "jpg": "image/jpeg",
    "webp": "image/webp",
    _VECTOR: "application/x-protobuf",
}
_DEEPEST: Final = 22
_TILE: Final = "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?"
_WORLD: Final = (-180.0, -85.0511, 180.0, 85.0511)


class TileJson(msgspec.Struct, kw_only=True, frozen=True):
    """What an MBTiles file holds, as browsers want to know it; tiles' addresses are below the basemap's own."""

    tiles: tuple[str, ...] = ("{z}/{x}/{y}",)
    format: Literal["raster", "vector"]
    minzoom: int
    maxzoom: int
    bounds: tuple[float, float, float, float]
    vector_layers: tuple[dict[str, object], ...]


class Tile(msgspec.Struct, frozen=True):
    """A tile's bytes, unzipped, and their media type."""

    data: bytes
    media: str


def kind_of(path: Path) -> BasemapKind:
    """What a file is, by its first bytes; ConfigError if it is no basemap."""
    with path.open("rb") as file:
        head = file.read(16)
    if head == _SQLITE:
        return "mbtiles"
    if head.startswith(_PMTILES):
        return "pmtiles"
    raise ConfigError(f"{path}: is neither PMTiles (version 3) nor MBTiles")


def tile_json(path: Path) -> TileJson:
    """An MBTiles file's description; what it does not say itself is found in its tiles. ConfigError if damaged."""
    with _opened(path) as tiles:
        said = dict(tiles.execute("SELECT name, value FROM metadata"))
        least, most = tiles.execute("SELECT min(zoom_level), max(zoom_level) FROM tiles").fetchone()
    if least is None:
        raise ConfigError(f"{path}: holds no tiles")
    return TileJson(
        format="vector" if said.get("format") == _VECTOR else "raster",
        minzoom=least,
        maxzoom=most,
        bounds=_bounds(said.get("bounds")),
        vector_layers=_vector_layers(said.get("json")),
    )


def tile(path: Path, zoom: int, column: int, row: int) -> Tile | None:
    """A tile of an MBTiles file, rows counted from the north; None if there is none. ConfigError if damaged."""
    if not 0 <= zoom <= _DEEPEST:
        return None
    with _opened(path) as tiles:
        found = tiles.execute(_TILE, (zoom, column, (1 << zoom) - 1 - row)).fetchone()
        said = tiles.execute("SELECT value FROM metadata WHERE name = 'format'").fetchone()
    if found is None:
        return None
    data: bytes = gzip.decompress(found[0]) if found[0][:2] == _GZIP else found[0]
    return Tile(data, _MEDIA.get(said[0] if said else "", "application/octet-stream"))


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """The file, to be read alone; what is wrong with it as a ConfigError."""
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as file:
            yield file
    except (sqlite3.DatabaseError, gzip.BadGzipFile) as error:
        raise ConfigError(f"{path}: cannot be read as MBTiles: {error}") from error


def _bounds(text: str | None) -> tuple[float, float, float, float]:
    try:
        west, south, east, north = (float(each) for each in (text or "").split(","))
    except ValueError:
        return _WORLD
    return west, south, east, north


def _vector_layers(text: str | None) -> tuple[dict[str, object], ...]:
    """The names of vector tiles' layers stand in a JSON text of their own."""
    try:
        layers = json.loads(text or "{}").get("vector_layers", [])
    except (ValueError, AttributeError):
        return ()
    return tuple(each for each in layers if isinstance(each, dict))
