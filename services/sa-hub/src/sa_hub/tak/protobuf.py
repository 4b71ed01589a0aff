"""Events in TAK protocol version 1 (protobuf); takproto's messages.

Written in the framing of a mesh's datagrams. Read in that of streams, too, for some clients use it in datagrams.
"""

from collections.abc import Mapping
from typing import Any, Final
from xml.etree import ElementTree

from google.protobuf.message import DecodeError
from takproto.functions import xml2message
from takproto.proto import TakMessage

from sa_hub.tak.event import MAX_EVENT_BYTES, CotError, CotEvent, checked, known, read_details, to_xml

MAGIC: Final = b"\xbf"
_MESH: Final = b"\xbf\x01\xbf"
_NS_PER_MS: Final = 1_000_000
_TYPED: Final = {
    "contact": ("contact", ("callsign", "endpoint")),
    "group": ("__group", ("name", "role")),
    "precisionLocation": ("precisionlocation", ("geopointsrc", "altsrc")),
    "status": ("status", ("battery",)),
    "takv": ("takv", ("device", "platform", "os", "version")),
    "track": ("track", ("speed", "course")),
}


def to_protobuf(event: CotEvent) -> bytes:
    """The event in one datagram."""
    message = xml2message(to_xml(event).decode())
    # takproto takes times through floats and cuts them off, a millisecond too early now and then.
    message.cotEvent.sendTime = event.time_ns // _NS_PER_MS
    message.cotEvent.startTime = event.start_ns // _NS_PER_MS
    message.cotEvent.staleTime = event.stale_ns // _NS_PER_MS
    return _MESH + bytes(message.SerializeToString())


def from_protobuf(data: bytes) -> CotEvent:
    """Read one datagram; CotError for anything else."""
    if len(data) > MAX_EVENT_BYTES:
        raise CotError(f"{len(data)} bytes, more than {MAX_EVENT_BYTES}")
    message = TakMessage()
    try:
        message.ParseFromString(_unframed(data))
    except DecodeError as error:
        raise CotError(f"no protobuf: {error}") from error
    return _event(message.cotEvent)


def _unframed(data: bytes) -> bytes:
    """The message behind a mesh's header, or behind a stream's with its length (7 bits a byte, least first)."""
    if data.startswith(_MESH):
        return data[len(_MESH) :]
    length = 0
    for index, byte in enumerate(data[1:4]):
        length |= (byte & 0x7F) << (7 * index)
        if byte < 0x80 and data.startswith(MAGIC) and len(data) == 2 + index + length:
            return data[2 + index :]
    raise CotError("no message of TAK protocol version 1")


def _event(event: Any) -> CotEvent:
    details, remarks = _details(event.detail)
    if not all(abs(value) < float("inf") for value in (event.lat, event.lon, event.hae, event.ce, event.le)):
        raise CotError("a number that is not finite")
    return checked(
        CotEvent(
            uid=event.uid,
            type=event.type,
            how=event.how,
            time_ns=event.sendTime * _NS_PER_MS,
            start_ns=event.startTime * _NS_PER_MS,
            stale_ns=event.staleTime * _NS_PER_MS,
            latitude_deg=event.lat,
            longitude_deg=event.lon,
            hae_m=known(event.hae),
            ce_m=known(event.ce),
            le_m=known(event.le),
            details=details,
            remarks=remarks,
            opex=event.opex,
        )
    )


def _details(detail: Any) -> tuple[Mapping[str, Mapping[str, str]], str]:
    """Elements that have messages of their own, and the rest, which travels as XML without a root."""
    if b"<!" in detail.xmlDetail.encode():
        raise CotError("a document type or entity in the detail")
    try:
        others, remarks = read_details(ElementTree.fromstring(f"<detail>{detail.xmlDetail}</detail>"))
    except (ElementTree.ParseError, ValueError) as error:
        raise CotError(f"the detail is no XML: {error}") from error
    typed = {
        name: {key: str(getattr(getattr(detail, part), key)) for key in keys}
        for part, (name, keys) in _TYPED.items()
        if detail.HasField(part)
    }
    return {**others, **typed}, remarks
