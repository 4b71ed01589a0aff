"""foot-gcp: corridor walks with every footprint surveyed (M. Hakoroglu), MIT licence.

``*_LLIO.mat`` is the walk: ``imu_data`` (N, 6) m/s² and rad/s, ``timestamps`` (1, N) s, ``strideIndex`` (1, S) last
sample of each stance, ``GCP_wcf`` (S, 2) surveyed m, right-handed; floors are flat, so every stance has height 0.
Beside it may lie the logger's CSV, which adds the magnetometer when it holds the very same samples, and a MATLAB
file of survey notes.
"""

from pathlib import Path

import numpy as np

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FloatArray, ImuSeries, Run, Truth
from sensor_gateway.recordings.tables import (
    STANDARD_GRAVITY_M_S2,
    UT_PER_GAUSS,
    Table,
    imu_series,
    matlab_names,
    peek_header,
    read_matlab,
    read_table,
)

SOURCE = "gait-driven inertial navigation dataset (M. Hakoroglu), MIT"
_WALK = {"imu_data", "timestamps", "strideIndex", "GCP_wcf"}
_NOTES = {"GCP_meters", "GCP_stride_numbers"}
_SAME_TIME_S = 1e-6
_SAME_RATE_RAD_S = 1e-6
_AXES = ("X", "Y", "Z")


def recognises(path: Path) -> bool:
    """The walk itself."""
    return matlab_names(path) >= _WALK


def recognises_notes(path: Path) -> bool:
    """Survey notes, which make no run."""
    names = matlab_names(path)
    return names >= _NOTES and not names >= _WALK


def recognises_logger(path: Path) -> bool:
    """The logger's CSV: ``Time`` and columns such as ``inertial-6253.76535:scaledAccelX``."""
    header = peek_header(path)
    return bool(header) and header[0][0] == "Time" and any(_channel(name) in _ACCELS for name in header[0])


def read(path: Path) -> list[Run]:
    """One walk; the side of the foot is not told, so it is called the right one."""
    content = read_matlab(path, {"imu_data": 6, "timestamps": 1, "strideIndex": 1, "GCP_wcf": 2})
    imu, time_s = content["imu_data"], content["timestamps"]
    mag = _companion_mag(path, time_s, imu[:, 3:])
    return [
        Run(
            name=path.stem,
            kind="foot",
            path=path,
            imus={"right_foot": imu_series(path, time_s, imu[:, :3], imu[:, 3:], mag)},
            truth={"right_foot": _survey(path, time_s, content["strideIndex"], content["GCP_wcf"])},
            source=SOURCE,
        )
    ]


def read_logger(path: Path) -> list[Run]:
    """A logger's CSV on its own is a walk without truth; beside its walk it makes no run."""
    if path.with_name(f"{path.stem}_LLIO.mat").exists():
        return []
    return [Run(name=path.stem, kind="foot", path=path, imus={"right_foot": _logged(path)}, source=SOURCE)]


def _survey(path: Path, time_s: FloatArray, stride_index: FloatArray, surveyed_m: FloatArray) -> Truth:
    index = stride_index.astype(np.int64)
    if len(index) != len(surveyed_m) or index.min() < 0 or index.max() >= len(time_s):
        raise RecordingError(f"{path}: strideIndex does not fit GCP_wcf and timestamps")
    position = np.column_stack([surveyed_m, np.zeros(len(surveyed_m))])
    return Truth(time_s[index], position, strides=len(index) - 1)


def _companion_mag(path: Path, time_s: FloatArray, gyro_rad_s: FloatArray) -> FloatArray | None:
    """The magnetometer of the CSV beside the walk, if that holds the same samples."""
    companion = path.with_name(f"{path.stem.removesuffix('_LLIO')}.csv")
    if not companion.is_file() or not recognises_logger(companion):
        return None
    logged = _logged(companion)
    same = (
        logged.mag_ut is not None
        and logged.time_s.shape == time_s.shape
        and np.allclose(logged.time_s, time_s, rtol=0.0, atol=_SAME_TIME_S)
        and np.allclose(logged.gyro_rad_s, gyro_rad_s, rtol=0.0, atol=_SAME_RATE_RAD_S)
    )
    return logged.mag_ut if same else None


_ACCELS = {"scaledAccelX": STANDARD_GRAVITY_M_S2, "estCompensatedAccelX": 1.0}


def _channel(column: str) -> str:
    return column.rpartition(":")[2]


def _logged(path: Path) -> ImuSeries:
    """The logger's samples: scaled (g, rad/s, gauss) or estimated (m/s², rad/s) channels."""
    table = _short_names(read_table(path))
    scaled = "scaledAccelX" in table.header[-1]
    accel, gyro = ("scaledAccel", "scaledGyro") if scaled else ("estCompensatedAccel", "estAngularRate")
    unit = _ACCELS[f"{accel}X"]
    mag = table.columns(*(f"scaledMag{axis}" for axis in _AXES)) * UT_PER_GAUSS if scaled else None
    return imu_series(
        path,
        table.column("Time"),
        table.columns(*(accel + axis for axis in _AXES)) * unit,
        table.columns(*(gyro + axis for axis in _AXES)),
        mag,
    )


def _short_names(table: Table) -> Table:
    """Columns without the logger's serial number; ``...:valid`` columns keep out of the way."""
    return Table(table.path, (tuple(_channel(name) for name in table.header[-1]),), table.values)
