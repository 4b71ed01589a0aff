"""Smoothed walks as files: CSV with all figures, GPX 1.1 for maps, MCAP for everything that reads recordings."""

import csv
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from bootprint.bus import Envelope
from bootprint.messages import Position
from bootprint.recording import Recorder
from proving_ground.evaluation.smoothed import SOURCE, Walk

_GPX = "http://www.topografix.com/GPX/1/1"
_COLUMNS = ("time_utc", "latitude_deg", "longitude_deg", "height_m", "east_m", "north_m", "up_m")
_COVARIANCE = ("ee_m2", "en_m2", "eu_m2", "nn_m2", "nu_m2", "uu_m2")


def write_csv(walks: Sequence[Walk], path: Path) -> None:
    """A row for each position; the covariance is that of (east, north, up)."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("soldier", *_COLUMNS, *_COVARIANCE))
        for walk in walks:
            writer.writerows((walk.identity.soldier, *_row(position)) for position in walk.positions)


def _row(position: Position) -> tuple[str | float, ...]:
    figures = (position.latitude_deg, position.longitude_deg, position.height_m)
    local = (position.east_m, position.north_m, position.up_m)
    return (_utc(position.time_ns), *figures, *(round(value, 4) for value in local), *position.covariance_m2)


def write_gpx(walks: Sequence[Walk], path: Path) -> None:
    """A track for each soldier; GPX wants heights above the sea, so these (ellipsoidal) are left out."""
    ElementTree.register_namespace("", _GPX)
    root = ElementTree.Element(f"{{{_GPX}}}gpx", version="1.1", creator="bootprint")
    for walk in walks:
        track = ElementTree.SubElement(root, f"{{{_GPX}}}trk")
        ElementTree.SubElement(track, f"{{{_GPX}}}name").text = walk.identity.soldier
        segment = ElementTree.SubElement(track, f"{{{_GPX}}}trkseg")
        for position in walk.positions:
            place = {"lat": f"{position.latitude_deg:.9f}", "lon": f"{position.longitude_deg:.9f}"}
            point = ElementTree.SubElement(segment, f"{{{_GPX}}}trkpt", place)
            ElementTree.SubElement(point, f"{{{_GPX}}}time").text = _utc(position.time_ns)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def write_mcap(walks: Sequence[Walk], path: Path) -> None:
    """Position messages under each soldier's key, source "smoothed"."""
    with Recorder(path, overwrite=True) as recorder:
        for walk in walks:
            address = walk.identity.address("position", SOURCE)
            for position in walk.positions:
                recorder.write(Envelope(address, position))


def _utc(time_ns: int) -> str:
    moment = datetime.fromtimestamp(time_ns / 1e9, UTC)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")
