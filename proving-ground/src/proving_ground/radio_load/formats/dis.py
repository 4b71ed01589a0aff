"""Distributed Interactive Simulation (IEEE 1278.1): Entity State PDUs, dead reckoning at both ends.

The PDU's fields, each of its standard width, are packed by `struct`; WGS84 to earth-centred by pymap3d. Receivers
go on at constant velocity (DRM FPW), as the sender's rule supposes.
"""

import math
import struct
from typing import Final

import numpy as np
from pymap3d import ecef2geodetic, enu2uvw, geodetic2ecef, uvw2enu

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import DeadReckoning
from proving_ground.radio_load.load import BEGINS_NS
from proving_ground.radio_load.picture_error import straight_on

_HEADER: Final = struct.Struct(">BBBBIHH")  # version, exercise, PDU type, family, time stamp, length, padding
_ENTITY: Final = struct.Struct(">HHHBB")  # site, application, entity, force, articulations
_TYPE: Final = struct.Struct(">BBHBBBB")
_STATE: Final = struct.Struct(">3f3d3fI")  # velocity, location, orientation, appearance
_RECKONING: Final = struct.Struct(">B15x3f3f")
_MARKING: Final = struct.Struct(">B11sI")  # character set, marking, capabilities
PDU_BYTES: Final = 144
_VERSION, _ENTITY_STATE, _ENTITY_FAMILY, _FRIENDLY, _DRM_FPW, _ASCII = 7, 1, 1, 1, 2, 1
_LIFE_FORM: Final = (3, 1, 225, 1, 0, 0, 0)
_HOUR_NS: Final = 3600 * NS_PER_S
_UNITS_PER_HOUR: Final = 2**31


def encode(place: Place) -> bytes:
    """One Entity State PDU with absolute time stamp."""
    since_hour_ns = place.time_ns % _HOUR_NS
    stamp = since_hour_ns * _UNITS_PER_HOUR // _HOUR_NS << 1 | 1
    location = geodetic2ecef(place.latitude_deg, place.longitude_deg, place.height_m)
    velocity = enu2uvw(place.east_m_s, place.north_m_s, 0.0, place.latitude_deg, place.longitude_deg)
    yaw = math.atan2(place.north_m_s, place.east_m_s)
    return b"".join(
        (
            _HEADER.pack(_VERSION, 1, _ENTITY_STATE, _ENTITY_FAMILY, stamp, PDU_BYTES, 0),
            _ENTITY.pack(1, 1, place.number, _FRIENDLY, 0),
            _TYPE.pack(*_LIFE_FORM),
            _TYPE.pack(*_LIFE_FORM),
            _STATE.pack(*velocity, *location, yaw, 0.0, 0.0, 0),
            _RECKONING.pack(_DRM_FPW, *np.zeros(6)),
            _MARKING.pack(_ASCII, f"ALPHA-{place.number}".encode(), 0),
        )
    )


def decode(data: bytes) -> Shown:
    """Read one PDU; its hour is that of the test's beginning or a later one."""
    stamp = _HEADER.unpack_from(data)[4] >> 1
    state = _STATE.unpack_from(data, _HEADER.size + _ENTITY.size + 2 * _TYPE.size)
    latitude_deg, longitude_deg, _ = ecef2geodetic(*state[3:6])
    east, north, _ = uvw2enu(*state[:3], latitude_deg, longitude_deg)
    time_ns = BEGINS_NS - BEGINS_NS % _HOUR_NS + stamp * _HOUR_NS // _UNITS_PER_HOUR
    return Shown(time_ns, float(latitude_deg), float(longitude_deg), float(east), float(north))


DIS: Final = Format(
    "dis",
    "DIS Entity State, dead reckoning",
    lambda _load, number: DeadReckoning(number),
    encode,
    decode,
    "PDU and rule: IEEE 1278.1, thresholds 1 m and 3°, heartbeat 5 s",
    moving=straight_on,
)
