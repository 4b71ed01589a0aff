"""phyphox: the folder that the phone app exports: Accelerometer.csv, Gyroscope.csv, Magnetometer.csv, Location.csv.

Sensors run on stamps of their own; gyroscope and field are brought to those of the accelerometer, and the axes
turned to forward, left, up of a phone held flat, top ahead. The location's height is left unknown, since the table
does not say what it is above; a speed or direction of -1 is unknown.
"""

from pathlib import Path

import numpy as np

from sensor_gateway.recordings.run import FloatArray, GnssSeries, ImuSeries, Run
from sensor_gateway.recordings.tables import imu_series, peek_header, phone_ahead, read_table, resampled

SOURCE = "phyphox export"
_ACCEL, _GYRO, _MAG, _PLACE = (
    f"{name}.csv" for name in ("Accelerometer", "Gyroscope", "Magnetometer", "Location")
)
_UNITS = {_ACCEL: "m/s^2", _GYRO: "rad/s", _MAG: "µT"}
_TIME = "Time (s)"


def recognises_folder(folder: Path) -> bool:
    """A folder with the app's accelerometer and gyroscope tables."""
    return all(_looks_like(folder / name) for name in (_ACCEL, _GYRO))


def _looks_like(path: Path) -> bool:
    header = peek_header(path) if path.is_file() else ()
    return bool(header) and header[0][0] == _TIME


def read_folder(folder: Path) -> list[Run]:
    """The folder's one walk, without truth."""
    accel = _series(folder / _ACCEL)
    zero_s = float(accel[0, 0])
    fixes = _fixes(folder / _PLACE, zero_s) if (folder / _PLACE).exists() else None
    return [Run.worn(folder, _imu(folder, accel), SOURCE, gnss=fixes)]


def _imu(folder: Path, accel: FloatArray) -> ImuSeries:
    time_s = accel[:, 0]
    mag = resampled(time_s, _series(folder / _MAG)) if (folder / _MAG).exists() else None
    return imu_series(
        folder / _ACCEL,
        time_s - time_s[0],
        phone_ahead(accel[:, 1:]),
        phone_ahead(resampled(time_s, _series(folder / _GYRO))),
        None if mag is None else phone_ahead(mag),
    )


def _series(path: Path) -> FloatArray:
    """Rows of (s, x, y, z)."""
    return read_table(path).columns(_TIME, *(f"{axis} ({_UNITS[path.name]})" for axis in "XYZ"))


def _fixes(path: Path, zero_s: float) -> GnssSeries:
    table = read_table(path)
    unknown = np.full(len(table.values), np.nan)
    speed, course = (_known(table.column(name)) for name in ("Velocity (m/s)", "Direction (°)"))
    return GnssSeries(
        time_s=table.column(_TIME) - zero_s,
        lat_deg=table.column("Latitude (°)"),
        lon_deg=table.column("Longitude (°)"),
        alt_m=unknown,
        h_acc_m=table.column("Horizontal Accuracy (m)"),
        v_acc_m=unknown,
        satellites=unknown,
        speed_m_s=speed,
        course_deg=course,
    )


def _known(values: FloatArray) -> FloatArray:
    return np.where(values < 0.0, np.nan, values)
