"""A run as the MAVLink frames that its sensors would send: HIGHRES_IMU, SCALED_PRESSURE, GPS_RAW_INT, SYSTEM_TIME,
VISION_POSITION_DELTA. Stamps are UTC microseconds. What is not finite stays away, as from a sensor.
"""

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect
from scipy.spatial.transform import Rotation

from bootprint.clock import NS_PER_S
from sensor_gateway.recordings.run import CameraSeries, GnssSeries, ImuSeries, PressureSeries, Run

PLACES: Final = {"left_foot": 11, "right_foot": 12, "body": 13, "gnss": 14, "camera": 15}
"""The MAVLink system of each place."""
Frames = Iterator[tuple[int, bytes]]
_ACCEL_GYRO, _MAG = 0x3F, 0x1C0
_GAUSS_PER_UT = 0.01
_GPS_3D, _GPS_2D, _GPS_NONE = 3, 2, 0
_US, _MS = 1000, 1_000_000  # ns


class _Sender:
    """One MAVLink system."""

    def __init__(self, place: str) -> None:
        self._link = dialect.MAVLink(None, srcSystem=PLACES[place], srcComponent=1)

    def pack(self, message: Any) -> bytes:
        frame = bytes(message.pack(self._link))
        self._link.seq = (self._link.seq + 1) % 256
        return frame


def mavlink_frames(run: Run, start_ns: int) -> list[Frames]:
    """A stream of (time UTC ns, frame) for every sensor, the run's zero at ``start_ns``."""
    streams = [_imu(place, imu, start_ns) for place, imu in sorted(run.imus.items())]
    if run.pressure is not None:
        streams.append(_pressure(run.pressure, start_ns))
    if run.gnss is not None:
        streams.append(_gnss(run.gnss, start_ns))
    if run.camera is not None:
        streams.append(_camera(run.camera, start_ns))
    return streams


def _times_ns(time_s: Any, start_ns: int) -> list[int]:
    """Stamps in whole microseconds, as the line carries them."""
    whole = np.round(np.nan_to_num(time_s) * 1e6).astype(np.int64) * _US + start_ns
    return [int(value) for value in whole]


