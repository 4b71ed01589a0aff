"""``[gateway]`` of computer.toml: what is right, and one line for what is wrong."""

import tomllib

import pytest

from bootprint.config import convert
from bootprint.errors import ConfigError
from sensor_gateway.settings import GatewaySettings, ReplaySource, Sensor, SerialSource, UdpSource, check

GOOD = """
[[sources]]
kind = "serial"
port = "/dev/serial/by-id/boots"
imus = [{ system = 1, place = "left_foot" }, { system = 2, component = 5, instance = 1, place = "right_foot" }]

[[sources]]
kind = "udp"
port = 14550
protocol = "nmea+ubx"
gnss_name = "roof"

[[sources]]
kind = "replay"
path = "walk"
start_time_s = 1767225600.5
"""


def read(text: str) -> GatewaySettings:
    settings = convert(tomllib.loads(text), GatewaySettings, where="computer.toml: [gateway]")
    check(settings, "computer.toml: [gateway]")
    return settings


def test_every_kind_with_its_defaults() -> None:
    serial, udp, replay = read(GOOD).sources
    assert isinstance(serial, SerialSource)
    assert (serial.baud, serial.protocol, serial.batch_size, serial.batch_age_ns) == (
        921_600,
        "mavlink",
        10,
        60_000_000,
    )
    assert serial.imus[1] == Sensor(system=2, component=5, instance=1, place="right_foot")
    assert serial.expected() == (("imu", "left_foot"), ("imu", "right_foot"))
    assert isinstance(udp, UdpSource)
    assert (udp.bind, udp.expected()) == ("127.0.0.1", (("gnss", "roof"),))
    assert isinstance(replay, ReplaySource)
    assert (replay.start_time_s, replay.loop, replay.exit_when_done) == (1767225600.5, False, False)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no sources"),
        (GOOD.replace('"udp"', '"usb"'), "usb"),
        (GOOD.replace("port = 14550", 'port = "14550"'), "sources"),
        (GOOD.replace("gnss_name", "gnss_nam"), "gnss_nam"),
        (GOOD.replace('"nmea+ubx"', '"nmae"'), "nmae"),
        (GOOD.replace('"roof"', '"on the roof"'), "gnss_name"),
        (GOOD.replace("right_foot", "left_foot"), "imu left_foot more than once"),
        (
            GOOD.replace("system = 2, component = 5, instance = 1", "system = 1"),
            "system 1 component 1 instance 0 more than once",
        ),
        ('sources = [{ kind = "udp", port = 1 }]', "maps no MAVLink sensor"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=r"computer\.toml") as caught:
        read(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
