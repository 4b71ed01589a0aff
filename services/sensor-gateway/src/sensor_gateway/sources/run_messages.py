"""A recorded `Run` as the messages that its sensors would have sent: pure, for replay and in-process use alike."""

import heapq
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

import numpy as np
import structlog

from bootprint.bus import Envelope
from bootprint.messages import (
    CameraMotion,
    FixKind,
    GnssFix,
    ImuBatch,
    Int64Array,
    Message,
    Pressure,
    Range,
    Vector3,
    upper_triangle,
)
from bootprint.topics import Identity
from sensor_gateway.batching import batch_bounds
from sensor_gateway.recordings.run import (
    CameraSeries,
    FloatArray,
    GnssSeries,
    ImuSeries,
    PressureSeries,
    RangeSeries,
    Run,
)
from sensor_gateway.stamps import due_ns

PRESSURE_SOURCE, GNSS_SOURCE, CAMERA_SOURCE, RANGE_SOURCE = "body", "gnss", "camera", "uwb"
BATCH_AGE_NS = 60_000_000
AnyMessage = TypeVar("AnyMessage", bound=Message)
_log = structlog.get_logger()


def run_messages(
    run: Run, identity: Identity, start_ns: int, batch: int = 10, max_age_ns: int = BATCH_AGE_NS
) -> Iterator[Envelope]:
    """All messages of a run whose time zero is ``start_ns`` (UTC), in the order in which they can be known.

    A batch is known with its last sample (`due_ns`); messages due at the same time come by subject and source.
    Samples that are not finite or do not advance in time are left out.
    """
    streams = [
        _sent(identity, "imu", place, _imu(imu, start_ns, batch, max_age_ns)) for place, imu in _imus(run)
    ]
    if run.pressure is not None:
        streams.append(_sent(identity, "pressure", PRESSURE_SOURCE, _pressure(run.pressure, start_ns)))
    if run.gnss is not None:
        streams.append(_sent(identity, "gnss", GNSS_SOURCE, _gnss(run.gnss, start_ns)))
    if run.camera is not None:
        streams.append(_sent(identity, "camera_motion", CAMERA_SOURCE, _camera(run.camera, start_ns)))
    if run.ranges is not None:
        streams.append(_sent(identity, "range", RANGE_SOURCE, _ranges(run.ranges, start_ns)))
    return heapq.merge(*streams, key=lambda envelope: (due_ns(envelope.message), envelope.address))


def _imus(run: Run) -> list[tuple[str, ImuSeries]]:
    return sorted(run.imus.items())


def _sent(identity: Identity, subject: str, source: str, messages: Iterator[Message]) -> Iterator[Envelope]:
    address = identity.address(subject, source)
    return (Envelope(address, message) for message in messages)


def _utc_ns(time_s: FloatArray, start_ns: int) -> Int64Array:
    """Times from the run's zero as UTC ns, (n,)."""
    return np.asarray(start_ns + np.round(time_s * 1e9).astype(np.int64), dtype=np.int64)


def _usable(time_s: FloatArray, *columns: FloatArray) -> Int64Array:
    """The indices of the samples that are finite in every column and later than all before them."""
    finite = np.isfinite(time_s)
    for column in columns:
        finite &= np.isfinite(column.reshape(len(time_s), -1)).all(axis=1)
    candidates = np.flatnonzero(finite)
    times = time_s[candidates]
    before = np.concatenate([[-np.inf], np.maximum.accumulate(times)[:-1]]) if len(times) else times
    return np.asarray(candidates[times > before], dtype=np.int64)


def _chosen(values: FloatArray, rows: Int64Array) -> FloatArray:
    """These rows; no copy of a long recording if it is all of them, as it nearly always is."""
    return values if len(rows) == len(values) else values[rows]


def _imu(imu: ImuSeries, start_ns: int, size: int, max_age_ns: int) -> Iterator[ImuBatch]:
    rows = _usable(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s)
    times = _utc_ns(imu.time_s[rows], start_ns)
    accel, gyro = _chosen(imu.accel_m_s2, rows), _chosen(imu.gyro_rad_s, rows)
    mag = None if imu.mag_ut is None else _chosen(imu.mag_ut, rows)
    for sequence, (first, end) in enumerate(batch_bounds(times, size, max_age_ns)):
        field = None if mag is None or not np.isfinite(mag[first:end]).all() else mag[first:end]
        yield ImuBatch.from_arrays(sequence, times[first:end], accel[first:end], gyro[first:end], field)


