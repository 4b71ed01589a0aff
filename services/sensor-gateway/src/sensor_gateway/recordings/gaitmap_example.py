"""gaitmap-example: both feet, some walks with motion capture (MaD Lab, FAU), CSV in m/s² and deg/s, MIT licence.

``imu_X.csv`` has two header rows (sensor, axis) and a first column of sample numbers or of seconds;
``mocap_X.csv`` beside it has the markers of the same walk in mm at 100 Hz from the same zero, right-handed, z up.
The heel marker is the truth; it is not where the sensor sits, so truth and sensor are compared at stances.
"""

from pathlib import Path

import numpy as np

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FloatArray, ImuSeries, Run, Truth
from sensor_gateway.recordings.tables import Table, imu_series, peek_header, read_table

SOURCE = "gaitmap example data (MaD Lab, FAU Erlangen-Nürnberg), MIT"
MOCAP_HZ = 100.0
_SENSORS = {"left_foot": "left_sensor", "right_foot": "right_sensor"}
_HEELS = {"left_foot": "L_FCC", "right_foot": "R_FCC"}
# The files do not hold their rate; all were sampled at 204.8 Hz but this one.
_RATE_HZ, _OTHER_RATES_HZ = 204.8, {"imu_sample_ic_stride": 102.4}
# Motion capture and sensors of one walk run equally long, to this.
_SAME_DURATION_S = 0.5


def recognises(path: Path) -> bool:
    """A CSV with both sensors in its first header row and axes in its second."""
    header = peek_header(path, rows=2)
    return (
        len(header) == 2 and set(_SENSORS.values()) <= set(header[0]) and {"acc_x", "gyr_z"} <= set(header[1])
    )


def recognises_mocap(path: Path) -> bool:
    """A CSV of markers; it makes no run of its own."""
    header = peek_header(path)
    return bool(header) and set(_HEELS.values()) <= set(header[0])


def recognises_folder(folder: Path) -> bool:
    """A folder with a walk and its motion capture: one run, whatever else lies there."""
    return _paired_walk(folder) is not None


def read(path: Path) -> list[Run]:
    """One walk of both feet, with truth if its motion capture lies beside it."""
    return [_run(path, name=path.stem)]


def read_folder(folder: Path) -> list[Run]:
    """The one walk with motion capture in this folder."""
    path = _paired_walk(folder)
    if path is None:
        raise RecordingError(f"{folder}: has no walk with motion capture")
    return [_run(path, name=folder.resolve().name)]


def _paired_walk(folder: Path) -> Path | None:
    for path in sorted(folder.glob("*.csv")):
        if _mocap_of(path) is not None and recognises(path):
            return path
    return None


def _mocap_of(path: Path) -> Path | None:
    mocap = path.with_name(path.name.replace("imu_", "mocap_", 1))
    return mocap if mocap != path and mocap.is_file() and recognises_mocap(mocap) else None


def _run(path: Path, name: str) -> Run:
    table = read_table(path, header_rows=2)
    time_s = _times(table)
    mocap = _mocap_of(path)
    return Run(
        name=name,
        kind="dual",
        path=path,
        imus={place: _imu(table, time_s, sensor) for place, sensor in _SENSORS.items()},
        truth={} if mocap is None else _truth(mocap, duration_s=float(time_s[-1])),
        source=SOURCE,
    )


def _times(table: Table) -> FloatArray:
    """Seconds; a first column that counts samples (0, 1, 2, ...) is divided by the rate."""
    first = table.values[:, 0]
    if np.array_equal(first, np.arange(len(first))):
        return np.asarray(first / _OTHER_RATES_HZ.get(table.path.stem, _RATE_HZ))
    return first


def _pick(table: Table, group: str, names: tuple[str, ...]) -> FloatArray:
    """Columns by both header rows, (n, len(names))."""
    keys = list(zip(*table.header, strict=True))
    try:
        return table.values[:, [keys.index((group, name)) for name in names]]
    except ValueError:
        raise RecordingError(f"{table.path}: {group} lacks one of {', '.join(names)}") from None


def _imu(table: Table, time_s: FloatArray, sensor: str) -> ImuSeries:
    accel = _pick(table, sensor, ("acc_x", "acc_y", "acc_z"))
    gyro = np.deg2rad(_pick(table, sensor, ("gyr_x", "gyr_y", "gyr_z")))
    return imu_series(table.path, time_s, accel, gyro)


def _truth(path: Path, duration_s: float) -> dict[str, Truth]:
    table = read_table(path, header_rows=2)
    time_s = table.values[:, 0] / MOCAP_HZ
    if abs(time_s[-1] - duration_s) > _SAME_DURATION_S:
        raise RecordingError(f"{path}: lasts {time_s[-1]:.1f} s but the sensors beside it {duration_s:.1f} s")
    metres = {place: _pick(table, heel, ("x", "y", "z")) / 1000.0 for place, heel in _HEELS.items()}
    return {place: Truth(time_s, track, at_stances=True) for place, track in metres.items()}
