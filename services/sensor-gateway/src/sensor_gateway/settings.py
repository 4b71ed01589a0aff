"""The ``[gateway]`` section of computer.toml: a list of sources, each of one ``kind``, checked strictly."""

from collections import Counter
from collections.abc import Iterable
from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from bootprint.errors import ConfigError

Protocol = Literal["mavlink", "nmea", "ubx", "nmea+ubx"]
Place = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{1,64}$")]
MavlinkId = Annotated[int, msgspec.Meta(ge=0, le=255)]
Port = Annotated[int, msgspec.Meta(ge=0, le=65535)]
UtcSeconds = Annotated[float, msgspec.Meta(ge=0.0, lt=4_102_444_800.0)]  # until the year 2100


class Sensor(Config, frozen=True):
    """Which MAVLink sender and instance (counted from 0) is which place, e.g. ``left_foot``."""

    system: MavlinkId
    place: Place
    component: MavlinkId = 1
    instance: MavlinkId = 0


class Device(Config, frozen=True):
    """What a stream of sensor bytes is made of.

    ``geoid_undulation_m`` is the geoid's height above the ellipsoid here: for receivers that tell only heights
    above mean sea level. ``gnss_name`` names the receiver of an NMEA or UBX stream on the bus.
    """

    protocol: Protocol = "mavlink"
    imus: tuple[Sensor, ...] = ()
    pressure: tuple[Sensor, ...] = ()
    gnss: tuple[Sensor, ...] = ()
    camera: tuple[Sensor, ...] = ()
    batch_size: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 10
    batch_age_ms: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 60.0
    geoid_undulation_m: float | None = None
    gnss_name: Place = "gnss"

    @property
    def batch_age_ns(self) -> int:
        """The longest time between the first and the last sample of a batch."""
        return round(self.batch_age_ms * 1e6)

    def expected(self) -> tuple[tuple[str, str], ...]:
        """The (subject, source) pairs this device should feed."""
        if self.protocol != "mavlink":
            return (("gnss", self.gnss_name),)
        return tuple((subject, sensor.place) for subject, sensor in self.mapped())

    def mapped(self) -> Iterable[tuple[str, Sensor]]:
        """Every line of the mapping table, with the subject it feeds."""
        tables = {
            "imu": self.imus,
            "pressure": self.pressure,
            "gnss": self.gnss,
            "camera_motion": self.camera,
        }
        return ((subject, sensor) for subject, sensors in tables.items() for sensor in sensors)


class SerialSource(Device, frozen=True, kw_only=True, tag_field="kind", tag="serial"):
    """A serial port; a path under ``/dev/serial/by-id`` survives replugging."""

    port: str
    baud: Annotated[int, msgspec.Meta(gt=0)] = 921_600


class UdpSource(Device, frozen=True, kw_only=True, tag_field="kind", tag="udp"):
    """A UDP socket that listens."""

    bind: str = "127.0.0.1"
    port: Port


class ReplaySource(Device, frozen=True, kw_only=True, tag_field="kind", tag="replay"):
    """A recording: MAVLink ``.tlog``, ``.mcap`` of the bus, a run folder, or a data set.

    ``run`` chooses one of several runs, ``soldier`` one of several soldiers of an MCAP file (default: this
    computer's own). ``start_time_s`` is the UTC second at which the recording's time zero is played; without it
    the replay starts now, and with ``--speed max`` at 2026-01-01T00:00:00Z. With ``skip_past`` what was due before
    the replay began is not sent, as a sensor's past is not.
    """

    path: str
    run: str | None = None
    soldier: str | None = None
    start_time_s: UtcSeconds | None = None
    skip_past: bool = False
    loop: bool = False
    exit_when_done: bool = False


class CameraSource(Config, frozen=True, kw_only=True, tag_field="kind", tag="camera"):
    """A stereo camera: two devices (number, or what OpenCV opens: a path, an address) of rectified images.

    ``calibration`` is a file with the projection matrices ``P0:`` and ``P1:``, as in a camera folder. ``imu`` is
    the place of an inertial unit beside it, with axes forward, left, up, if one of the other sources has it.
    """

    left: int | str
    right: int | str
    calibration: str
    name: Place = "camera"
    rate_hz: Annotated[float, msgspec.Meta(ge=1.0, le=60.0)] = 10.0
    imu: Place | None = None

    def expected(self) -> tuple[tuple[str, str], ...]:
        """The (subject, source) pair it should feed."""
        return (("camera_motion", self.name),)

    def mapped(self) -> Iterable[tuple[str, Sensor]]:
        """It has no mapping table."""
        return ()


Source = SerialSource | UdpSource | ReplaySource | CameraSource


class GatewaySettings(Config, frozen=True):
    """``[gateway]``."""

    sources: tuple[Source, ...] = ()


def check(settings: GatewaySettings, where: str) -> None:
    """ConfigError on what each table alone cannot know: nothing to do, or two sensors in one place."""
    if not settings.sources:
        raise ConfigError(f"{where} has no sources; add at least one [[gateway.sources]] with a kind")
    live = [source for source in settings.sources if not isinstance(source, ReplaySource)]
    for number, source in enumerate(settings.sources):
        if source in live and not source.expected():
            raise ConfigError(
                f"{where} sources[{number}] maps no MAVLink sensor to a place; "
                "add [[gateway.sources.imus]] (or gnss, pressure, camera) with system and place"
            )
    _check_unique(where, "feed", [pair for source in settings.sources for pair in source.expected()])
    for source in settings.sources:
        _check_unique(where, "map", [(subject, _sender(sensor)) for subject, sensor in source.mapped()])


def _sender(sensor: Sensor) -> str:
    return f"system {sensor.system} component {sensor.component} instance {sensor.instance}"


def _check_unique(where: str, verb: str, pairs: Iterable[tuple[str, str]]) -> None:
    for (subject, name), count in Counter(pairs).items():
        if count > 1:
            raise ConfigError(f"{where} sources {verb} {subject} {name} more than once; make each unique")
