"""MAVLink and NMEA out, read by independent decoders."""

import os
import socket
import struct
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pynmeagps
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mavlink

from bootprint.bus import Envelope
from bootprint.display import Ages, shown
from bootprint.errors import ConfigError
from bootprint.messages import Mode, Position, Track
from bootprint.topics import Identity
from sa_hub.outputs.mavlink import Vehicles
from sa_hub.outputs.nmea import sentences
from sa_hub.outputs.nmea_sink import NmeaSink, Served
from sa_hub.outputs.settings import NmeaSettings, address_of
from support.messages import quick
from support.waiting import PATIENCE_S

S = 1_000_000_000
T0 = 1_760_000_000 * S + 250_000_000
AGES = Ages(75 * S, 180 * S)


def track(number: int, **more: object) -> Track:
    fields = {"east_velocity_m_s": 0.0, "north_velocity_m_s": 0.0, "height_m": 60.0, **more}
    return Track(
        time_ns=T0,
        soldier=f"a{number}",
        number=number,
        state="fresh",
        latitude_deg=-33.9,
        longitude_deg=151.2,
        accuracy_m=2.0,
        **fields,  # type: ignore[arg-type]
    )


def decoded(vehicles: Vehicles, at_s: float) -> list[mavlink.MAVLink_message]:
    data = b"".join(vehicles.frames(T0 + round(at_s * S)))
    return list(mavlink.MAVLink(None).parse_buffer(bytearray(data)) or [])


def vehicles(*tracks: Track) -> Vehicles:
    made = Vehicles(T0, 23.0, AGES)
    for each in tracks:
        made.tell(each)
    return made


def test_each_soldier_is_a_system_with_a_heartbeat_and_a_place() -> None:
    moving = track(7, east_velocity_m_s=-1.0)
    heartbeat, place = decoded(vehicles(moving), 2.0)
    assert (heartbeat.get_type(), heartbeat.get_srcSystem(), heartbeat.system_status) == ("HEARTBEAT", 7, 4)
    assert (place.get_type(), place.get_srcSystem()) == ("GLOBAL_POSITION_INT", 7)
    believed = shown(moving, T0 + 2 * S, AGES)
    assert place.lon / 1e7 == pytest.approx(believed.longitude_deg, abs=1e-7)
    assert place.lon / 1e7 < 151.2
    assert (place.lat, place.alt, place.time_boot_ms) == (-339_000_000, 37_000, 2000)
    assert (place.vx, place.vy, place.hdg) == (0, -100, 27_000)


def test_one_who_stands_has_no_heading_and_one_who_is_lost_is_silent() -> None:
    made = vehicles(track(7))
    assert decoded(made, 1)[1].hdg == 65_535
    assert [each.system_status for each in decoded(made, 100)[:1]] == [mavlink.MAV_STATE_STANDBY]
    assert decoded(made, 181) == []


def test_numbers_that_are_no_system_are_counted() -> None:
    made = vehicles(track(0), track(255), track(900), track(254))
    assert made.unnumbered == {0, 255, 900}
    assert {each.get_srcSystem() for each in decoded(made, 0)} == {254}


def test_frames_of_a_system_are_numbered_without_gaps() -> None:
    made = vehicles(track(7))
    assert [each.get_seq() for at_s in range(3) for each in decoded(made, at_s)] == [0, 1, 2, 3, 4, 5]


# -- NMEA ---------------------------------------------------------------------------------------------


def position(latitude_deg: float = -33.9, longitude_deg: float = 151.2, mode: Mode = "boots") -> Position:
    return Position(
        time_ns=T0,
        mode=mode,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=60.0,
        east_m=0.0,
        north_m=0.0,
        up_m=0.0,
        covariance_m2=(4.0, 0.0, 0.0, 9.0, 0.0, 16.0),
        speed_m_s=1.0,
        course_rad=-1.5707963267948966,
    )


def read(data: bytes) -> list[pynmeagps.NMEAMessage]:
    return [pynmeagps.NMEAReader.parse(line + b"\r\n", validate=1) for line in data.split(b"\r\n")[:-1]]