def _pressure(series: PressureSeries, start_ns: int) -> Iterator[Pressure]:
    rows = _usable(series.time_s, series.pressure_pa)

    def message(row: int, time_ns: int, sequence: int) -> Pressure:
        return Pressure(time_ns=time_ns, sequence=sequence, pressure_pa=float(series.pressure_pa[row]))

    return _rows(message, rows, _utc_ns(series.time_s[rows], start_ns))


def _gnss(series: GnssSeries, start_ns: int) -> Iterator[GnssFix]:
    rows = _usable(series.time_s)
    return _rows(partial(_fix, series), rows, _utc_ns(series.time_s[rows], start_ns))


def _rows(
    make: Callable[[int, int, int], AnyMessage], rows: Int64Array, times_ns: Int64Array
) -> Iterator[AnyMessage]:
    """A message a row; a row whose values are out of range is told and left out."""
    for sequence, (row, time_ns) in enumerate(zip(rows, times_ns, strict=True)):
        try:
            yield make(int(row), int(time_ns), sequence)
        except ValueError as error:
            _log.warning("recording.row_left_out", row=int(row), error=str(error))


def _fix(series: GnssSeries, row: int, time_ns: int, sequence: int) -> GnssFix:
    latitude, longitude = _known(series.lat_deg[row]), _known(series.lon_deg[row])
    height, course_deg = _known(series.alt_m[row]), _known(series.course_deg[row])
    satellites = _known(series.satellites[row])
    placed: FixKind = "2d" if height is None else "3d"
    return GnssFix(
        time_ns=time_ns,
        sequence=sequence,
        fix_kind="none" if latitude is None or longitude is None else placed,
        latitude_deg=latitude,
        longitude_deg=longitude,
        height_m=height,
        horizontal_accuracy_m=_known(series.h_acc_m[row]),
        vertical_accuracy_m=_known(series.v_acc_m[row]),
        satellites=None if satellites is None else int(satellites),
        speed_m_s=_known(series.speed_m_s[row]),
        course_rad=None if course_deg is None else math.radians(course_deg) % math.tau,
    )


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _camera(series: CameraSeries, start_ns: int) -> Iterator[CameraMotion]:
    rows = _usable(series.time_s, series.start_time_s, series.translation_m, series.rotation_rad)
    starts_ns = _utc_ns(np.nan_to_num(series.start_time_s), start_ns)

    def message(row: int, time_ns: int, sequence: int) -> CameraMotion:
        return CameraMotion(
            time_ns=time_ns,
            sequence=sequence,
            start_time_ns=int(starts_ns[row]),
            translation_m=_vector(series.translation_m[row]),
            rotation_rad=_vector(series.rotation_rad[row]),
            covariance=_camera_covariance(series, row),
            confidence_pct=None if series.confidence_pct is None else _known(series.confidence_pct[row]),
        )

    return _rows(message, rows, _utc_ns(series.time_s[rows], start_ns))


def _camera_covariance(series: CameraSeries, row: int) -> tuple[float, ...] | None:
    """Axes alike and independent; None where either sigma is unknown."""
    if series.translation_sigma_m is None or series.rotation_sigma_rad is None:
        return None
    sigmas = np.repeat([series.translation_sigma_m[row], series.rotation_sigma_rad[row]], 3)
    return upper_triangle(np.diag(sigmas**2)) if np.isfinite(sigmas).all() else None


def _ranges(series: RangeSeries, start_ns: int) -> Iterator[Range]:
    """Every range of every peer: two peers may answer at the same time, so stamps need not rise."""
    rows = np.flatnonzero(np.isfinite(series.time_s) & np.isfinite(series.distance_m))
    rows = rows[np.argsort(series.time_s[rows], kind="stable")]

    def message(row: int, time_ns: int, sequence: int) -> Range:
        return Range(
            time_ns=time_ns,
            sequence=sequence,
            peer=series.peer[row],
            distance_m=float(series.distance_m[row]),
            sigma_m=_known(series.sigma_m[row]),
        )

    return _rows(message, np.asarray(rows, dtype=np.int64), _utc_ns(series.time_s[rows], start_ns))


def _vector(values: FloatArray) -> Vector3:
    x, y, z = (float(value) for value in values)
    return x, y, z
