"""MAVLink (versions 1 and 2) to readings: inertial units, pressure, satellite fixes, visual odometry, clocks.

The dialect is ardupilotmega: all of common, and VISION_POSITION_DELTA. DISTANCE_SENSOR tells the distance to a
surface, not to a unit, and is therefore no `Range`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bootprint.messages import Message
from sensor_gateway.decoders import mavlink_frame, mavlink_gnss, mavlink_imu, mavlink_motion
from sensor_gateway.framing import Framer
from sensor_gateway.readings import ClockId, MessageReading, Reading, TimeReading
from sensor_gateway.settings import Device

_UNIX_2000_S, _UNIX_2100_S = 946_684_800, 4_102_444_800
_MAX_NOTES = 8
Handler = Callable[[Any], Iterable[Reading]]


class MavlinkDecoder:
    """One stream of MAVLink bytes; ``device`` maps (system, component, instance) to places."""

    def __init__(self, device: Device) -> None:
        self.counts: Counter[str] = Counter()
        self._places = {
            (subject, sensor.system, sensor.component, sensor.instance): sensor.place
            for subject, sensor in device.mapped()
        }
        self._unmapped: set[str] = set()
        self._geoid_undulation_m = device.geoid_undulation_m
        self._framer = Framer(mavlink_frame.MARKERS, mavlink_frame.measure, self.counts)
        self._parser = dialect.MAVLink(None)
        self._imu = mavlink_imu.ImuDecoder(self.counts)
        self._odometry: dict[str, mavlink_motion.OdometryDifference] = {}
        self._handlers = self._table()

    def _table(self) -> dict[str, Handler]:
        """Message type to its handler; all other types are passed over."""
        imu = {name: self._scaled_imu(number) for number, name in enumerate(_numbered("SCALED_IMU"))}
        pressure = {name: self._pressure(number) for number, name in enumerate(_numbered("SCALED_PRESSURE"))}
        return {
            mavlink_imu.HIGHRES: self._highres_imu,
            "RAW_IMU": self._raw_imu,
            **imu,
            **pressure,
            "GPS_RAW_INT": self._gps_raw(0),
            "GPS2_RAW": self._gps_raw(1),
            "GPS_INPUT": self._gps_input,
            "ODOMETRY": self._odometry_pose,
            "VISION_POSITION_DELTA": self._vision_delta,
            "SYSTEM_TIME": self._system_time,
            "TIMESYNC": self._timesync,
        }

    def feed(self, data: bytes, received_ns: int) -> list[Reading]:
        """The readings that these bytes complete."""
        return self._decode(self._framer.feed(data))

    def cut(self, received_ns: int) -> list[Reading]:
        """The stream ended: what is still whole."""
        return self._decode(self._framer.cut())

    def notes(self) -> list[str]:
        """Sensors heard that the configuration maps to no place."""
        return [f"not mapped: {sensor}" for sensor in sorted(self._unmapped)]

    def _decode(self, frames: Iterable[bytes]) -> list[Reading]:
        readings: list[Reading] = []
        for frame in frames:
            self.counts["frames"] += 1
            try:
                message = self._parser.decode(bytearray(frame))
                handler = self._handlers.get(message.get_type())
                if handler is not None:
                    readings.extend(handler(message))
            except (dialect.MAVError, ValueError, OverflowError):
                # A checked frame whose content makes no message: a number that is not finite or out of range.
                self.counts["messages_invalid"] += 1
        return readings

    @staticmethod
    def _key(subject: str, message: Any, instance: int) -> tuple[str, int, int, int]:
        return subject, message.get_srcSystem(), message.get_srcComponent(), instance

    def _place(self, subject: str, message: Any, instance: int) -> str | None:
        key = self._key(subject, message, instance)
        place = self._places.get(key)
        if place is None:
            self.counts[f"unmapped_{subject}"] += 1
            if len(self._unmapped) < _MAX_NOTES:
                self._unmapped.add(f"{subject} of system {key[1]} component {key[2]} instance {instance}")
        return place

    def _highres_imu(self, message: Any) -> Iterator[Reading]:
        clock, device_ns = _time(message)
        place = self._place("imu", message, message.id)
        if place is not None:
            reading = self._imu.highres(message, place, clock, device_ns)
            if reading is not None:
                yield reading
        # Every boot's unit may have a barometer; only one that is mapped is wanted, and no word lost on others.
        if mavlink_imu.has_pressure(message) and self._key("pressure", message, message.id) in self._places:
            pressure = mavlink_imu.highres_pressure(message, device_ns)
            yield from self._placed("pressure", message, message.id, pressure)

    def _scaled_imu(self, instance: int) -> Handler:
        def handle(message: Any) -> Iterator[Reading]:
            place = self._place("imu", message, instance)
            if place is not None:
                reading = self._imu.scaled(message, place, *_time(message))
                if reading is not None:
                    yield reading

        return handle

    def _raw_imu(self, message: Any) -> Iterable[Reading]:
        """RAW_IMU has no units: refused."""
        self.counts["imu_raw_refused"] += 1
        return ()

    def _pressure(self, instance: int) -> Handler:
        def handle(message: Any) -> Iterator[Reading]:
            pressure = mavlink_imu.scaled_pressure(message, _time(message)[1])
            yield from self._placed("pressure", message, instance, pressure)

        return handle

    def _gps_raw(self, instance: int) -> Handler:
        def handle(message: Any) -> Iterator[Reading]:
            fix = mavlink_gnss.from_raw(message, _time(message)[1], self._geoid_undulation_m)
            yield from self._placed("gnss", message, instance, fix)

        return handle

    def _gps_input(self, message: Any) -> Iterator[Reading]:
        fix = mavlink_gnss.from_input(message, _time(message)[1], self._geoid_undulation_m)
        yield from self._placed("gnss", message, message.gps_id, fix)

    def _odometry_pose(self, message: Any) -> Iterator[Reading]:
        place = self._place("camera_motion", message, 0)
        if place is not None:
            clock, device_ns = _time(message)
            difference = self._odometry.setdefault(place, mavlink_motion.OdometryDifference(self.counts))
            motion = difference.motion(message, device_ns)
            if motion is not None:
                yield MessageReading(place, clock, motion)

    def _vision_delta(self, message: Any) -> Iterator[Reading]:
        motion = mavlink_motion.from_vision_delta(message, _time(message)[1])
        yield from self._placed("camera_motion", message, 0, motion)

    def _placed(self, subject: str, message: Any, instance: int, content: Message) -> Iterator[Reading]:
        place = self._place(subject, message, instance)
        if place is not None:
            yield MessageReading(place, _time(message)[0], content)

    def _system_time(self, message: Any) -> Iterator[Reading]:
        """SYSTEM_TIME ties both of the sender's clocks to UTC, once it knows UTC (0 until then)."""
        boot_ns, unix_ns = message.time_boot_ms * 1_000_000, message.time_unix_usec * 1000
        if _is_unix_ns(unix_ns):
            yield TimeReading(_clock(message, is_unix=True), unix_ns, unix_ns)
            yield TimeReading(_clock(message, is_unix=False), boot_ns, unix_ns)
        else:
            yield TimeReading(_clock(message, is_unix=False), boot_ns)

    def _timesync(self, message: Any) -> Iterator[Reading]:
        """A request (tc1 = 0) tells the sender's clock in ns; an answer to someone else tells us nothing."""
        if message.tc1 == 0 and message.ts1 > 0:
            yield TimeReading(_clock(message, is_unix=_is_unix_ns(message.ts1)), message.ts1)


def _numbered(name: str) -> tuple[str, str, str]:
    return name, f"{name}2", f"{name}3"


def _time(message: Any) -> tuple[ClockId, int]:
    """The clock of a message's stamp and the stamp on it, ns: since boot, or since 1970 by its magnitude."""
    micros = getattr(message, "time_usec", None)
    device_ns = message.time_boot_ms * 1_000_000 if micros is None else micros * 1000
    return _clock(message, is_unix=_is_unix_ns(device_ns)), device_ns


def _clock(message: Any, *, is_unix: bool) -> ClockId:
    return message.get_srcSystem(), message.get_srcComponent(), "unix" if is_unix else "boot"


def _is_unix_ns(device_ns: int) -> bool:
    return _UNIX_2000_S <= device_ns // 1_000_000_000 < _UNIX_2100_S
