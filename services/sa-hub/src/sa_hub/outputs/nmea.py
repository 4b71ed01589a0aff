"""A position as NMEA 0183 sentences: GGA and RMC for any tool, GST for those that care how good it is.

Quality and mode say how the place came about: satellites, or estimated. HDOP stays empty, for it is no distance and
nothing here has one.
"""

import math
from datetime import UTC, datetime
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.messages import Position

_NOWHERE: Final = ("unplaced", "lost")
_KNOTS_PER_M_S: Final = 3600.0 / 1852.0
_MINUTES: Final = 100_000  # parts of a minute


def sentences(position: Position, talker: str, undulation_m: float | None) -> bytes:
    """GGA, RMC and GST of one moment, each with its checksum and line end."""
    placed = position.mode not in _NOWHERE
    parts = [_gga(position, undulation_m, placed=placed), _rmc(position, placed=placed)]
    if placed:
        parts.append(_gst(position))
    return b"".join(_sentence(f"{talker}{part}") for part in parts)


def _sentence(body: str) -> bytes:
    checksum = 0
    for byte in body.encode():
        checksum ^= byte
    return f"${body}*{checksum:02X}\r\n".encode()


def _gga(position: Position, undulation_m: float | None, *, placed: bool) -> str:
    quality = 0 if not placed else 1 if position.mode == "gnss" else 6
    height = ",,,"
    if placed and undulation_m is not None:
        height = f"{position.height_m - undulation_m:.1f},M,{undulation_m:.1f},M"
    return f"GGA,{_time(position)},{_place(position, placed)},{quality},,,{height},,"


def _rmc(position: Position, *, placed: bool) -> str:
    mode = "N" if not placed else "A" if position.mode == "gnss" else "E"
    speed = f"{position.speed_m_s * _KNOTS_PER_M_S:.2f}" if placed else ""
    known = placed and position.course_rad is not None
    course = f"{math.degrees(position.course_rad or 0.0) % 360.0:.1f}" if known else ""
    status = "A" if placed else "V"
    date = f"{_moment(position):%d%m%y}"
    return f"RMC,{_time(position)},{status},{_place(position, placed)},{speed},{course},{date},,,{mode}"


def _gst(position: Position) -> str:
    """One sigma of latitude, longitude and height; the ellipse's axes stay empty."""
    east_m2, _, _, north_m2, _, up_m2 = position.covariance_m2
    north, east, up = (f"{math.sqrt(max(0.0, m2)):.1f}" for m2 in (north_m2, east_m2, up_m2))
    return f"GST,{_time(position)},,,,,{north},{east},{up}"


def _moment(position: Position) -> datetime:
    return datetime.fromtimestamp(position.time_ns // NS_PER_S, UTC)


def _time(position: Position) -> str:
    return f"{_moment(position):%H%M%S}.{position.time_ns % NS_PER_S // 10_000_000:02d}"


def _place(position: Position, placed: bool) -> str:
    if not placed:
        return ",,,"
    return f"{_angle(position.latitude_deg, 'NS', 2)},{_angle(position.longitude_deg, 'EW', 3)}"


def _angle(degrees: float, signs: str, width: int) -> str:
    """Degrees and minutes in one number, and the hemisphere; rounded before it is split."""
    whole, parts = divmod(round(abs(degrees) * 60 * _MINUTES), 60 * _MINUTES)
    return f"{whole:0{width}d}{parts / _MINUTES:08.5f},{signs[degrees < 0.0]}"
