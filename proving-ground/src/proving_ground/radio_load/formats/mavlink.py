"""MAVLink 2: GLOBAL_POSITION_INT once a second, as a vehicle's autopilot streams it; unsigned."""

from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import FixedInterval
from proving_ground.radio_load.load import BEGINS_NS

_INTERVAL_S: Final = 1.0
_NS_PER_MS: Final = 1_000_000
_UNKNOWN_HEADING: Final = 65535
_SYSTEMS: Final = 250  # system ids are one byte


def encode(place: Place) -> bytes:
    """One message; boot is the tracks' zero."""
    message = dialect.MAVLink_global_position_int_message(
        time_boot_ms=(place.time_ns - BEGINS_NS) // _NS_PER_MS,
        lat=round(place.latitude_deg * 1e7),
        lon=round(place.longitude_deg * 1e7),
        alt=round(place.height_m * 1e3),
        relative_alt=0,
        vx=round(place.north_m_s * 100.0),
        vy=round(place.east_m_s * 100.0),
        vz=0,
        hdg=_UNKNOWN_HEADING,
    )
    return bytes(message.pack(dialect.MAVLink(None, srcSystem=place.number % _SYSTEMS + 1)))


def decode(data: bytes) -> Shown:
    """Read one message."""
    (message,) = dialect.MAVLink(None).parse_buffer(bytearray(data))
    return Shown(
        BEGINS_NS + message.time_boot_ms * _NS_PER_MS,
        message.lat / 1e7,
        message.lon / 1e7,
        message.vy / 100.0,
        message.vx / 100.0,
    )


MAVLINK2: Final = Format(
    "mavlink2",
    "MAVLink 2 GLOBAL_POSITION_INT",
    lambda _load, number: FixedInterval(_INTERVAL_S, number),
    encode,
    decode,
    "message: pymavlink, unsigned; rule: streamed at 1 Hz, the least that autopilots' presets know; "
    "ground stations show the last position",
)
