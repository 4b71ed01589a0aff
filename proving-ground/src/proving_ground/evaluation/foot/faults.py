"""Faults of inertial units, each put into a recording alone: what `robustness` measures the foot INS with.

A sample counts as the mean over the interval that ends with its stamp, as units of this class integrate between
their outputs; slower and faster recordings are made accordingly. What is random is so by a fixed seed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from sensor_gateway.recordings.run import ImuSeries

Sensor = Literal["microstrain-gx3", "unknown"]
Change = Callable[[ImuSeries], ImuSeries]
STANDARD_GRAVITY_M_S2 = 9.80665
_SEED = 1
_BURST_EVERY_S = 6.0
_REST_SPARED_S = 3.0  # a burst at rest would hit nothing
_MID_WALK = 0.3  # of a recording: where one that begins in mid-walk begins


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: its name, what it does to a recording, and the sensor preset that is set for it."""

    name: str
    change: Change
    sensor: Sensor = "microstrain-gx3"


def _rows(imu: ImuSeries, chosen: npt.NDArray[np.int64] | npt.NDArray[np.bool_]) -> ImuSeries:
    """Some of the samples (an index or mask)."""
    mag = None if imu.mag_ut is None else imu.mag_ut[chosen]
    return ImuSeries(imu.time_s[chosen], imu.accel_m_s2[chosen], imu.gyro_rad_s[chosen], mag)


def _interval_s(imu: ImuSeries) -> float:
    return float(np.median(np.diff(imu.time_s)))


def slower(rate_hz: float) -> Change:
    """A unit that integrates over longer intervals: means of so many samples as come nearest to the rate."""

    def change(imu: ImuSeries) -> ImuSeries:
        block = max(1, round(1.0 / (rate_hz * _interval_s(imu))))
        whole = len(imu.time_s) // block * block
        accel, gyro = (
            values[:whole].reshape(-1, block, 3).mean(axis=1) for values in (imu.accel_m_s2, imu.gyro_rad_s)
        )
        return ImuSeries(imu.time_s[block - 1 : whole : block], accel, gyro)

    return change


def picked(every: int) -> Change:
    """A unit that samples without a filter: one sample in so many, the rest unseen."""
    return lambda imu: _rows(imu, np.arange(0, len(imu.time_s), every))


def faster(rate_hz: float) -> Change:
    """The recording at a higher rate: values between the middles of the recorded intervals."""

    def change(imu: ImuSeries) -> ImuSeries:
        time_s = np.arange(imu.time_s[0], imu.time_s[-1], 1.0 / rate_hz)
        middle_s = imu.time_s - 0.5 * _interval_s(imu)
        accel, gyro = (
            np.column_stack([np.interp(time_s - 0.5 / rate_hz, middle_s, column) for column in values.T])
            for values in (imu.accel_m_s2, imu.gyro_rad_s)
        )
        return ImuSeries(time_s, accel, gyro)

    return change


def jittered(sigma_s: float) -> Change:
    """Stamps that tremble while the samples do not; some go back behind their predecessor."""

    def change(imu: ImuSeries) -> ImuSeries:
        tremble = np.random.default_rng(_SEED).normal(0.0, sigma_s, len(imu.time_s))
        return replace(imu, time_s=imu.time_s + tremble)

    return change


def duplicated(share: float) -> Change:
    """A share of the samples comes twice."""

    def change(imu: ImuSeries) -> ImuSeries:
        count = len(imu.time_s)
        again = np.random.default_rng(_SEED).choice(count, round(share * count), replace=False)
        return _rows(imu, np.sort(np.concatenate([np.arange(count), again])))

    return change


def missing(share: float) -> Change:
    """A share of the samples never comes, each at random."""
    return lambda imu: _rows(imu, np.random.default_rng(_SEED).random(len(imu.time_s)) >= share)


