"""dualfoot-fgo: both feet and their true positions (Hu & Hu, PLANS 2025), a folder of three CSV files, MIT licence.

Samples are counted at 60 Hz. The truth's z points down: (x, −y, −z) here. The authors' detector is not read.
"""

from pathlib import Path

import numpy as np

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FEET, ImuSeries, Run, Truth
from sensor_gateway.recordings.tables import Table, imu_series, peek_header, read_table

SOURCE = "Constrained-ZUPT-FGO (Hu & Hu, PLANS 2025), MIT"
RATE_HZ = 60.0
_IMU_COLUMNS = {"time_index", "acc_x", "gyro_z", "is_zero_vel"}
_TRUTH_COLUMNS = {"time_index", "pos_left_x", "pos_right_z"}
_TO_Z_UP = np.array([1.0, -1.0, -1.0])


def recognises_folder(folder: Path) -> bool:
    """A folder with the samples of both feet and their positions."""
    return len(_parts(folder)) == 3


def read_folder(folder: Path) -> list[Run]:
    """The folder's one run."""
    parts = _parts(folder)
    track = read_table(parts["truth"])
    return [
        Run(
            name=folder.resolve().name,
            kind="dual",
            path=folder,
            imus={place: _imu(parts[place]) for place in FEET},
            truth={place: _truth(track, place.removesuffix("_foot")) for place in FEET},
            source=SOURCE,
        )
    ]


def recognises_part(path: Path) -> bool:
    """One file of such a folder; alone it makes no run."""
    header = peek_header(path)
    return bool(header) and (set(header[0]) >= _IMU_COLUMNS or set(header[0]) >= _TRUTH_COLUMNS)


def _parts(folder: Path) -> dict[str, Path]:
    """The files by what they are: left_foot, right_foot, truth. Only the name tells left from right."""
    parts: dict[str, Path] = {}
    for path in sorted(folder.glob("*.csv")):
        header = peek_header(path)
        columns = set(header[0]) if header else set()
        if columns >= _TRUTH_COLUMNS:
            parts["truth"] = path
        elif columns >= _IMU_COLUMNS:
            parts["left_foot" if "left" in path.stem.lower() else "right_foot"] = path
    return parts


def _imu(path: Path) -> ImuSeries:
    table = read_table(path)
    accel = table.columns("acc_x", "acc_y", "acc_z")
    gyro = table.columns("gyro_x", "gyro_y", "gyro_z")
    return imu_series(path, table.column("time_index") / RATE_HZ, accel, gyro)


def _truth(table: Table, side: str) -> Truth:
    position = table.columns(*(f"pos_{side}_{axis}" for axis in "xyz")) * _TO_Z_UP
    if not np.isfinite(position).all():
        raise RecordingError(f"{table.path}: has positions that are not finite")
    return Truth(table.column("time_index") / RATE_HZ, position)
