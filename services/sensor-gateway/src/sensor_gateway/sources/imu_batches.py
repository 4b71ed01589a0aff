"""Pieces of an inertial unit's series as the batches that a live unit would have sent."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bootprint.messages import ImuBatch, Int64Array
from sensor_gateway.batching import batch_bounds
from sensor_gateway.recordings.run import FloatArray, ImuSeries
from sensor_gateway.recordings.series import usable_rows


def imu_batches(pieces: Iterator[ImuSeries], start_ns: int, size: int, max_age_ns: int) -> Iterator[ImuBatch]:
    """Batches of ``size`` samples that span ``max_age_ns`` at most; where pieces meet, batches go on."""
    sequence, waiting, newest_s = 0, None, -math.inf
    for imu in pieces:
        rows = usable_rows(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s, after_s=newest_s)
        if not len(rows):
            continue
        newest_s = float(imu.time_s[rows[-1]])
        fresh = _Samples.of(imu, rows, start_ns)
        samples = fresh if waiting is None else waiting.then(fresh)
        waiting = None
        for first, end in batch_bounds(samples.times, size, max_age_ns):
            if end == len(samples.times) and end - first < size:
                waiting = samples.between(first, end)
            else:
                yield samples.between(first, end).batch(sequence)
                sequence += 1
    if waiting is not None:
        yield waiting.batch(sequence)


def utc_ns(time_s: FloatArray, start_ns: int) -> Int64Array:
    """Times from the run's zero as UTC ns, (n,)."""
    return np.asarray(start_ns + np.round(time_s * 1e9).astype(np.int64), dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _Samples:
    """Usable samples: times UTC ns (n,), the rest (n, 3)."""

    times: Int64Array
    accel: FloatArray
    gyro: FloatArray
    mag: FloatArray | None

    @classmethod
    def of(cls, imu: ImuSeries, rows: Int64Array, start_ns: int) -> "_Samples":
        mag = None if imu.mag_ut is None else _chosen(imu.mag_ut, rows)
        times = utc_ns(imu.time_s[rows], start_ns)
        return cls(times, _chosen(imu.accel_m_s2, rows), _chosen(imu.gyro_rad_s, rows), mag)

    def between(self, first: int, end: int) -> "_Samples":
        mag = None if self.mag is None else self.mag[first:end]
        return _Samples(self.times[first:end], self.accel[first:end], self.gyro[first:end], mag)

    def then(self, other: "_Samples") -> "_Samples":
        return _Samples(
            np.concatenate([self.times, other.times]),
            np.concatenate([self.accel, other.accel]),
            np.concatenate([self.gyro, other.gyro]),
            None if self.mag is None or other.mag is None else np.concatenate([self.mag, other.mag]),
        )

    def batch(self, sequence: int) -> ImuBatch:
        """All of them as a message; with the field if every sample has one."""
        mag = None if self.mag is None or not np.isfinite(self.mag).all() else self.mag
        return ImuBatch.from_arrays(sequence, self.times, self.accel, self.gyro, mag)


def _chosen(values: FloatArray, rows: Int64Array) -> FloatArray:
    """These rows; no copy of a long recording if it is all of them, as it nearly always is."""
    return values if len(rows) == len(values) else values[rows]
