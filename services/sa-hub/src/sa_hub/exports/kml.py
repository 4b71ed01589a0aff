"""KML 2.2 with Google's tracks: soldiers that move with the time slider, and places with their moments."""

from typing import BinaryIO, Final

from bootprint.messages import Track
from sa_hub.exports.source import Place, Source, named, utc, xml_text

_HEAD: Final = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document>
"""


def write_kml(source: Source, out: BinaryIO) -> None:
    """Write a placemark for each segment of each soldier, and for each place.

    Everything clings to the ground: heights above the ellipsoid are not those that KML means.
    """
    out.write(_HEAD.encode())
    for soldier in source.everyone():
        for segment in source.segments(soldier):
            out.write(_segment(segment).encode())
    for place in source.places():
        out.write(_place(place).encode())
    out.write(b"</Document></kml>\n")


def _segment(segment: list[Track]) -> str:
    """All times first, then all coordinates, as the schema orders them."""
    whens = "".join(f"<when>{utc(track.time_ns)}</when>\n" for track in segment)
    coordinates = "".join(
        f"<gx:coord>{track.longitude_deg:.7f} {track.latitude_deg:.7f} 0</gx:coord>\n" for track in segment
    )
    return (
        f"<Placemark><name>{xml_text(named(segment))}</name><gx:Track>"
        f"<altitudeMode>clampToGround</altitudeMode>\n{whens}{coordinates}</gx:Track></Placemark>\n"
    )


def _place(place: Place) -> str:
    return (
        f"<Placemark><name>{xml_text(place.name)}</name><description>{xml_text(place.soldier)}</description>"
        f"<TimeStamp><when>{utc(place.time_ns)}</when></TimeStamp>"
        f"<Point><coordinates>{place.longitude_deg:.7f},{place.latitude_deg:.7f}</coordinates></Point></Placemark>\n"
    )
