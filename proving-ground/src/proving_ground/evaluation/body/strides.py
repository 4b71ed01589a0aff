"""Steps cut out of a whole recording at once, for scoring the body module's parts one by one.

Gravity by a complementary filter, steps from crest to crest of the band-passed vertical acceleration. It looks at
the whole recording, so it serves experiments on parts; the engine cuts its own steps as the samples come.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, filtfilt, find_peaks

from pdr_engine.body.pieces import FloatArray, Stride
from sensor_gateway.recordings.run import ImuSeries, PressureSeries

_GRAVITY_M_S2 = 9.80665
_LEVELLING_S = 3.0
_STARTING_SAMPLES = 50
_SLOWEST_HZ, _FASTEST_HZ = 0.7, 3.6
_LEAST_CREST_M_S2 = 0.35
_STILL_S, _STILL_RAD_S = 1.5, 0.02
_AROUND_S, _LEAST_PROMINENCE = 4.0, 1.0  # of the RMS around: a sine's crest stands out by 2.8
_SHORTEST_S, _LONGEST_S = 0.25, 1.2
_NS_PER_S = 1_000_000_000


def cut_strides(
    imu: ImuSeries, ahead: FloatArray | None = None, pressure: PressureSeries | None = None
) -> list[Stride]:
    """The steps of a body-worn unit whose axis ``ahead`` (3,), by default x, is the device's own forward."""
    level = levelled(imu, np.array([1.0, 0.0, 0.0]) if ahead is None else ahead)
    accel, gyro, field = level.accel_m_s2, level.gyro_rad_s, level.mag_ut
    strides = []
    for start_s, end_s in step_spans(level):
        first, last = np.searchsorted(imu.time_s, [start_s, end_s])
        chosen = slice(int(first), int(last))
        strides.append(
            Stride(
                start_ns=round(start_s * _NS_PER_S),
                end_ns=round(end_s * _NS_PER_S),
                level_accel_m_s2=accel[chosen],
                level_gyro_rad_s=gyro[chosen],
                time_s=imu.time_s[chosen] - start_s,
                level_field_ut=None if field is None else field[chosen],
                turn_rad=float(np.trapezoid(gyro[chosen, 2], imu.time_s[chosen])),
                pressure_pa=None if pressure is None else _mean_pa(pressure, start_s, end_s),
            )
        )
    return strides


def heading_rad(stride: Stride) -> float:
    """The compass's azimuth from magnetic north of the device's forward, mean over a step; NaN without a field."""
    if stride.level_field_ut is None:
        return float("nan")
    ahead, left, _ = stride.level_field_ut.mean(axis=0)
    return float(np.arctan2(left, ahead))


def levelled(imu: ImuSeries, ahead: FloatArray) -> ImuSeries:
    """The same series in the level frame ahead, left, up, free of gravity and a still start's gyro bias."""
    imu = replace(imu, gyro_rad_s=imu.gyro_rad_s - _still_bias(imu))
    frame = level_frames(imu, ahead)
    accel, gyro = (np.einsum("nij,nj->ni", frame, values) for values in (imu.accel_m_s2, imu.gyro_rad_s))
    accel[:, 2] -= _GRAVITY_M_S2
    field = None if imu.mag_ut is None else np.einsum("nij,nj->ni", frame, imu.mag_ut)
    return ImuSeries(imu.time_s, accel, gyro, field)


def _still_bias(imu: ImuSeries) -> FloatArray:
    """The gyro's mean (3,) over the first second if that is still, else zero."""
    first = imu.gyro_rad_s[imu.time_s < imu.time_s[0] + _STILL_S]
    return np.where(first.std(axis=0).max() < _STILL_RAD_S, first.mean(axis=0), 0.0)


def level_frames(imu: ImuSeries, ahead: FloatArray) -> FloatArray:
    """Rows ahead, left, up in sensor axes at each sample, (n, 3, 3)."""
    up = _ups(imu)
    forward = ahead - (up @ ahead)[:, None] * up
    forward /= np.linalg.norm(forward, axis=1)[:, None]
    return np.stack([forward, np.cross(up, forward), up], axis=1)


def _ups(imu: ImuSeries) -> FloatArray:
    """The vertical in sensor axes (n, 3): turned by the gyro, drawn to the accelerometer; plain floats are fast."""
    x, y, z = imu.accel_m_s2[:_STARTING_SAMPLES].mean(axis=0).tolist()
    steps_s = np.diff(imu.time_s, prepend=imu.time_s[0])
    ups = []
    for (ax, ay, az), (p, q, r), step_s in zip(
        (imu.accel_m_s2 / _GRAVITY_M_S2).tolist(), imu.gyro_rad_s.tolist(), steps_s.tolist(), strict=True
    ):
        share = step_s / _LEVELLING_S
        turned = (x - (q * z - r * y) * step_s, y - (r * x - p * z) * step_s, z - (p * y - q * x) * step_s)
        x, y, z = (up + share * (seen - up) for up, seen in zip(turned, (ax, ay, az), strict=True))
        size = math.sqrt(x * x + y * y + z * z)
        x, y, z = x / size, y / size, z / size
        ups.append((x, y, z))
    return np.array(ups)


def step_spans(level: ImuSeries) -> list[tuple[float, float]]:
    """Start and end of each step of a levelled series, s."""
    time_s, vertical = level.time_s, level.accel_m_s2[:, 2]
    rate_hz = 1.0 / float(np.median(np.diff(time_s)))
    grid_s = np.arange(time_s[0], time_s[-1], 1.0 / rate_hz)
    fastest_hz = min(_FASTEST_HZ, 0.45 * rate_hz)
    b, a = butter(2, [_SLOWEST_HZ, fastest_hz], "bandpass", fs=rate_hz)
    smooth = filtfilt(b, a, np.interp(grid_s, time_s, vertical))
    around = uniform_filter1d(smooth**2, max(1, int(_AROUND_S * rate_hz)))
    crests, shape = find_peaks(
        smooth, height=_LEAST_CREST_M_S2, distance=max(1, int(_SHORTEST_S * rate_hz)), prominence=0.0
    )
    crests = crests[shape["prominences"] > _LEAST_PROMINENCE * np.sqrt(around[crests])]
    at_s = grid_s[crests].tolist()
    return [(a, b) for a, b in pairwise(at_s) if b - a < _LONGEST_S]


def _mean_pa(pressure: PressureSeries, start_s: float, end_s: float) -> float | None:
    """The mean over a step, interpolated where the barometer is slower than the steps."""
    inside = (pressure.time_s >= start_s) & (pressure.time_s < end_s)
    if inside.any():
        return float(pressure.pressure_pa[inside].mean())
    return float(np.interp(0.5 * (start_s + end_s), pressure.time_s, pressure.pressure_pa))
