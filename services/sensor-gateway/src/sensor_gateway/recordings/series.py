"""The series of a recording's sensors, whole or piece by piece, and which of their rows can be used."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bootprint.messages import Int64Array
from sensor_gateway.recordings.run import (
    CameraSeries,
    FloatArray,
    GnssSeries,
    ImuSeries,
    PressureSeries,
    RangeSeries,
    Run,
)

Series = ImuSeries | PressureSeries | GnssSeries | CameraSeries | RangeSeries
AnySeries = TypeVar("AnySeries", bound=Series)


def one_piece(series: AnySeries | None) -> Iterator[AnySeries]:
    """A whole series, if there is one."""
    return iter(() if series is None else (series,))


@dataclass(frozen=True, slots=True)
class Pieces:
    """Every sensor of a run as pieces that follow one another; they can be gone through once.

    An inertial unit has a magnetic field in all of its pieces or in none. Ranges, which need no order, are whole.
    """

    imus: dict[str, Iterator[ImuSeries]]
    pressure: Iterator[PressureSeries]
    gnss: Iterator[GnssSeries]
    camera: Iterator[CameraSeries]
    ranges: Iterator[RangeSeries]

    @classmethod
    def of(cls, run: Run) -> "Pieces":
        """A run in memory: one piece a sensor."""
        return cls(
            imus={place: iter([imu]) for place, imu in run.imus.items()},
            pressure=one_piece(run.pressure),
            gnss=one_piece(run.gnss),
            camera=one_piece(run.camera),
            ranges=one_piece(run.ranges),
        )


def usable_rows(time_s: FloatArray, *columns: FloatArray, after_s: float = -np.inf) -> Int64Array:
    """The indices of the samples that are finite in every column and later than all before them and ``after_s``."""
    finite = np.isfinite(time_s)
    for column in columns:
        finite &= np.isfinite(column).all(axis=tuple(range(1, column.ndim)))
    candidates = np.flatnonzero(finite)
    times = np.concatenate([[after_s], time_s[candidates]])
    return np.asarray(candidates[times[1:] > np.maximum.accumulate(times)[:-1]], dtype=np.int64)
