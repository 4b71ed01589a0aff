"""The map of rooms on disk: GeoJSON beside the fusion's state, written whole, gone on from at the next start.

It is this computer's building, so it does not age; a map of another soldier or of other cells is left alone.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import msgspec

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.figures import Figures
from bootprint.files import write_whole
from bootprint.rooms import RoomMap
from bootprint.rooms_geojson import geojson, read_geojson
from bootprint.service import Part

FILE = "rooms.geojson"


def load_rooms(path: Path, origin: Origin) -> RoomMap | None:
    """The map in a file, None if there is none; ValueError or OSError if it cannot be read."""
    return read_geojson(path.read_bytes(), origin) if path.exists() else None


def save_rooms(path: Path, rooms: RoomMap, origin: Origin) -> None:
    """Write a map; OSError if that cannot be."""
    write_whole(path, msgspec.json.encode(geojson(rooms, origin)))


class KeepsRooms:
    """A part whose maps of rooms are kept on disk as they are told."""

    def __init__(self, part: Part, path: Path, origin: Origin) -> None:
        self._part, self._path, self._origin = part, path, origin
        self._unsaved = 0

    def start(self) -> None:
        """The part's own."""
        self._part.start()

    def handle(self, envelope: Envelope) -> Iterable[Envelope]:
        """The part's own."""
        return self._keep(self._part.handle(envelope))

    def tick(self, now_ns: int) -> Iterable[Envelope]:
        """The part's own."""
        return self._keep(self._part.tick(now_ns))

    def close(self) -> Iterable[Envelope]:
        """The part's own."""
        return self._keep(self._part.close())

    def figures(self) -> Figures:
        """The part's own, and how often a map could not be saved."""
        figures = self._part.figures()
        return replace(figures, counters=figures.counters | {"rooms_unsaved": self._unsaved})

    def _keep(self, said: Iterable[Envelope]) -> list[Envelope]:
        told = list(said)
        for envelope in told:
            if isinstance(envelope.message, RoomMap):
                self._save(envelope.message)
        return told

    def _save(self, rooms: RoomMap) -> None:
        try:
            save_rooms(self._path, rooms, self._origin)
        except OSError:
            self._unsaved += 1  # a full disk costs the map, not the soldier
