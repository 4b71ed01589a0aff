"""Cursor on Target: the XML event that ATAK broadcasts of itself, and the same as TAK protocol version 1.

Elements and attributes as ATAK-CIV sends them on a mesh network; the events are the hub's own (`sa_hub.tak`).
"""

import math
from typing import Final

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import AtakDynamic
from sa_hub.tak import event as cot
from sa_hub.tak import protobuf

_STALE_NS: Final = 75 * NS_PER_S


def _event(place: Place) -> cot.CotEvent:
    return cot.CotEvent(
        uid=f"ANDROID-{0x589520CCFCD20000 + place.number:016x}",
        type="a-f-G-U-C",
        how="m-g",
        time_ns=place.time_ns,
        start_ns=place.time_ns,
        stale_ns=place.time_ns + _STALE_NS,
        latitude_deg=place.latitude_deg,
        longitude_deg=place.longitude_deg,
        hae_m=place.height_m,
        ce_m=2.0,
        details=_details(place),
    )


def _details(place: Place) -> dict[str, dict[str, str]]:
    course_deg = math.degrees(math.atan2(place.east_m_s, place.north_m_s)) % 360.0
    speed_m_s = math.hypot(place.east_m_s, place.north_m_s)
    callsign = f"ALPHA-{place.number}"
    return {
        "takv": {"device": "SAMSUNG SM-G950U", "platform": "ATAK-CIV", "os": "29", "version": "4.10.0.0"},
        "contact": {"endpoint": "192.168.1.20:4242:tcp", "callsign": callsign},
        "uid": {"Droid": callsign},
        "precisionlocation": {"geopointsrc": "GPS", "altsrc": "GPS"},
        "__group": {"name": "Cyan", "role": "Team Member"},
        "status": {"battery": "85"},
        "track": {"course": f"{course_deg:.8f}", "speed": f"{speed_m_s:.8f}"},
    }


def to_xml(place: Place) -> bytes:
    """The event as XML."""
    return cot.to_xml(_event(place))


def from_xml(data: bytes) -> Shown:
    """Read an event."""
    return _shown(cot.from_xml(data))


def to_protobuf(place: Place) -> bytes:
    """The event in the mesh framing of TAK protocol version 1."""
    return protobuf.to_protobuf(_event(place))


def from_protobuf(data: bytes) -> Shown:
    """Read a mesh message."""
    return _shown(protobuf.from_protobuf(data))


def _shown(event: cot.CotEvent) -> Shown:
    return Shown(event.time_ns, event.latitude_deg, event.longitude_deg)


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
