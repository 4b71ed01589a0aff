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
    Int64Array,
    Message,
    Pressure,
    Range,
    Vector3,
    upper_triangle,
)
from bootprint.topics import Address, Identity
from sensor_gateway.recordings.run import (
    CameraSeries,
    FloatArray,
    GnssSeries,
    PressureSeries,
    RangeSeries,
    Run,
)
from sensor_gateway.recordings.series import AnySeries, Pieces, usable_rows
from sensor_gateway.sources.imu_batches import imu_batches, utc_ns
from sensor_gateway.stamps import due_ns

PRESSURE_SOURCE, GNSS_SOURCE, CAMERA_SOURCE, RANGE_SOURCE = "body", "gnss", "camera", "uwb"
BATCH_AGE_NS = 60_000_000
AnyMessage = TypeVar("AnyMessage", bound=Message)
_Rows = tuple[Int64Array, Callable[[int, int, int], AnyMessage]]
"""Which rows, and the message of a row, its time UTC ns and its sequence."""
_log = structlog.get_logger()


def run_messages(
    run: Run, identity: Identity, start_ns: int, batch: int = 10, max_age_ns: int = BATCH_AGE_NS
) -> Iterator[Envelope]:
    """All messages of a run whose time zero is ``start_ns`` (UTC), in the order in which they can be known.

    A batch is known with its last sample (`due_ns`); messages due at the same time come by subject and source.
    Samples that are not finite or do not advance in time are left out.
    """
    return sensor_messages(Pieces.of(run), identity, start_ns, batch, max_age_ns)


def sensor_messages(
    pieces: Pieces, identity: Identity, start_ns: int, batch: int = 10, max_age_ns: int = BATCH_AGE_NS
) -> Iterator[Envelope]:
    """The same of a run that comes in pieces; how it is cut makes no difference."""
    streams: list[tuple[str, str, Iterator[Message]]] = [
        ("imu", place, imu_batches(imu, start_ns, batch, max_age_ns))
        for place, imu in sorted(pieces.imus.items())
    ]
    streams += [
        ("pressure", PRESSURE_SOURCE, _by_row(pieces.pressure, _pressure, start_ns)),
        ("gnss", GNSS_SOURCE, _by_row(pieces.gnss, _gnss, start_ns)),
        ("camera_motion", CAMERA_SOURCE, _by_row(pieces.camera, partial(_camera, start_ns), start_ns)),
        ("range", RANGE_SOURCE, _by_row(pieces.ranges, _ranges, start_ns)),
    ]
    sent = [_sent(identity.address(subject, source), messages) for subject, source, messages in streams]
    return heapq.merge(*sent, key=lambda envelope: (due_ns(envelope.message), envelope.address))


def _sent(address: Address, messages: Iterator[Message]) -> Iterator[Envelope]:
    return (Envelope(address, message) for message in messages)


def _by_row(
    pieces: Iterator[AnySeries], chosen: Callable[[AnySeries, float], _Rows[AnyMessage]], start_ns: int
) -> Iterator[AnyMessage]:
    """A message a row (chosen of a piece, given the newest time before); one out of range is told and left out."""
    sequence, before, newest_s = 0, 0, -math.inf
    for series in pieces:
        rows, make = chosen(series, newest_s)
        for row, time_ns in zip(rows, utc_ns(series.time_s[rows], start_ns), strict=True):
            try:
                yield make(int(row), int(time_ns), sequence)
            except ValueError as error:
                _log.warning("recording.row_left_out", row=before + int(row), error=str(error))
            sequence += 1
        newest_s = float(series.time_s[rows[-1]]) if len(rows) else newest_s
        before += len(series.time_s)


def _pressure(series: PressureSeries, after_s: float) -> _Rows[Pressure]:
    def message(row: int, time_ns: int, sequence: int) -> Pressure:
        return Pressure(time_ns=time_ns, sequence=sequence, pressure_pa=float(series.pressure_pa[row]))

    return usable_rows(series.time_s, series.pressure_pa, after_s=after_s), message


def _gnss(series: GnssSeries, after_s: float) -> _Rows[GnssFix]:
    return usable_rows(series.time_s, after_s=after_s), partial(_fix, series)


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


def _camera(start_ns: int, series: CameraSeries, after_s: float) -> _Rows[CameraMotion]:
    motion = series.start_time_s, series.translation_m, series.rotation_rad
    starts_ns = utc_ns(np.nan_to_num(series.start_time_s), start_ns)

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

    return usable_rows(series.time_s, *motion, after_s=after_s), message


def _camera_covariance(series: CameraSeries, row: int) -> tuple[float, ...] | None:
    """Axes alike and independent; None where either sigma is unknown."""
    if series.translation_sigma_m is None or series.rotation_sigma_rad is None:
        return None
    sigmas = np.repeat([series.translation_sigma_m[row], series.rotation_sigma_rad[row]], 3)
    return upper_triangle(np.diag(sigmas**2)) if np.isfinite(sigmas).all() else None


def _ranges(series: RangeSeries, _after_s: float) -> _Rows[Range]:
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

    return np.asarray(rows, dtype=np.int64), message


def _vector(values: FloatArray) -> Vector3:
    x, y, z = (float(value) for value in values)
    return x, y, z
