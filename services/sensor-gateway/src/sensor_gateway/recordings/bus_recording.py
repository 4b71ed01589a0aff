"""Recordings of the bus (MCAP): the sensor messages of each soldier become a run, without truth."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bootprint.errors import RecordingError
from bootprint.messages import CameraMotion, GnssFix, ImuBatch, Message, Pressure, Range, symmetric
from sensor_gateway.recordings.run import (
    CameraSeries,
    FloatArray,
    GnssSeries,
    ImuSeries,
    Kind,
    PressureSeries,
    RangeSeries,
    Run,
)
from sensor_gateway.recordings.tables import imu_series

MAGIC = b"\x89MCAP0\r\n"
NS_PER_S = 1e9
_PLACES = ("left_foot", "right_foot", "body")


@dataclass(slots=True)
class _Heard:
    """What one soldier's sensors said."""

    imu: dict[str, list[ImuBatch]] = field(default_factory=lambda: defaultdict(list))
    pressure: list[Pressure] = field(default_factory=list)
    gnss: list[GnssFix] = field(default_factory=list)
    camera: list[CameraMotion] = field(default_factory=list)
    ranges: list[Range] = field(default_factory=list)

    def take(self, source: str, message: Message) -> None:
        """Keep a sensor message, pass over all others."""
        if isinstance(message, ImuBatch) and source in _PLACES:
            self.imu[source].append(message)
        elif isinstance(message, Pressure):
            self.pressure.append(message)
        elif isinstance(message, GnssFix):
            self.gnss.append(message)
        elif isinstance(message, CameraMotion):
            self.camera.append(message)
        elif isinstance(message, Range):
            self.ranges.append(message)


def recognises(path: Path) -> bool:
    """A file with MCAP's magic bytes."""
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def read(path: Path) -> list[Run]:
    """A run for each soldier whose inertial units were recorded; RecordingError if there is none."""
    from bootprint.recording import read_envelopes

    soldiers: dict[str, _Heard] = defaultdict(_Heard)
    for _, envelope in read_envelopes(path):
        soldiers[envelope.address.soldier].take(envelope.address.source, envelope.message)
    heard = {soldier: found for soldier, found in sorted(soldiers.items()) if found.imu}
    if not heard:
        raise RecordingError(f"{path}: holds no inertial samples of any soldier (subject imu)")
    return [
        _run(path, path.stem if len(heard) == 1 else f"{path.stem}-{soldier}", found)
        for soldier, found in heard.items()
    ]


def _run(path: Path, name: str, heard: _Heard) -> Run:
    zero_ns = min(batch.time_ns for batches in heard.imu.values() for batch in batches)
    return Run(
        name=name,
        kind=_kind(heard),
        path=path,
        imus={place: _imu(path, batches, zero_ns) for place, batches in sorted(heard.imu.items())},
        pressure=_pressure(heard.pressure, zero_ns) if heard.pressure else None,
        gnss=_gnss(heard.gnss, zero_ns) if heard.gnss else None,
        camera=_camera(heard.camera, zero_ns) if heard.camera else None,
        ranges=_ranges(heard.ranges, zero_ns) if heard.ranges else None,
        source="bus recording",
    )


def _kind(heard: _Heard) -> Kind:
    feet = len(heard.imu.keys() & {"left_foot", "right_foot"})
    return "dual" if feet == 2 else "foot" if feet else "body"


def _imu(path: Path, batches: Sequence[ImuBatch], zero_ns: int) -> ImuSeries:
    """The batches' samples; a recording gives its messages in the order of their stamps."""
    time_s = (np.concatenate([batch.times for batch in batches]) - zero_ns) / NS_PER_S
    mags = [batch.mag for batch in batches if batch.mag is not None]
    return imu_series(
        path,
        time_s,
        np.concatenate([batch.accel for batch in batches]),
        np.concatenate([batch.gyro for batch in batches]),
        np.concatenate(mags) if len(mags) == len(batches) else None,
    )


def _seconds(messages: Sequence[Message], zero_ns: int) -> FloatArray:
    return np.array([(message.time_ns - zero_ns) / NS_PER_S for message in messages])


def _column(fixes: Sequence[GnssFix], value: Callable[[GnssFix], float | None]) -> FloatArray:
    return np.array([np.nan if value(fix) is None else value(fix) for fix in fixes], dtype=np.float64)


def _pressure(messages: Sequence[Pressure], zero_ns: int) -> PressureSeries:
    return PressureSeries(
        _seconds(messages, zero_ns), np.array([message.pressure_pa for message in messages])
    )


def _gnss(fixes: Sequence[GnssFix], zero_ns: int) -> GnssSeries:
    return GnssSeries(
        _seconds(fixes, zero_ns),
        _column(fixes, lambda fix: fix.latitude_deg),
        _column(fixes, lambda fix: fix.longitude_deg),
        _column(fixes, lambda fix: fix.height_m),
        _column(fixes, lambda fix: fix.horizontal_accuracy_m),
        _column(fixes, lambda fix: fix.vertical_accuracy_m),
        _column(fixes, lambda fix: fix.satellites),
        _column(fixes, lambda fix: fix.speed_m_s),
        np.rad2deg(_column(fixes, lambda fix: fix.course_rad)),
    )


def _camera(motions: Sequence[CameraMotion], zero_ns: int) -> CameraSeries:
    """The covariance comes back as one sigma for all axes of translation and one for rotation: their means."""
    variances = np.array([_variances(motion) for motion in motions])
    return CameraSeries(
        np.array([(motion.start_time_ns - zero_ns) / NS_PER_S for motion in motions]),
        _seconds(motions, zero_ns),
        np.array([motion.translation_m for motion in motions]),
        np.array([motion.rotation_rad for motion in motions]),
        np.sqrt(variances[:, :3].mean(axis=1)),
        np.sqrt(variances[:, 3:].mean(axis=1)),
        np.array([_or_nan(motion.confidence_pct) for motion in motions]),
    )


def _variances(motion: CameraMotion) -> FloatArray:
    """The covariance's diagonal (6,), NaN where it is unknown."""
    return np.full(6, np.nan) if motion.covariance is None else np.diag(symmetric(motion.covariance))


def _ranges(messages: Sequence[Range], zero_ns: int) -> RangeSeries:
    return RangeSeries(
        _seconds(messages, zero_ns),
        tuple(message.peer for message in messages),
        np.array([message.distance_m for message in messages]),
        np.array([_or_nan(message.sigma_m) for message in messages]),
    )


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value