def _timed(sender: _Sender, frames: Frames, start_ns: int) -> Frames:
    """The frames with a SYSTEM_TIME before the first and then once a second; devices boot at the run's zero."""
    said_ns: int | None = None
    for time_ns, frame in frames:
        if said_ns is None or time_ns - said_ns >= NS_PER_S:
            said_ns = time_ns
            boot_ms = (time_ns - start_ns) // _MS
            yield time_ns, sender.pack(dialect.MAVLink_system_time_message(time_ns // _US, boot_ms))
        yield time_ns, frame


def _imu(place: str, imu: ImuSeries, start_ns: int) -> Frames:
    sender = _Sender(place)
    return _timed(sender, _imu_frames(sender, imu, start_ns), start_ns)


def _imu_frames(sender: _Sender, imu: ImuSeries, start_ns: int) -> Frames:
    mag = np.zeros_like(imu.accel_m_s2) if imu.mag_ut is None else imu.mag_ut * _GAUSS_PER_UT
    has_mag = imu.mag_ut is not None
    for time_ns, accel, gyro, field in zip(
        _times_ns(imu.time_s, start_ns),
        imu.accel_m_s2.tolist(),
        imu.gyro_rad_s.tolist(),
        mag.tolist(),
        strict=True,
    ):
        if not all(map(math.isfinite, (*accel, *gyro))):
            continue
        measured = has_mag and all(map(math.isfinite, field))
        updated = _ACCEL_GYRO | (_MAG if measured else 0)
        values = (*accel, *gyro, *(field if measured else (0.0, 0.0, 0.0)))
        message = dialect.MAVLink_highres_imu_message(time_ns // _US, *values, 0.0, 0.0, 0.0, 0.0, updated, 0)
        yield time_ns, sender.pack(message)


def _pressure(series: PressureSeries, start_ns: int) -> Frames:
    sender = _Sender("body")
    return _timed(sender, _pressure_frames(sender, series, start_ns), start_ns)


def _pressure_frames(sender: _Sender, series: PressureSeries, start_ns: int) -> Frames:
    """SCALED_PRESSURE counts milliseconds since the boot."""
    times_ns = _times_ns(series.time_s, start_ns)
    for time_ns, pressure_pa in zip(times_ns, series.pressure_pa.tolist(), strict=True):
        if math.isfinite(pressure_pa):
            boot_ms = (time_ns - start_ns) // _MS
            message = dialect.MAVLink_scaled_pressure_message(boot_ms, pressure_pa / 100.0, 0.0, 2000)
            yield time_ns, sender.pack(message)


def _gnss(series: GnssSeries, start_ns: int) -> Frames:
    sender = _Sender("gnss")
    return _timed(sender, _gnss_frames(sender, series, start_ns), start_ns)


def _gnss_frames(sender: _Sender, series: GnssSeries, start_ns: int) -> Frames:
    rows = zip(
        *(getattr(series, name).tolist() for name in ("lat_deg", "lon_deg", "alt_m", "h_acc_m", "v_acc_m")),
        *(getattr(series, name).tolist() for name in ("satellites", "speed_m_s", "course_deg")),
        strict=True,
    )
    for time_ns, row in zip(_times_ns(series.time_s, start_ns), rows, strict=True):
        yield time_ns, sender.pack(_gps_raw(time_ns, *row))


def _gps_raw(
    time_ns: int,
    lat_deg: float,
    lon_deg: float,
    alt_m: float,
    h_acc_m: float,
    v_acc_m: float,
    satellites: float,
    speed_m_s: float,
    course_deg: float,
) -> Any:
    """GPS_RAW_INT: it alone tells the height above the ellipsoid."""
    placed = math.isfinite(lat_deg) and math.isfinite(lon_deg)
    kind = _GPS_NONE if not placed else _GPS_2D if not math.isfinite(alt_m) else _GPS_3D
    height_mm = _scaled(alt_m, 1e3, 0)
    return dialect.MAVLink_gps_raw_int_message(
        time_usec=time_ns // _US,
        fix_type=kind,
        lat=_scaled(lat_deg, 1e7, 0),
        lon=_scaled(lon_deg, 1e7, 0),
        alt=height_mm,
        eph=65535,
        epv=65535,
        vel=_scaled(speed_m_s, 1e2, 65535),
        cog=_scaled(course_deg % 360.0 if math.isfinite(course_deg) else course_deg, 1e2, 65535),
        satellites_visible=_scaled(satellites, 1.0, 255),
        alt_ellipsoid=height_mm,
        h_acc=_scaled(h_acc_m, 1e3, 0),
        v_acc=_scaled(v_acc_m, 1e3, 0),
    )


def _scaled(value: float, unit: float, unknown: int) -> int:
    return round(value * unit) if math.isfinite(value) else unknown


def _camera(series: CameraSeries, start_ns: int) -> Frames:
    sender = _Sender("camera")
    return _timed(sender, _camera_frames(sender, series, start_ns), start_ns)


def _camera_frames(sender: _Sender, series: CameraSeries, start_ns: int) -> Frames:
    """Axes forward, right, down; the translation in those at the motion's end, as VISION_POSITION_DELTA has it."""
    begins = _times_ns(series.start_time_s, start_ns)
    for row, time_ns in enumerate(_times_ns(series.time_s, start_ns)):
        moved, turned = series.translation_m[row], series.rotation_rad[row]
        if not (np.isfinite(moved).all() and np.isfinite(turned).all()):
            continue
        at_end = Rotation.from_rotvec(turned).inv().apply(moved)
        flip = np.array([1.0, -1.0, -1.0])
        message = dialect.MAVLink_vision_position_delta_message(
            time_ns // _US,
            (time_ns - begins[row]) // _US,
            (turned * flip).tolist(),
            (at_end * flip).tolist(),
            100.0,
        )
        yield time_ns, sender.pack(message)
