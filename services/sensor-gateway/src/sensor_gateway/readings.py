"""What decoders hand over: readings stamped by the device's own clock, in SI units."""

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, Protocol

from bootprint.messages import GnssFix, Message, Vector3

ClockId = Hashable
# Where a stamp in UTC comes from: the sensor told it with a date, the host lent it the date, or all of it.
StampedBy = Literal["sensor", "host_date", "arrival"]
StampedFix = tuple[GnssFix, StampedBy]


@dataclass(frozen=True, slots=True)
class ImuReading:
    """One inertial sample: specific force m/s², angular rate rad/s, field µT (None if unknown)."""

    place: str
    clock: ClockId
    device_ns: int
    accel_m_s2: Vector3
    gyro_rad_s: Vector3
    mag_ut: Vector3 | None = None


@dataclass(frozen=True, slots=True)
class MessageReading:
    """A message whose times are the device's (``clock``), or UTC already (``clock`` None)."""

    source: str
    clock: ClockId | None
    message: Message
    stamped_by: StampedBy = "sensor"


@dataclass(frozen=True, slots=True)
class TimeReading:
    """The device tells its clock: against UTC if it knows it, else just now (``utc_ns`` None)."""

    clock: ClockId
    device_ns: int
    utc_ns: int | None = None


Reading = ImuReading | MessageReading | TimeReading


class Decoder(Protocol):
    """A protocol's decoder, sans-IO; faults are counted, never raised."""

    counts: Counter[str]

    def feed(self, data: bytes, received_ns: int) -> list[Reading]:
        """Take the next bytes of the stream, received at this UTC time."""

    def cut(self, received_ns: int) -> list[Reading]:
        """The stream was cut: what is still whole comes out, a half message is dropped."""

    def notes(self) -> list[str]:
        """What a person should know, e.g. sensors that are mapped to no place."""
