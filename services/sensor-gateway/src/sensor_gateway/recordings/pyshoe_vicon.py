"""pyshoe-vicon: shoe IMU with motion capture (University of Toronto), one MATLAB file a trial, MIT licence.

``imu`` (N, 6) m/s² and rad/s in the sensor's axes, ``ts`` (1, N) s, ``gt`` (N, 3) m. The truth is left-handed
(z up, one horizontal axis mirrored): its y is negated here. The authors' detector labels are not read.
"""

from pathlib import Path

import numpy as np

from sensor_gateway.recordings.run import Run, Truth
from sensor_gateway.recordings.tables import imu_series, matlab_names, peek_header, read_matlab

SOURCE = "pyshoe Vicon trials (Wagstaff, Peretroukhin, Kelly; University of Toronto), MIT"
_TO_RIGHT_HANDED = np.array([1.0, -1.0, 1.0])
_NOTES_HEADER = ("file", "n", "duration_s")


def recognises(path: Path) -> bool:
    """A MATLAB file with imu, ts and gt."""
    return {"imu", "ts", "gt"} <= matlab_names(path)


def recognises_notes(path: Path) -> bool:
    """The table of trials that lies beside them; it makes no run."""
    return any(row[:3] == _NOTES_HEADER for row in peek_header(path))


def read(path: Path) -> list[Run]:
    """One trial, the sensor on the right shoe."""
    content = read_matlab(path, {"imu": 6, "ts": 1, "gt": 3})
    imu, time_s = content["imu"], content["ts"]
    return [
        Run(
            name=path.stem,
            kind="foot",
            path=path,
            imus={"right_foot": imu_series(path, time_s, imu[:, :3], imu[:, 3:])},
            truth={"right_foot": Truth(time_s, content["gt"] * _TO_RIGHT_HANDED)},
            source=SOURCE,
        )
    ]
