"""A run folder read piece by piece while it is played: memory does not grow with the length of the run.

What is wrong with the folder is said when it is opened: every table is read through once, and nothing of it kept.
Only ranges are held whole, some kilobytes a minute, for they need not stand in order.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import structlog

from bootprint.errors import RecordingError
from sensor_gateway.recordings.range_table import read_ranges
from sensor_gateway.recordings.run import ImuSeries
from sensor_gateway.recordings.run_folder import (
    PLACES,
    RANGES,
    camera_of,
    gnss_of,
    pressure_of,
    raw_imu_of,
    read_pieces,
    sensors_of,
)
from sensor_gateway.recordings.series import Pieces, Series, one_piece, usable_rows
from sensor_gateway.recordings.tables import Table

_READERS: dict[str, Callable[[Table], Series]] = {
    "pressure": pressure_of,
    "gnss": gnss_of,
    "camera_motion": camera_of,
}


@dataclass(slots=True)
class _Survey:
    """What is known of an inertial unit once its table has been read through."""

    samples: int = 0
    usable: int = 0
    has_field: bool = True  # a magnetic field with every usable sample

    def take(self, imu: ImuSeries, newest_s: float) -> float:
        """Count a piece; the newest time so far."""
        rows = usable_rows(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s, after_s=newest_s)
        self.samples += len(imu.time_s)
        self.usable += len(rows)
        self.has_field &= imu.mag_ut is not None and bool(np.isfinite(imu.mag_ut[rows]).all())
        return float(imu.time_s[rows[-1]]) if len(rows) else newest_s


class FolderStream:
    """The sensors of a run folder; RecordingError or ConfigError on anything wrong in it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._sensors = sensors_of(folder)
        self._surveys = {place: _survey(folder, place) for place in PLACES if place in self._sensors}
        for name in self._sensors:
            if name in _READERS:
                for piece in read_pieces(folder, name):
                    _READERS[name](piece)
        self._ranges = read_ranges(folder / f"{RANGES}.csv") if RANGES in self._sensors else None

    def pieces(self) -> Pieces:
        """Every sensor from its beginning."""
        return Pieces(
            imus={place: self._imu(place) for place in self._surveys},
            pressure=map(pressure_of, self._read("pressure")),
            gnss=map(gnss_of, self._read("gnss")),
            camera=map(camera_of, self._read("camera_motion")),
            ranges=one_piece(self._ranges),
        )

    def _read(self, name: str) -> Iterator[Table]:
        return read_pieces(self._folder, name) if name in self._sensors else iter(())

    def _imu(self, place: str) -> Iterator[ImuSeries]:
        series = map(raw_imu_of, read_pieces(self._folder, place))
        return series if self._surveys[place].has_field else map(partial(replace, mag_ut=None), series)


def _survey(folder: Path, place: str) -> _Survey:
    survey, newest_s = _Survey(), -np.inf
    for piece in read_pieces(folder, place):
        newest_s = survey.take(raw_imu_of(piece), newest_s)
    path = folder / f"{place}.csv"
    if survey.usable < survey.samples:
        structlog.get_logger().warning(
            "recording.samples_dropped",
            path=str(path),
            samples=survey.samples - survey.usable,
            of=survey.samples,
        )
    if survey.usable < 2:
        raise RecordingError(f"{path}: has fewer than two usable inertial samples")
    return survey
