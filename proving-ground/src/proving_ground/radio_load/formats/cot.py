"""Cursor on Target: the XML event that ATAK broadcasts of itself, and the same as TAK protocol version 1.

Elements and attributes as ATAK-CIV sends them on a mesh network; conversion to protobuf by takproto.
"""

import math
from datetime import UTC, datetime, timedelta
from typing import Final
from xml.etree import ElementTree

from takproto import TAKProtoVer, parse_proto, xml2proto

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import AtakDynamic

_DECLARATION: Final = b"<?xml version='1.0' encoding='UTF-8' standalone='yes'?>"
_STALE_S: Final = 75.0
_UNKNOWN: Final = "9999999.0"
_NS_PER_MS: Final = 1_000_000


def _stamp(time_ns: int, later_s: float = 0.0) -> str:
    time = datetime.fromtimestamp(time_ns // NS_PER_S, UTC) + timedelta(
        milliseconds=time_ns % NS_PER_S // _NS_PER_MS, seconds=later_s
    )
    return f"{time:%Y-%m-%dT%H:%M:%S}.{time.microsecond // 1000:03d}Z"


def to_xml(place: Place) -> bytes:
    """The event as XML."""
    event = ElementTree.Element(
        "event",
        version="2.0",
        uid=f"ANDROID-{0x589520CCFCD20000 + place.number:016x}",
        type="a-f-G-U-C",
        time=_stamp(place.time_ns),
        start=_stamp(place.time_ns),
        stale=_stamp(place.time_ns, _STALE_S),
        how="m-g",
    )
    ElementTree.SubElement(
        event,
        "point",
        lat=f"{place.latitude_deg:.7f}",
        lon=f"{place.longitude_deg:.7f}",
        hae=f"{place.height_m:.3f}",
        ce="2.0",
        le=_UNKNOWN,
    )
    _detail(ElementTree.SubElement(event, "detail"), place)
    return _DECLARATION + ElementTree.tostring(event)


def _detail(detail: ElementTree.Element, place: Place) -> None:
    course_deg = math.degrees(math.atan2(place.east_m_s, place.north_m_s)) % 360.0
    speed_m_s = math.hypot(place.east_m_s, place.north_m_s)
    callsign = f"ALPHA-{place.number}"
    add = ElementTree.SubElement
    add(
        detail,
        "takv",
        device="SAMSUNG SM-G950U",
        platform="ATAK-CIV",
        os="29",
        version="4.10.0.0",
    )
    add(detail, "contact", endpoint="192.168.1.20:4242:tcp", callsign=callsign)
    add(detail, "uid", Droid=callsign)
    add(detail, "precisionlocation", geopointsrc="GPS", altsrc="GPS")
    add(detail, "__group", name="Cyan", role="Team Member")
    add(detail, "status", battery="85")
    add(detail, "track", course=f"{course_deg:.8f}", speed=f"{speed_m_s:.8f}")


def from_xml(data: bytes) -> Shown:
    """Read an event."""
    event = ElementTree.fromstring(data)
    point = event.find("point")
    if point is None:
        raise ValueError("a CoT event without a point")
    time = datetime.fromisoformat(event.attrib["time"].replace("Z", "+00:00"))
    time_ns = round(time.timestamp() * 1000.0) * _NS_PER_MS
    return Shown(time_ns, float(point.attrib["lat"]), float(point.attrib["lon"]))


def to_protobuf(place: Place) -> bytes:
    """The event in the mesh framing of TAK protocol version 1."""
    return bytes(xml2proto(to_xml(place).decode(), TAKProtoVer.MESH))


def from_protobuf(data: bytes) -> Shown:
    """Read a mesh message."""
    event = parse_proto(bytearray(data)).cotEvent
    return Shown(event.sendTime * _NS_PER_MS, event.lat, event.lon)


_RULE_SOURCE: Final = "rule: ATAK-CIV, ReportingRate, strategy Dynamic, defaults on mesh networks"
COT_XML: Final = Format(
    "cot-xml",
    "Cursor on Target, XML",
    lambda _load, number: AtakDynamic(number),
    to_xml,
    from_xml,
    f"{_RULE_SOURCE}; event as ATAK-CIV broadcasts it",
)
TAK_PROTOBUF: Final = Format(
    "tak-protobuf",
    "TAK protocol version 1, protobuf",
    lambda _load, number: AtakDynamic(number),
    to_protobuf,
    from_protobuf,
    f"{_RULE_SOURCE}; the same event encoded by takproto",
)
