"""NMEA 0183: a GGA sentence every second, as a receiver gives it to a modem."""

from datetime import UTC, datetime
from typing import Final

from pynmeagps import GET, NMEAMessage, NMEAReader

from bootprint.clock import NS_PER_S
from proving_ground.radio_load.formats.format import Format, Place, Shown
from proving_ground.radio_load.formats.rules import FixedInterval
from proving_ground.radio_load.load import BEGINS_NS

_INTERVAL_S: Final = 1.0
_DAY: Final = datetime.fromtimestamp(BEGINS_NS // NS_PER_S, UTC).date()
_NS_PER_MS: Final = 1_000_000


def encode(place: Place) -> bytes:
    """One sentence; heights above the ellipsoid, since no geoid is asked for."""
    time = datetime.fromtimestamp(place.time_ns // _NS_PER_MS / 1000.0, UTC).time()
    message = NMEAMessage(
        "GN",
        "GGA",
        GET,
        time=time,
        lat=place.latitude_deg,
        NS="N" if place.latitude_deg >= 0.0 else "S",
        lon=place.longitude_deg,
        EW="E" if place.longitude_deg >= 0.0 else "W",
        quality=1,
        numSV=12,
        HDOP=0.8,
        alt=round(place.height_m, 1),
        altUnit="M",
        sep=0.0,
        sepUnit="M",
        diffAge="",
        diffStation="",
    )
    return bytes(message.serialize())


def decode(data: bytes) -> Shown:
    """Read one sentence; its time of day is of the test's day."""
    sentence = NMEAReader.parse(data)
    time = datetime.combine(_DAY, sentence.time, UTC)
    return Shown(round(time.timestamp() * 1000.0) * _NS_PER_MS, sentence.lat, sentence.lon)


NMEA: Final = Format(
    "nmea",
    "NMEA 0183 GGA",
    lambda _load, number: FixedInterval(_INTERVAL_S, number),
    encode,
    decode,
    "sentence: pynmeagps; rule: 1 Hz, receivers' default; a sentence names nobody, the radio must",
)
