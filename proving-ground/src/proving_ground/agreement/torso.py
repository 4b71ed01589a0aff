"""The torso's signals while walking, recorded on a chest (chest-xsens) and simulated at the belt.

There is no truth and one person; what can be compared is how strongly the trunk shakes up and down and to the
sides, and how fast it turns, in bands, at the same step frequency. Chest and belt are different places of a trunk.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import welch
from scipy.spatial.transform import Rotation

from proving_ground.agreement.comparison import Finding
from proving_ground.agreement.signals import band_rms
from proving_ground.agreement.strides import GRAVITY_M_S2, FloatArray
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import Mounting, imu_class, measure_imu
from sensor_gateway.recordings.run import ImuSeries
from sensor_gateway.recordings.tables import read_table

DATASET = "chest-xsens"
_BOUND = 2.5
_BANDS = ("0.5-3", "3-8", "8-15")
_TICK_S = 1e-4
_STEP_HZ = (1.3, 2.6)
_WALKS_M_S2 = 0.5  # an acceleration that varies by more than this over a second is walking
_LEG_M = 40.0


def findings(data: Path, seeds: int) -> Iterator[Finding]:
    """Figures of the chest's walks beside those of simulated ones at their step frequency; none without the set."""
    recorded = [chest_imu(path) for path in sorted((data / DATASET).glob("test*.csv"))]
    if not recorded:
        return
    real = [signature_of(imu) for imu in recorded]
    step_hz = float(np.median([step_frequency_hz(imu) for imu in recorded]))
    made = [signature_of(simulated(step_hz, seed)) for seed in range(seeds)]
    for name in real[0]:
        value, twin = (float(np.median([one[name] for one in group])) for group in (real, made))
        yield Finding(DATASET, "walk", f"torso {name}", value, twin, _BOUND, None)


def chest_imu(path: Path) -> ImuSeries:
    """A walk of the set: time in 0.1 ms, accelerations in g, rates in rad/s."""
    table = read_table(path)
    names = list(table.header[0])
    column = {name: table.values[:, names.index(name)] for name in names}
    accel = np.column_stack([column["ax"], column["ay"], column["az"]]) * GRAVITY_M_S2
    gyro = np.column_stack([column["gx"], column["gy"], column["gz"]])
    return ImuSeries((column["time"] - column["time"][0]) * _TICK_S, accel, gyro)


def simulated(step_hz: float, seed: int) -> ImuSeries:
    """A unit at the belt of a drawn person who walks straight on at this step frequency."""
    rng = np.random.default_rng(seed)
    person = Person.drawn(rng)
    speed_m_s = person.walk_ratio_m_s * step_hz**2
    way = np.array([[0.0, 0.0, 0.0], [_LEG_M, 0.0, 0.0]])
    motion = move(person, Itinerary((Leg("walk", way, speed_m_s=speed_m_s),)), seed)
    unit = replace(imu_class("consumer"), rate_hz=100.0, bandwidth_hz=40.0)
    mounting = Mounting(np.array([0.12, 0.0, 0.0]), Rotation.from_euler("y", 0.1))
    return measure_imu(motion.torso, motion.duration_s, mounting, unit, None, rng)


def signature_of(imu: ImuSeries) -> dict[str, float]:
    """Root mean squares of the walking part: vertical, horizontal (m/s²) and rate (rad/s), by band."""
    walking = _walking(imu)
    time_s, accel, gyro = imu.time_s[walking], imu.accel_m_s2[walking], imu.gyro_rad_s[walking]
    up = accel.mean(axis=0) / np.linalg.norm(accel.mean(axis=0))
    vertical = (accel @ up)[:, None]
    parts = {
        "vertical_m_s2": vertical,
        "horizontal_m_s2": accel - vertical * up,
        "rate_rad_s": gyro,
    }
    return {
        f"{name} {band} Hz": float(value)
        for name, values in parts.items()
        for band, value in zip(_BANDS, band_rms(time_s, values), strict=False)
    }


def step_frequency_hz(imu: ImuSeries) -> float:
    """Where the acceleration's magnitude is strongest between one and a half and two and a half steps a second."""
    walking = _walking(imu)
    interval_s = float(np.median(np.diff(imu.time_s)))
    size = np.linalg.norm(imu.accel_m_s2[walking], axis=1)
    frequency_hz, density = welch(size, fs=1.0 / interval_s, nperseg=min(len(size), round(10.0 / interval_s)))
    inside = (frequency_hz > _STEP_HZ[0]) & (frequency_hz < _STEP_HZ[1])
    return float(frequency_hz[inside][np.argmax(density[inside])])


def _walking(imu: ImuSeries) -> FloatArray:
    """Whether the acceleration varies as it does in walking, (n,) bool."""
    width = round(1.0 / float(np.median(np.diff(imu.time_s))))
    size = np.linalg.norm(imu.accel_m_s2, axis=1)
    mean = np.convolve(size, np.ones(width) / width, "same")
    spread = np.sqrt(np.maximum(np.convolve(size**2, np.ones(width) / width, "same") - mean**2, 0.0))
    return np.asarray(spread > _WALKS_M_S2)