def bursts(shortest_s: float, longest_s: float) -> Change:
    """Every six seconds nothing comes for a while, as of a radio or a serial line."""

    def change(imu: ImuSeries) -> ImuSeries:
        rng = np.random.default_rng(_SEED)
        kept = np.ones(len(imu.time_s), dtype=bool)
        for start_s in np.arange(imu.time_s[0] + _REST_SPARED_S, imu.time_s[-1], _BURST_EVERY_S):
            begin_s = start_s + rng.uniform(0.0, 1.0)
            length_s = rng.uniform(shortest_s, longest_s)
            kept &= (imu.time_s < begin_s) | (imu.time_s >= begin_s + length_s)
        return _rows(imu, kept)

    return change


def clipped(accel_g: float = math.inf, gyro_deg_s: float = math.inf) -> Change:
    """Ranges beyond which every axis is cut off."""
    accel, gyro = accel_g * STANDARD_GRAVITY_M_S2, math.radians(gyro_deg_s)
    return lambda imu: replace(
        imu,
        accel_m_s2=np.clip(imu.accel_m_s2, -accel, accel),
        gyro_rad_s=np.clip(imu.gyro_rad_s, -gyro, gyro),
    )


def scaled(accel: float = 1.0, gyro: float = 1.0) -> Change:
    """Scale errors of all three axes."""
    return lambda imu: replace(imu, accel_m_s2=accel * imu.accel_m_s2, gyro_rad_s=gyro * imu.gyro_rad_s)


def biased(rad_s: float) -> Change:
    """A gyro bias of this size, shared by the axes."""
    bias = rad_s / math.sqrt(3.0) * np.array([1.0, -1.0, 1.0])
    return lambda imu: replace(imu, gyro_rad_s=imu.gyro_rad_s + bias)


def turned() -> Change:
    """Another mounting: x is now y, y is z and z is x. A recording's limits lie along its axes: no other angles."""
    return lambda imu: replace(
        imu, accel_m_s2=np.roll(imu.accel_m_s2, 1, axis=1), gyro_rad_s=np.roll(imu.gyro_rad_s, 1, axis=1)
    )


def mirrored() -> Change:
    """A left-handed frame: one axis of both sensors turned round, as no proper mounting can."""
    mirror = np.array([1.0, 1.0, -1.0])
    return lambda imu: replace(imu, accel_m_s2=imu.accel_m_s2 * mirror, gyro_rad_s=imu.gyro_rad_s * mirror)


def begun_late(imu: ImuSeries) -> ImuSeries:
    """A recording that begins in mid-walk: without its first third, and so without the rest before it."""
    since = imu.time_s[0] + _MID_WALK * (imu.time_s[-1] - imu.time_s[0])
    return _rows(imu, imu.time_s >= since)


FAULTS = (
    Fault("untouched", lambda imu: imu),
    Fault("100 Hz", slower(100.0)),
    Fault("66 Hz", slower(66.7)),
    Fault("50 Hz", slower(50.0)),
    Fault("every other sample, unfiltered", picked(2)),
    Fault("400 Hz", faster(400.0)),
    Fault("800 Hz", faster(800.0)),
    Fault("stamps tremble by 1 ms", jittered(1e-3)),
    Fault("5 % duplicates", duplicated(0.05)),
    Fault("5 % missing", missing(0.05)),
    Fault("20 % missing", missing(0.20)),
    Fault("100–200 ms lost every 6 s", bursts(0.1, 0.2)),
    Fault("200–500 ms lost every 6 s", bursts(0.2, 0.5)),
    Fault("clipped at 8 g", clipped(accel_g=8.0)),
    Fault("clipped at 4 g", clipped(accel_g=4.0)),
    Fault("clipped at 1000 °/s", clipped(gyro_deg_s=1000.0)),
    Fault("clipped at 400 °/s", clipped(gyro_deg_s=400.0)),
    Fault("accelerometer +3 %", scaled(accel=1.03)),
    Fault("accelerometer −3 %", scaled(accel=0.97)),
    Fault("gyro +3 %", scaled(gyro=1.03)),
    Fault("gyro −3 %", scaled(gyro=0.97)),
    Fault("gyro bias 0.1 rad/s", biased(0.1)),
    Fault("gyro bias 0.1 rad/s, `unknown` set", biased(0.1), "unknown"),
    Fault("`unknown` set", lambda imu: imu, "unknown"),
    Fault("axes turned", turned()),
    Fault("left-handed axes", mirrored()),
    Fault("begins in mid-walk", begun_late),
)
