"""Others' messages: what each says comes back, in the sizes that are known of them, by independent readers."""

import math
import struct
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from pymap3d import geodetic2ecef
from pymavlink.dialects.v20 import common
from pynmeagps import NMEAReader

from bootprint.clock import NS_PER_S
from bootprint.errors import ConfigError
from bootprint.geodesy import ground_offset
from proving_ground.radio_load.formats import FORMATS, check_format, format_names
from proving_ground.radio_load.formats.format import Place
from proving_ground.radio_load.load import BEGINS_NS, Load

PLACE = Place(7, BEGINS_NS + 754 * NS_PER_S, 59.3512345, 18.0712345, 41.5, 0.9, -1.1)
# Least and most bytes, and how far off a decoded place may be, m.
KNOWN = {
    "cot-xml": (600, 720, 0.02),
    "tak-protobuf": (240, 310, 0.02),
    "mavlink2": (40, 40, 0.02),
    "meshtastic": (50, 62, 0.02),
    "nmea": (70, 80, 0.3),
    "vmf": (21, 21, 0.5),
    "dis": (144, 144, 0.01),
}
places = st.builds(
    Place,
    number=st.integers(1, 1000),
    time_ns=st.integers(0, 1700).map(lambda second: BEGINS_NS + second * NS_PER_S),
    latitude_deg=st.floats(-80.0, 80.0),
    longitude_deg=st.floats(-179.0, 179.0),
    height_m=st.floats(-100.0, 3000.0),
    east_m_s=st.floats(-5.0, 5.0),
    north_m_s=st.floats(-5.0, 5.0),
)


def test_every_format_is_known_here() -> None:
    assert set(KNOWN) == set(FORMATS)


@pytest.mark.parametrize("name", KNOWN)
def test_a_message_has_the_known_size(name: str) -> None:
    least, most, _ = KNOWN[name]
    assert least <= len(FORMATS[name].encode(PLACE)) <= most


@pytest.mark.parametrize("name", KNOWN)
@given(place=places)
def test_a_place_comes_back(name: str, place: Place) -> None:
    shown = FORMATS[name].decode(FORMATS[name].encode(place))
    east, north = ground_offset(
        (place.latitude_deg, place.longitude_deg), (shown.latitude_deg, shown.longitude_deg)
    )
    assert math.hypot(east, north) <= KNOWN[name][2]
    assert shown.time_ns is not None
    assert abs(shown.time_ns - place.time_ns) <= 2_000_000


@given(place=places)
def test_dis_carries_velocity(place: Place) -> None:
    shown = FORMATS["dis"].decode(FORMATS["dis"].encode(place))
    assert (shown.east_m_s, shown.north_m_s) == pytest.approx((place.east_m_s, place.north_m_s), abs=1e-5)


def test_cot_is_an_event_that_an_xml_reader_understands() -> None:
    event = etree.fromstring(FORMATS["cot-xml"].encode(PLACE))
    assert event.get("type") == "a-f-G-U-C"
    assert event.get("time") == "2026-06-01T08:12:34.000Z"
    assert float(event.find("point").get("lat")) == pytest.approx(PLACE.latitude_deg, abs=1e-7)
    track = event.find("detail/track")
    assert float(track.get("speed")) == pytest.approx(math.hypot(0.9, 1.1))
    assert float(track.get("course")) == pytest.approx(math.degrees(math.atan2(0.9, -1.1)))


def test_tak_protobuf_has_the_mesh_header() -> None:
    assert FORMATS["tak-protobuf"].encode(PLACE)[:3] == b"\xbf\x01\xbf"


def test_mavlink_is_read_by_the_common_dialect() -> None:
    (message,) = common.MAVLink(None).parse_buffer(bytearray(FORMATS["mavlink2"].encode(PLACE)))
    assert message.get_type() == "GLOBAL_POSITION_INT"
    assert (message.vx, message.vy) == (-110, 90)  # north, east, cm/s


def test_nmea_sentence_has_the_right_time() -> None:
    sentence = NMEAReader.parse(FORMATS["nmea"].encode(PLACE))
    assert sentence.time == datetime.fromtimestamp(PLACE.time_ns // NS_PER_S, UTC).time()


def test_meshtastic_bytes_follow_the_published_fields() -> None:
    packet = FORMATS["meshtastic"].encode(PLACE)
    # Header of 16 bytes; Data: port 3 (08 03), payload (12, length); Position: latitude (0d), longitude (15).
    assert packet[16:19] == b"\x08\x03\x12"
    assert packet[20:21] == b"\x0d"
    assert struct.unpack_from("<i", packet, 21)[0] == round(PLACE.latitude_deg * 1e7)
    assert packet[25:26] == b"\x15"


def test_dis_fields_stand_where_the_standard_has_them() -> None:
    pdu = FORMATS["dis"].encode(PLACE)
    assert pdu[2] == 1  # entity state
    assert struct.unpack_from(">H", pdu, 8)[0] == 144
    assert struct.unpack_from(">H", pdu, 16)[0] == PLACE.number
    ecef = geodetic2ecef(PLACE.latitude_deg, PLACE.longitude_deg, PLACE.height_m)
    assert struct.unpack_from(">3d", pdu, 48) == pytest.approx(ecef)
    assert pdu[88] == 2  # dead reckoning with constant velocity


def test_vmf_reports_just_fill_the_budget() -> None:
    load = Load(soldiers=12, bitrate=34)
    rule = FORMATS["vmf"].rule(load, 1)
    assert rule._interval_s == pytest.approx(12 * 21 * 8 / 34)  # type: ignore[attr-defined]


def test_an_unknown_format_names_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"did you mean 'cot-xml'.*meshtastic"):
        check_format("cot-xm")
    assert format_names()[0] == "bootprint"