def test_sentences_say_where_when_and_how_well() -> None:
    gga, rmc, gst = read(sentences(position(), "GN", 23.0))
    assert (gga.identity, rmc.identity, gst.identity) == ("GNGGA", "GNRMC", "GNGST")
    assert (gga.lat, gga.lon) == (pytest.approx(-33.9, abs=1e-7), pytest.approx(151.2, abs=1e-7))
    assert (gga.quality, gga.alt, gga.sep, gga.HDOP) == (6, 37.0, 23.0, "")
    assert str(gga.time) == "08:53:20.250000"
    assert str(rmc.date) == "2025-10-09"
    assert (rmc.status, rmc.posMode, rmc.cog) == ("A", "E", 270.0)
    assert rmc.spd == pytest.approx(1.94)
    assert (gst.stdLat, gst.stdLong, gst.stdAlt) == (3.0, 2.0, 4.0)


def test_satellites_are_told_from_estimates_and_nowhere_from_both() -> None:
    gga, rmc, _ = read(sentences(position(mode="gnss"), "GP", None))
    assert (gga.identity, gga.quality, gga.alt, rmc.posMode) == ("GPGGA", 1, "", "A")
    gga, rmc = read(sentences(position(mode="lost"), "GP", 23.0))
    assert (gga.quality, gga.lat, gga.alt, rmc.status, rmc.posMode) == (0, "", "", "V", "N")


@quick
@given(latitude_deg=st.floats(-90.0, 90.0), longitude_deg=st.floats(-180.0, 180.0))
def test_every_place_is_read_to_centimetres(latitude_deg: float, longitude_deg: float) -> None:
    for sentence in read(sentences(position(latitude_deg, longitude_deg), "GN", None))[:2]:
        assert sentence.lat == pytest.approx(latitude_deg, abs=1e-7)
        assert sentence.lon == pytest.approx(longitude_deg, abs=1e-7)


def test_minutes_that_round_to_sixty_are_a_degree() -> None:
    assert b",4800.00000,N," in sentences(position(latitude_deg=47.999999999), "GN", None)


@contextmanager
def sink(folder: Path, *to: str) -> Iterator[NmeaSink]:
    with closing(NmeaSink(NmeaSettings(to=to), folder, "computer.toml: [hub.nmea]")) as made:
        yield made


TOLD = [Envelope(Identity("bp", "alpha", "a1").address("position", "fusion"), position())]


def test_a_terminal_is_a_device_that_tools_can_open(tmp_path: Path) -> None:
    with sink(tmp_path, "pty:state/nmea") as made:
        device = os.open(tmp_path / "state/nmea", os.O_RDONLY | os.O_NOCTTY)
        made.take(TOLD)
        assert read(os.read(device, 4096))[0].identity == "GNGGA"
        for _ in range(2000):
            made.take(TOLD)  # nobody reads any more
        os.close(device)
    assert not (tmp_path / "state/nmea").is_symlink()


def test_whoever_connects_is_told_and_whoever_leaves_is_forgotten() -> None:
    with closing(Served(("127.0.0.1", 0))) as served:
        one, two = (socket.create_connection(("127.0.0.1", served.port)) for _ in range(2))
        served.write(b"first")
        for each in (one, two):
            each.settimeout(PATIENCE_S)
            assert each.recv(5) == b"first"
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        one.close()  # resets, so that the server knows at once
        served.write(b"second")
        served.write(b"third")
        with two:
            assert two.recv(11, socket.MSG_WAITALL) == b"secondthird"
        assert len(served._clients) == 1


@pytest.mark.parametrize(
    ("to", "message"),
    [
        ("serial:x", "must be udp:host:port, tcp:host:port or pty:file"),
        ("udp:localhost", "must be host:port"),
        ("udp:localhost:99999", "must be host:port"),
        ("tcp:192.0.2.1:1", "cannot be opened: Cannot assign requested address"),
        ("pty:", "must be udp:host:port"),
    ],
)
def test_outlets_that_cannot_be_are_told_in_a_line(tmp_path: Path, to: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        NmeaSink(NmeaSettings(to=(to,)), tmp_path, "computer.toml: [hub.nmea]")


def test_an_address_has_host_and_port() -> None:
    assert address_of("localhost:14550", "here") == ("localhost", 14550)
