"""MAVLink satellite fixes: GPS_RAW_INT, GPS2_RAW, GPS_INPUT.

Their oddities end here: degE7, 65535 and 255 for unknown, ``eph`` which is HDOP × 100 and never metres, heights
above mean sea level, and extension fields that are zero when the sender did not know them.
"""

import math
from typing import Any

from bootprint.messages import FixKind, GnssFix

_U8_UNKNOWN, _U16_UNKNOWN = 0xFF, 0xFFFF
_RAW_KINDS: dict[int, FixKind] = {
    2: "2d",
    3: "3d",
    4: "dgnss",
    5: "rtk_float",
    6: "rtk_fixed",
    7: "3d",  # a static base station
    8: "dgnss",  # precise point positioning
}
_INPUT_KINDS: dict[int, FixKind] = {2: "2d", 3: "3d", 4: "dgnss", 5: "rtk_fixed"}
_IGNORE_ALT, _IGNORE_HDOP, _IGNORE_VELOCITY = 0x1, 0x2, 0x8
_IGNORE_SPEED_ACCURACY, _IGNORE_H_ACCURACY, _IGNORE_V_ACCURACY = 0x20, 0x40, 0x80


def from_raw(message: Any, device_ns: int, geoid_undulation_m: float | None) -> GnssFix:
    """GPS_RAW_INT or GPS2_RAW as a fix stamped by the device."""
    kind = _RAW_KINDS.get(message.fix_type, "none")
    satellites = None if message.satellites_visible == _U8_UNKNOWN else message.satellites_visible
    if kind == "none":
        return GnssFix(time_ns=device_ns, fix_kind=kind, satellites=satellites)
    return GnssFix(
        time_ns=device_ns,
        fix_kind=kind,
        satellites=satellites,
        latitude_deg=message.lat / 1e7,
        longitude_deg=message.lon / 1e7,
        height_m=None if kind == "2d" else _raw_height(message, geoid_undulation_m),
        horizontal_accuracy_m=_known(message.h_acc, 1e-3, 0),
        vertical_accuracy_m=_known(message.v_acc, 1e-3, 0),
        hdop=_known(message.eph, 0.01, _U16_UNKNOWN),
        speed_m_s=_known(message.vel, 0.01, _U16_UNKNOWN),
        speed_accuracy_m_s=_known(message.vel_acc, 1e-3, 0),
        course_rad=_known(message.cog, math.radians(0.01), _U16_UNKNOWN),
    )


def _known(value: int, unit: float, unknown: int) -> float | None:
    return None if value == unknown else value * unit


def _raw_height(message: Any, geoid_undulation_m: float | None) -> float | None:
    """Ellipsoidal height: as sent, else from mean sea level with the stated geoid."""
    if message.alt_ellipsoid:
        return float(message.alt_ellipsoid) / 1000.0
    return None if geoid_undulation_m is None else message.alt / 1000.0 + geoid_undulation_m


def from_input(message: Any, device_ns: int, geoid_undulation_m: float | None) -> GnssFix:
    """GPS_INPUT as a fix stamped by the device."""
    kind = _INPUT_KINDS.get(message.fix_type, "none")
    if kind == "none":
        return GnssFix(time_ns=device_ns, fix_kind=kind, satellites=message.satellites_visible)

    def given(flag: int, value: float) -> float | None:
        return None if message.ignore_flags & flag else value

    altitude = given(_IGNORE_ALT, message.alt) if kind != "2d" else None
    hdop = given(_IGNORE_HDOP, message.hdop)
    moving = not message.ignore_flags & _IGNORE_VELOCITY
    return GnssFix(
        time_ns=device_ns,
        fix_kind=kind,
        satellites=message.satellites_visible,
        latitude_deg=message.lat / 1e7,
        longitude_deg=message.lon / 1e7,
        height_m=None if altitude is None or geoid_undulation_m is None else altitude + geoid_undulation_m,
        horizontal_accuracy_m=given(_IGNORE_H_ACCURACY, message.horiz_accuracy),
        vertical_accuracy_m=given(_IGNORE_V_ACCURACY, message.vert_accuracy),
        hdop=None if hdop == _U16_UNKNOWN else hdop,
        speed_m_s=math.hypot(message.vn, message.ve) if moving else None,
        speed_accuracy_m_s=given(_IGNORE_SPEED_ACCURACY, message.speed_accuracy),
        course_rad=math.atan2(message.ve, message.vn) % math.tau if moving else None,
    )
