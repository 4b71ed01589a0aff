"""What a foot's inertial signals look like: per-stride figures and band energies, recorded or simulated alike."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from proving_ground.agreement.strides import GRAVITY_M_S2, FloatArray, Stride, strides_of
from sensor_gateway.recordings.run import ImuSeries

BANDS_HZ = ((0.5, 3.0), (3.0, 8.0), (8.0, 15.0), (15.0, 30.0), (30.0, 60.0), (60.0, 95.0))
_FLOOR_S = 0.05  # the calmest of these spans in a stride is its stance's floor
_SEGMENT_S = 2.56


def _peak(values: FloatArray) -> float:
    return float(np.linalg.norm(values, axis=1).max())


def _floor(values: FloatArray, stride: Stride) -> float:
    """Root mean square over the calmest span."""
    width = max(2, round(_FLOOR_S / float(np.median(np.diff(stride.time_s)))))
    return float(np.sqrt(np.convolve(values**2, np.ones(width) / width, "valid").min()))


PER_STRIDE: dict[str, Callable[[Stride], float]] = {
    "stride_s": lambda stride: stride.duration_s,
    "stride_m": lambda stride: stride.length_m,
    "stance_share": lambda stride: min(1.0, stride.standing_s / stride.duration_s),
    "lift_m": lambda stride: float((stride.position_m[:, 2] - stride.rise_m * _done(stride)).max()),
    "toe_down_rad": lambda stride: float(stride.euler_rad[:, 1].max()),
    "toe_up_rad": lambda stride: -float(stride.euler_rad[:, 1].min()),
    "accel_peak_m_s2": lambda stride: _peak(stride.force_m_s2),
    "rate_peak_rad_s": lambda stride: _peak(stride.rate_rad_s),
    "accel_floor_m_s2": lambda stride: _floor(
        np.linalg.norm(stride.force_m_s2, axis=1) - GRAVITY_M_S2, stride
    ),
    "rate_floor_rad_s": lambda stride: _floor(np.linalg.norm(stride.rate_rad_s, axis=1), stride),
}


def _done(stride: Stride) -> FloatArray:
    return stride.time_s / stride.duration_s


@dataclass(frozen=True, slots=True)
class Signature:
    """One foot of one run: ``per_stride`` figure by name (k,), and root mean square by band: ``accel_rms_m_s2``,
    ``rate_rms_rad_s`` (bands,)."""

    per_stride: dict[str, FloatArray]
    accel_rms_m_s2: FloatArray
    rate_rms_rad_s: FloatArray


def signature_of(imu: ImuSeries, chosen: Callable[[Stride], bool]) -> Signature | None:
    """Of the strides that are ``chosen``; None with fewer than three."""
    strides = [stride for stride in strides_of(imu) if chosen(stride)]
    if len(strides) < 3:
        return None
    moving = (imu.time_s >= strides[0].begin_s) & (imu.time_s <= strides[-1].begin_s + strides[-1].duration_s)
    return Signature(
        {name: _figures(strides, figure) for name, figure in PER_STRIDE.items()},
        band_rms(imu.time_s[moving], imu.accel_m_s2[moving]),
        band_rms(imu.time_s[moving], imu.gyro_rad_s[moving]),
    )


def _figures(strides: Sequence[Stride], figure: Callable[[Stride], float]) -> FloatArray:
    return np.array([figure(stride) for stride in strides])


def band_rms(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Root mean square of all axes together in each band (bands,)."""
    rate_hz = 1.0 / float(np.median(np.diff(time_s)))
    length = min(len(time_s), round(_SEGMENT_S * rate_hz))
    frequency_hz, density = welch(values, fs=rate_hz, nperseg=length, axis=0)
    power = density.sum(axis=1) * (frequency_hz[1] - frequency_hz[0])
    return np.sqrt([power[(frequency_hz >= low) & (frequency_hz < high)].sum() for low, high in BANDS_HZ])
