"""msindoor20: hand-held phones in shopping malls (indoor location competition 2020), surveyed way-points, MIT.

Tab-separated lines: Unix ms, type, values. Read are the accelerometer (m/s²), the gyroscope (rad/s) and the
magnetic field (µT) as Android gives them, each on its own stamps, and the way-points (m in the map of the floor, y
up on the map; where north is, nobody tells). The phones were held flat, top ahead; axes are turned to forward,
left, up. Android's own attitude (ROTATION_VECTOR) is left alone.
"""

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FloatArray, Run, Truth
from sensor_gateway.recordings.tables import imu_series, phone_ahead, resampled

SOURCE = "indoor-location-competition-20, MIT"
_MS_PER_S = 1e3
_ACCEL, _GYRO, _MAG, _POINT = (
    "TYPE_ACCELEROMETER",
    "TYPE_GYROSCOPE",
    "TYPE_MAGNETIC_FIELD",
    "TYPE_WAYPOINT",
)
_COLUMNS = {_ACCEL: 3, _GYRO: 3, _MAG: 3, _POINT: 2}
_HEAD_BYTES = 4096
_LEAST_ROWS = 2


def recognises(path: Path) -> bool:
    """A text whose first lines are notes (``#``) and readings ``ms <tab> TYPE_... <tab> values``."""
    with path.open("rb") as file:
        lines = file.read(_HEAD_BYTES).split(b"\n")[:-1]
    readings = [line for line in lines if not line.startswith(b"#")]
    return bool(readings) and all(line.split(b"\t")[1:2] and b"\tTYPE_" in line for line in readings)


def recognises_notes(path: Path) -> bool:
    """The companion with the size of a floor's map."""
    if path.suffix != ".json":
        return False
    try:
        return "map_info" in json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, TypeError):
        return False


def read(path: Path) -> list[Run]:
    """One walk; the truth is its way-points."""
    tables = _tables(path)
    for kind in (_ACCEL, _GYRO):
        if len(tables[kind]) < _LEAST_ROWS:
            raise RecordingError(f"{path}: has fewer than {_LEAST_ROWS} lines {kind}")
    accel, zero_s = tables[_ACCEL], tables[_ACCEL][0, 0]
    mag = tables[_MAG] if len(tables[_MAG]) >= _LEAST_ROWS else None
    imu = imu_series(
        path,
        accel[:, 0] - zero_s,
        phone_ahead(accel[:, 1:]),
        phone_ahead(resampled(accel[:, 0], tables[_GYRO])),
        None if mag is None else phone_ahead(resampled(accel[:, 0], mag)),
    )
    points = tables[_POINT]
    return [Run.worn(path, imu, SOURCE, _truth(path, points, zero_s) if len(points) else None)]


def _truth(path: Path, points: FloatArray, zero_s: float) -> Truth:
    if not (np.diff(points[:, 0]) > 0.0).all():
        raise RecordingError(f"{path}: the times of its way-points must rise")
    return Truth(points[:, 0] - zero_s, np.column_stack([points[:, 1:], np.full(len(points), np.nan)]))


def _tables(path: Path) -> dict[str, FloatArray]:
    """By type, rows of (s, values)."""
    rows: dict[str, list[list[float]]] = defaultdict(list)
    for kind, row in _readings(path):
        rows[kind].append(row)
    return {
        kind: np.array(rows[kind], dtype=np.float64).reshape(-1, 1 + count)
        for kind, count in _COLUMNS.items()
    }


def _readings(path: Path) -> Iterator[tuple[str, list[float]]]:
    """The lines that are wanted; RecordingError names the line that is damaged."""
    try:
        with path.open(encoding="utf-8") as file:
            for number, line in enumerate(file, start=1):
                cells = line.split("\t")
                if line.startswith("#") or len(cells) < 2 or cells[1] not in _COLUMNS:
                    continue
                yield cells[1], _numbers(f"{path}: line {number}", cells)
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error


def _numbers(where: str, cells: list[str]) -> list[float]:
    wanted = _COLUMNS[cells[1]]
    if len(cells) < 2 + wanted:
        raise RecordingError(f"{where}: {cells[1]} has {len(cells) - 2} values, want {wanted}")
    try:
        return [float(cells[0]) / _MS_PER_S, *map(float, cells[2 : 2 + wanted])]
    except ValueError as error:
        raise RecordingError(f"{where}: {error}") from None
