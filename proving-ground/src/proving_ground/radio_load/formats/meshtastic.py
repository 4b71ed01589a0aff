"""Meshtastic: a Position in a Data in a packet, with the smart broadcast rule.

Field numbers and types are those of its published mesh.proto; the bytes are written by protobuf's own runtime from
that description (the project's Python package would bring a radio's whole driver). Encryption there is AES-CTR,
which adds no bytes and authenticates nothing, so the payload stays in clear here.
"""

import math
import struct
from typing import Any, Final

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import SmartDistance

_Field = descriptor_pb2.FieldDescriptorProto
_POSITION: Final = (
    ("latitude_i", 1, _Field.TYPE_SFIXED32),
    ("longitude_i", 2, _Field.TYPE_SFIXED32),
    ("altitude", 3, _Field.TYPE_INT32),
    ("time", 4, _Field.TYPE_FIXED32),
    ("location_source", 5, _Field.TYPE_UINT32),
    ("PDOP", 11, _Field.TYPE_UINT32),
    ("ground_speed", 15, _Field.TYPE_UINT32),
    ("ground_track", 16, _Field.TYPE_UINT32),
    ("sats_in_view", 19, _Field.TYPE_UINT32),
    ("precision_bits", 23, _Field.TYPE_UINT32),
)
_DATA: Final = (
    ("portnum", 1, _Field.TYPE_UINT32),
    ("payload", 2, _Field.TYPE_BYTES),
    ("bitfield", 9, _Field.TYPE_UINT32),
)
# To, from, packet id, flags, channel hash, next hop, relay node.
_HEADER: Final = struct.Struct("<IIIBBBB")
_EVERYBODY: Final = 0xFFFFFFFF
_POSITION_APP: Final = 3
_GPS_INTERNAL: Final = 2
_FULL_PRECISION: Final = 32


def _described(**messages: tuple[tuple[str, int, Any], ...]) -> dict[str, Any]:
    """Message classes of these fields."""
    file = descriptor_pb2.FileDescriptorProto(name="load_test.proto", package="load_test", syntax="proto3")
    for name, fields in messages.items():
        message = file.message_type.add(name=name)
        for field, number, kind in fields:
            message.field.add(name=field, number=number, type=kind, label=_Field.LABEL_OPTIONAL)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"load_test.{name}"))
        for name in messages
    }


_CLASSES: Final = _described(Position=_POSITION, Data=_DATA)


def encode(place: Place) -> bytes:
    """One packet; on a private channel, where positions go out in full precision."""
    course_deg = math.degrees(math.atan2(place.east_m_s, place.north_m_s)) % 360.0
    position = _CLASSES["Position"](
        latitude_i=round(place.latitude_deg * 1e7),
        longitude_i=round(place.longitude_deg * 1e7),
        altitude=round(place.height_m),
        time=place.time_ns // NS_PER_S,
        location_source=_GPS_INTERNAL,
        PDOP=150,
        ground_speed=round(math.hypot(place.east_m_s, place.north_m_s)),
        ground_track=round(course_deg * 1e5),
        sats_in_view=9,
        precision_bits=_FULL_PRECISION,
    )
    data = _CLASSES["Data"](portnum=_POSITION_APP, payload=position.SerializeToString(), bitfield=1)
    packet_id = (place.time_ns // 1_000_000 + place.number) & 0xFFFFFFFF
    header = _HEADER.pack(_EVERYBODY, place.number, packet_id, 0x63, 8, 0, place.number & 0xFF)
    return header + bytes(data.SerializeToString())


def decode(packet: bytes) -> Shown:
    """Read one packet."""
    data = _CLASSES["Data"].FromString(packet[_HEADER.size :])
    position = _CLASSES["Position"].FromString(data.payload)
    return Shown(position.time * NS_PER_S, position.latitude_i / 1e7, position.longitude_i / 1e7)


MESHTASTIC: Final = Format(
    "meshtastic",
    "Meshtastic position, smart broadcast",
    lambda _load, number: SmartDistance(number),
    encode,
    decode,
    "rule: firmware defaults (smart position, 100 m and 5 min, else 60 min); fields: its mesh.proto, by protobuf; "
    "heard directly, not relayed",
)
