"""Inertial units by name: their noise and bias, and what that changes in the filter.

Checked against reproduced data sheets: the MTi's and the MPU-6050's figures; against public code: the GX3's
densities; against a public list of the 3DM-GX5-25's figures: the GX5's densities and bias in run. **No maker's
sheet was found** for the GX3's bias, the GX5's bias at the start, and all of the NGIMU: compare them with your
unit's own sheet, or set the terms by hand. What units of these kinds show at rest on a shoe in the recorded sets
is an upper bound (densities over 20 ms, `rest.listen`): GX3 0.033 to 0.040 °/s/√Hz and from 170 µg/√Hz,
GX5 0.010 to 0.022 and from 170, NGIMU 0.013 and 250.

On a shoe, shocks and scale errors outweigh most sensors' own noise, so a sheet's density is not the filter's. The
defaults were tuned with the 3DM-GX3; for another unit the part of the noise that is the sensor's own is exchanged
and what motion adds stays. A term that was set by hand stays as it was set.
"""

import math
from dataclasses import dataclass
from typing import Literal, TypeVar

import msgspec

from bootprint.config import Config

Sensor = Literal["microstrain-gx3", "microstrain-gx5", "xsens-mti", "ngimu", "mpu-6050", "unknown"]
REFERENCE: Sensor = "microstrain-gx3"
Section = TypeVar("Section", bound=Config)

_UG = 9.80665e-6  # m/s² in a µg
_DEG = math.pi / 180.0
_DEG_PER_H = _DEG / 3600.0
_IN_RUN_S = 100.0  # bias instability is the floor of the Allan deviation, at about this time


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """A data sheet's figures: densities of white noise, gyro bias in run and at switching on (one sigma)."""

    accel_m_s2_sqrt_hz: float
    gyro_rad_s_sqrt_hz: float
    bias_in_run_rad_s: float
    bias_turn_on_rad_s: float

    @property
    def bias_walk_rad_s_sqrt_s(self) -> float:
        """The random walk that goes as far as the bias in run within the time of the Allan floor."""
        return self.bias_in_run_rad_s / math.sqrt(_IN_RUN_S)


SENSORS: dict[Sensor, SensorNoise] = {
    # 3DM-GX3-25: 80 µg/√Hz, 0.03°/s/√Hz; unchecked: 18°/h in run, ±0.25°/s at the start.
    "microstrain-gx3": SensorNoise(80 * _UG, 0.03 * _DEG, 18 * _DEG_PER_H, 0.25 * _DEG),
    # 3DM-GX5-25 with ±8 g: 80 µg/√Hz, 0.005°/s/√Hz, 8°/h in run; unchecked: ±0.04°/s at the start.
    "microstrain-gx5": SensorNoise(80 * _UG, 0.005 * _DEG, 8 * _DEG_PER_H, 0.04 * _DEG),
    # MTi 1-series data sheet: 120 µg/√Hz, 0.007°/s/√Hz, 10°/h in run; ±16 g, ±2000°/s. Bias repeats within
    # 0.5°/s over a year (Xsens knowledge base).
    "xsens-mti": SensorNoise(120 * _UG, 0.007 * _DEG, 10 * _DEG_PER_H, 0.5 * _DEG),
    # No sheet was found: densities as a recorded unit shows at rest (x-io's short walk, 250 µg/√Hz, 0.013°/s/√Hz);
    # bias, unchecked, like consumer chips of its time (36°/h), calibrated by the maker.
    "ngimu": SensorNoise(250 * _UG, 0.013 * _DEG, 36 * _DEG_PER_H, 0.5 * _DEG),
    # Product specification PS-MPU-6000A rev. 3.4: 400 µg/√Hz, 0.005°/s/√Hz at 10 Hz but 0.05°/s rms over 100 Hz;
    # zero rate within ±20°/s when new (a bound: three sigmas), 0.033°/s rms from 1 to 10 Hz; up to ±16 g, ±2000°/s.
    "mpu-6050": SensorNoise(400 * _UG, 0.005 * _DEG, 0.033 * _DEG, 20 / 3 * _DEG),
}
# A unit of which nothing is known: the worst of each, until rest tells its densities (`pdr_engine.foot.rest`).
SENSORS["unknown"] = SensorNoise(
    *(
        max(getattr(sensor, name) for sensor in SENSORS.values())
        for name in ("accel_m_s2_sqrt_hz", "gyro_rad_s_sqrt_hz", "bias_in_run_rad_s", "bias_turn_on_rad_s")
    )
)


def filter_for(sensor: Sensor, section: Section) -> Section:
    """The filter's settings with the noise of this sensor."""
    own, reference = SENSORS[sensor], SENSORS[REFERENCE]
    return _exchanged(
        section,
        {
            "accel_noise_m_s2_sqrt_hz": (own.accel_m_s2_sqrt_hz, reference.accel_m_s2_sqrt_hz),
            "gyro_noise_rad_s_sqrt_hz": (own.gyro_rad_s_sqrt_hz, reference.gyro_rad_s_sqrt_hz),
        },
    )


def alignment_for(sensor: Sensor, section: Section) -> Section:
    """The alignment's settings with the gyro bias to be expected of this sensor."""
    own, reference = SENSORS[sensor], SENSORS[REFERENCE]
    turn_on = (own.bias_turn_on_rad_s, reference.bias_turn_on_rad_s)
    return _exchanged(
        section,
        {
            "bias_sigma_rad_s": turn_on,
            "rate_rad_s": (4.0 * turn_on[0], 4.0 * turn_on[1]),
            "bias_walk_rad_s_sqrt_s": (own.bias_walk_rad_s_sqrt_s, reference.bias_walk_rad_s_sqrt_s),
        },
    )


def _exchanged(section: Section, parts: dict[str, tuple[float, float]]) -> Section:
    """Variances less the reference's part and plus the sensor's own, where a term still has its default."""
    default = type(section)()
    changes = {
        name: math.sqrt(max(getattr(default, name) ** 2 - reference**2, 0.0) + own**2)
        for name, (own, reference) in parts.items()
        if own != reference and getattr(section, name) == getattr(default, name)
    }
    return msgspec.structs.replace(section, **changes)
