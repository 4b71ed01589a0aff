"""xio-gait: a closed loop with one foot (xio Technologies Gait-Tracking), CSV in deg/s and g, MIT licence.

No truth is recorded but one: the walk ends where it starts, so the truth is two way-points at the same place.
About one row in a hundred is written twice, stamp and all; the second is dropped.
"""

from pathlib import Path

import numpy as np

from sensor_gateway.recordings.run import Run, Truth
from sensor_gateway.recordings.tables import STANDARD_GRAVITY_M_S2, Table, imu_series, peek_header, read_table

SOURCE = "xio Technologies Gait-Tracking, MIT"
_GYRO = tuple(f"Gyroscope {axis} (deg/s)" for axis in "XYZ")
_ACCEL = tuple(f"Accelerometer {axis} (g)" for axis in "XYZ")


def recognises(path: Path) -> bool:
    """A CSV with the logger's column names, units included."""
    header = peek_header(path)
    return bool(header) and {"Time (s)", *_GYRO, *_ACCEL} <= set(header[0])


def read(path: Path) -> list[Run]:
    """One loop; the side of the foot is not told, so it is called the right one."""
    table = _without_repeats(read_table(path))
    time_s = table.column("Time (s)")
    imu = imu_series(
        path, time_s, table.columns(*_ACCEL) * STANDARD_GRAVITY_M_S2, np.deg2rad(table.columns(*_GYRO))
    )
    closed = Truth(imu.time_s[[0, -1]], np.zeros((2, 3)))
    return [
        Run(
            name=path.stem,
            kind="foot",
            path=path,
            imus={"right_foot": imu},
            truth={"right_foot": closed},
            source=SOURCE,
        )
    ]


def _without_repeats(table: Table) -> Table:
    repeated = (np.diff(table.values, axis=0) == 0.0).all(axis=1)
    return Table(table.path, table.header, table.values[np.concatenate([[True], ~repeated])])
