"""A position report of the size of VMF K05.1 (MIL-STD-6017), at a fixed rate that just fills the budget.

The standard is not public, so the layout is one of our own with the fields that are known of it and their widths
where they are known (latitude 25 bits, longitude 26, unit reference number 24), filled up to the 21 bytes of a
report with all of them.
"""

import math
from datetime import UTC, datetime
from typing import Final

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import FixedInterval
from proving_ground.radio_load.load import BEGINS_NS, Load

REPORT_BYTES: Final = 21
_SHORTEST_S: Final = 1.0
_WIDTHS: Final = (
    ("unit", 24),
    ("latitude", 25),
    ("longitude", 26),
    ("elevation", 17),
    ("day", 5),
    ("second", 17),
    ("speed", 11),
    ("course", 9),
    ("quality", 4),
    ("exercise", 1),
)
_SPARE: Final = 8 * REPORT_BYTES - sum(width for _, width in _WIDTHS)
_QUALITY: Final = 8
_LATITUDE_DEG: Final = 180.0 / 2**25
_LONGITUDE_DEG: Final = 360.0 / 2**26
_LOWEST_M: Final = -1000


def encode(place: Place) -> bytes:
    """One report; speed in 0.1 m/s, course in degrees."""
    time = datetime.fromtimestamp(place.time_ns // NS_PER_S, UTC)
    values = {
        "unit": place.number,
        "latitude": int((place.latitude_deg + 90.0) / _LATITUDE_DEG),
        "longitude": int((place.longitude_deg + 180.0) / _LONGITUDE_DEG),
        "elevation": round(place.height_m) - _LOWEST_M,
        "day": time.day,
        "second": time.hour * 3600 + time.minute * 60 + time.second,
        "speed": round(10.0 * math.hypot(place.east_m_s, place.north_m_s)),
        "course": round(math.degrees(math.atan2(place.east_m_s, place.north_m_s))) % 360,
        "quality": _QUALITY,
        "exercise": 1,
    }
    bits = 0
    for name, width in _WIDTHS:
        bits = bits << width | values[name]
    return (bits << _SPARE).to_bytes(REPORT_BYTES, "big")


def decode(data: bytes) -> Shown:
    """Read one report; a position is the middle of its cell."""
    bits = int.from_bytes(data, "big") >> _SPARE
    values = {}
    for name, width in reversed(_WIDTHS):
        values[name], bits = bits & ((1 << width) - 1), bits >> width
    day_ns = BEGINS_NS - BEGINS_NS % (86_400 * NS_PER_S)
    return Shown(
        day_ns + values["second"] * NS_PER_S,
        (values["latitude"] + 0.5) * _LATITUDE_DEG - 90.0,
        (values["longitude"] + 0.5) * _LONGITUDE_DEG - 180.0,
    )


def interval_s(load: Load) -> float:
    """Between a soldier's reports, if all together just fill the budget."""
    report_bits = 8 * load.medium.air_bytes(REPORT_BYTES)
    return max(_SHORTEST_S, load.soldiers * report_bits / load.bitrate)


VMF: Final = Format(
    "vmf",
    "VMF K05.1-like, fixed rate",
    lambda load, number: FixedInterval(interval_s(load), number),
    encode,
    decode,
    "size: 21 bytes, what K05.1 bodies are said to take at most; rule: a fixed interval planned to fill the budget",
)
