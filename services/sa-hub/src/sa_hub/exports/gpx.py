"""GPX 1.1: a track for each soldier, a way-point for each observation and alert.

Heights are above the ellipsoid. Mode stands in ``src``; the accuracy (one sigma, metres) in an extension, since GPX
knows only dilutions of precision, which are no distances.
"""

from typing import BinaryIO, Final

from bootprint.messages import Track
from sa_hub.exports.source import Place, Source, named, utc, xml_text

_HEAD: Final = """<?xml version="1.0" encoding="UTF-8"?>
<gpx version="1.1" creator="bootprint" xmlns="http://www.topografix.com/GPX/1/1" xmlns:bootprint="urn:bootprint:1">
"""


def write_gpx(source: Source, out: BinaryIO) -> None:
    """Write way-points, then tracks, as the schema orders them."""
    out.write(_HEAD.encode())
    for place in source.places():
        out.write(_waypoint(place).encode())
    for soldier in source.everyone():
        _write_track(source, soldier, out)
    out.write(b"</gpx>\n")


def _write_track(source: Source, soldier: str, out: BinaryIO) -> None:
    begun = False
    for segment in source.segments(soldier):
        if not begun:
            out.write(
                f"<trk><name>{xml_text(named(segment))}</name><desc>{xml_text(soldier)}</desc>\n".encode()
            )
            begun = True
        points = "".join(map(_point, segment))
        out.write(f"<trkseg>\n{points}</trkseg>\n".encode())
    if begun:
        out.write(b"</trk>\n")


def _waypoint(place: Place) -> str:
    return (
        f'<wpt lat="{place.latitude_deg:.7f}" lon="{place.longitude_deg:.7f}"><time>{utc(place.time_ns)}</time>'
        f"<name>{xml_text(place.name)}</name><desc>{xml_text(place.soldier)}</desc></wpt>\n"
    )


def _point(track: Track) -> str:
    height = "" if track.height_m is None else f"<ele>{track.height_m:.1f}</ele>"
    return (
        f'<trkpt lat="{track.latitude_deg:.7f}" lon="{track.longitude_deg:.7f}">{height}'
        f"<time>{utc(track.time_ns)}</time><src>{track.mode}</src><extensions>"
        f"<bootprint:accuracy>{track.accuracy_m:.1f}</bootprint:accuracy></extensions></trkpt>\n"
    )
