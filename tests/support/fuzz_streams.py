"""Fuzz of what reads lines, datagrams and messages: sensors, radio, serial line, Cursor on Target, the bus."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bootprint import wire
from bootprint.errors import WireError
from bootprint.messages import Alert, ImuBatch, Message, Pressure, Status
from bootprint.topics import SUBJECT_OF, TOPICS
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.links.framing import Deframer, framed
from sa_hub.tak.event import CotError, CotEvent, from_xml, to_xml
from sa_hub.tak.protobuf import from_protobuf, to_protobuf
from sensor_gateway.decoders.gnss import GnssDecoder
from sensor_gateway.decoders.mavlink import MavlinkDecoder
from sensor_gateway.settings import Device, Sensor
from support.fuzz_target import Feed, Target, refusing
from support.radio_vectors import NOW_NS, ORIGIN, SENDER, contents
from support.sensor_device import UTC_NS, MavlinkSender, nmea
from support.ubx_receiver import pvt_at

_BOOT: Final = Sensor(system=1, component=1, instance=0, place="left_foot")

_SENSORS: Final = Device(
    imus=(_BOOT,), gnss=(Sensor(system=1, place="gnss"),), pressure=(Sensor(system=1, place="body"),)
)


def _mavlink_seeds(_: Path) -> list[bytes]:
    sender = MavlinkSender()
    place = (1_000_000, 3, 593_500_000, 180_700_000, 40_000, 90, 120, 130, 4500, 9)
    fix = sender.pack(dialect.MAVLink_gps_raw_int_message(*place))
    clock = sender.pack(dialect.MAVLink_system_time_message(1_780_000_000_000_000, 1000))
    old = sender.pack(dialect.MAVLink_scaled_pressure_message(1000, 1013.0, 0.1, 2000), version1=True)
    return [sender.imu(3, updated=0x1FF), b"".join(sender.imus(1, 3)), fix, clock, old]


def _mavlink(_: Path) -> Feed:
    def feed(data: bytes) -> str:
        decoder = MavlinkDecoder(_SENSORS)
        read = decoder.feed(data, UTC_NS) + decoder.cut(UTC_NS)
        return f"{len(read)} readings, {sorted(decoder.counts)}"

    return feed


def _gnss_seeds(_: Path) -> list[bytes]:
    epoch, next_epoch = (_nmea_epoch(f"1235{second}") for second in ("19.25", "20.25"))
    return [epoch, epoch + next_epoch, pvt_at(UTC_NS), epoch + pvt_at(UTC_NS)]


def _nmea_epoch(time: str) -> bytes:
    gga = f"GPGGA,{time},4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,"
    rmc = f"GPRMC,{time},A,4807.038,N,01131.000,W,010.0,090.0,230326,003.1,W"
    gst = f"GPGST,{time},3.2,6.6,4.7,47.3,3.0,4.0,22.0"
    return nmea(gga) + nmea(rmc) + nmea(gst)


def _gnss(_: Path) -> Feed:
    def feed(data: bytes) -> str:
        decoder = GnssDecoder(Device(protocol="ubx+nmea", gnss_name="rx"))
        read = decoder.feed(data, UTC_NS) + decoder.cut(UTC_NS)
        return f"{len(read)} readings, {sorted(decoder.counts)}"

    return feed


def _radio_seeds(_: Path) -> list[bytes]:
    codec = Codec(ORIGIN)
    return [codec.encode(SENDER, content, 3, 240, asked) for _, content, asked in contents()]


def _radio(_: Path) -> Feed:
    codec = Codec(ORIGIN)
    return refusing(lambda data: type(codec.decode(SENDER, data, NOW_NS).content).__name__, FrameError)


def _line(_: Path) -> Feed:
    def feed(data: bytes) -> str:
        return f"{len(list(Deframer().feed(data)))} frames"

    return feed


_EVENT: Final = CotEvent(
    uid="bootprint-bp-a1",
    type="a-f-G-U-C-I",
    how="m-f",
    time_ns=UTC_NS,
    start_ns=UTC_NS,
    stale_ns=UTC_NS + 75_000_000_000,
    latitude_deg=59.35,
    longitude_deg=18.07,
    details={"contact": {"callsign": "Alpha 1"}, "track": {"course": "90.0", "speed": "1.2"}},
    remarks="floor 2 & <up>",
)


def _cot(read: Callable[[bytes], CotEvent]) -> Callable[[Path], Feed]:
    return lambda _: refusing(lambda data: f"{read(data).type[:4]}", CotError)


def _message_seeds(_: Path) -> list[bytes]:
    """The topic's number in a byte, then a message of it."""
    batch = ImuBatch.from_arrays(1, np.array([1, 2]), np.ones((2, 3)), np.zeros((2, 3)), np.ones((2, 3)))
    said: tuple[Message, ...] = (
        batch,
        Pressure(time_ns=UTC_NS, sequence=1, pressure_pa=1e5),
        Alert(time_ns=UTC_NS, soldier="a1", kind="help", text="stairs"),
        Status(time_ns=UTC_NS, soldier="a1", condition="ok", battery_pct=40.0),
    )
    subjects = [topic.subject for topic in TOPICS]
    return [bytes([subjects.index(SUBJECT_OF[type(each)])]) + wire.encode(each) for each in said]


def _message(_: Path) -> Feed:
    def feed(data: bytes) -> str:
        topic = TOPICS[data[0] % len(TOPICS)] if data else TOPICS[0]
        return type(wire.decode(topic.subject, data[1:])).__name__

    return refusing(feed, WireError)


_READ: Final = r"[1-9]\d* readings, \['frames'\]"


def stream_targets() -> Iterator[Target]:
    """All of them."""
    yield Target("mavlink", _mavlink_seeds, _mavlink, _READ)
    yield Target("gnss", _gnss_seeds, _gnss, _READ)
    yield Target("radio", _radio_seeds, _radio, r"[A-Z]\w+")
    yield Target(
        "serial-line", lambda _: [framed(b"abc\x00def"), framed(bytes(200)) * 2], _line, r"[12] frames"
    )
    yield Target("cot-xml", lambda _: [to_xml(_EVENT)], _cot(from_xml), "a-f-")
    yield Target("cot-protobuf", lambda _: [to_protobuf(_EVENT)], _cot(from_protobuf), "a-f-")
    yield Target("message", _message_seeds, _message, r"[A-Z]\w+")
