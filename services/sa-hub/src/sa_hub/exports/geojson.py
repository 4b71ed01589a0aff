"""GeoJSON (RFC 7946): a line for each segment of a way, with ``coordTimes``, and a point for each place."""

from collections.abc import Iterator
from typing import Any, BinaryIO

import msgspec

from bootprint.messages import Track
from sa_hub.exports.source import Place, Source, named, utc


def write_geojson(source: Source, out: BinaryIO) -> None:
    """Write one collection, a feature a line, so that large ones need not be held as a whole."""
    out.write(b'{"type":"FeatureCollection","features":[\n')
    for index, feature in enumerate(_features(source)):
        out.write((b",\n" if index else b"") + msgspec.json.encode(feature))
    out.write(b"\n]}\n")


def _features(source: Source) -> Iterator[dict[str, Any]]:
    for soldier in source.everyone():
        for segment in source.segments(soldier):
            yield _segment(segment)
    for place in source.places():
        yield _place(place)


def _segment(segment: list[Track]) -> dict[str, Any]:
    """One that holds a single place is a point: a line has two."""
    coordinates = [_coordinates(track) for track in segment]
    is_line = len(segment) > 1
    properties = {
        "soldier": segment[-1].soldier,
        "name": named(segment),
        "coordTimes": [utc(track.time_ns) for track in segment],
        "accuracies_m": [round(track.accuracy_m, 2) for track in segment],
        "floors": [track.floor for track in segment],
        "modes": [track.mode for track in segment],
    }
    geometry = {
        "type": "LineString" if is_line else "Point",
        "coordinates": coordinates if is_line else coordinates[0],
    }
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _coordinates(track: Track) -> list[float]:
    """Longitude, latitude and, if known, height above the ellipsoid, which is what the RFC asks for."""
    place = [round(track.longitude_deg, 7), round(track.latitude_deg, 7)]
    return place if track.height_m is None else [*place, round(track.height_m, 2)]


def _place(place: Place) -> dict[str, Any]:
    coordinates = [round(place.longitude_deg, 7), round(place.latitude_deg, 7)]
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": coordinates},
        "properties": {"soldier": place.soldier, "name": place.name, "time": utc(place.time_ns)},
    }
