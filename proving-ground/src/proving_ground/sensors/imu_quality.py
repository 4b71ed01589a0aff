"""Quality classes of inertial units, as their data sheets state them and as recordings show them.

Each class names its data sheet; where a sheet gives only limits, the sigma is a third of the limit. Checked against
the sheet itself: MPU-6050, and the ranges, misalignment and accelerometer stability of ADIS16497; the other figures
are those commonly quoted for the unit. Where recordings show more, they count: bias and accelerometer noise of
``industrial`` (foot-gcp), noise of ``industrial_old`` (pyshoe-vicon), gyro noise of ``consumer`` (gaitmap-example).
What no sheet tells is measured too: pyshoe-vicon and foot-gcp clip at 8.67 to 9.74 rad/s, differently on each axis
and alike in all walks of a unit, because it clips before its factory calibration scales the axis; pyshoe-vicon's
stamps wobble by 0.1 ms and are a few ms late now and then. Losses and g-sensitivity are nobody's measurement.
"""

from dataclasses import dataclass
from math import radians

from bootprint.errors import ConfigError

_G = 9.80665
_MILLI_G, _MICRO_G = _G * 1e-3, _G * 1e-6
_DEG_PER_HOUR = radians(1.0) / 3600.0


@dataclass(frozen=True, slots=True)
class TriadQuality:
    """Three axes of one kind; x stands for m/s² or rad/s.

    ``noise_density`` x/√Hz, ``bias_start`` and ``bias_instability`` x, ``scale`` and ``misalignment_rad`` sigmas of
    what the factory calibration leaves, ``limit`` x and ``limit_spread`` its relative sigma from axis to axis.
    """

    noise_density: float
    bias_start: float
    bias_instability: float
    scale: float
    misalignment_rad: float
    limit: float
    limit_spread: float
    resolution: float


@dataclass(frozen=True, slots=True)
class MagnetometerQuality:
    """``hard_iron_ut`` and ``soft_iron`` (relative) are sigmas of what the wearer's calibration leaves."""

    noise_ut: float
    hard_iron_ut: float
    soft_iron: float
    resolution_ut: float
    rate_hz: float


@dataclass(frozen=True, slots=True)
class ImuClass:
    """A class of inertial units.

    ``integrates``: outputs are means over the interval that ends with the sample (units that sample fast inside and
    integrate); otherwise instantaneous behind a low-pass of second order at ``bandwidth_hz``, delay included.
    ``sample_jitter_s``: the instants wobble, the stamps do not; ``stamp_jitter_s``: the other way round;
    ``late_share`` of the stamps are later by ``late_s`` on average. ``clock_ppm``: sigma of the unit's clock rate.
    ``loss_share`` of the samples is missing, in runs of ``loss_run`` on average.
    """

    name: str
    source: str
    rate_hz: float
    integrates: bool
    bandwidth_hz: float
    accel: TriadQuality
    gyro: TriadQuality
    g_sensitivity: float  # rad/s per m/s²
    magnetometer: MagnetometerQuality
    sample_jitter_s: float = 0.0
    stamp_jitter_s: float = 0.0
    late_share: float = 0.0
    late_s: float = 0.0
    clock_ppm: float = 0.0
    loss_share: float = 0.0
    loss_run: float = 1.0


_CALIBRATED = MagnetometerQuality(0.05, 0.5, 0.01, 0.01, 200.0)

TACTICAL = ImuClass(
    name="tactical",
    source="Analog Devices, ADIS16497 data sheet rev. D (model -3): ±2000 °/s, ±40 g, delta angle and velocity",
    rate_hz=200.0,
    integrates=True,
    bandwidth_hz=550.0,
    accel=TriadQuality(0.6e-3, 1.4 * _MILLI_G, 13.0 * _MICRO_G, 5e-4, radians(0.05), 40.0 * _G, 0.01, 1e-4),
    gyro=TriadQuality(
        radians(0.007), radians(0.07), 3.3 * _DEG_PER_HOUR, 1e-3, radians(0.05), radians(2000.0), 0.01, 1e-6
    ),
    g_sensitivity=radians(0.006) / _G,
    magnetometer=_CALIBRATED,
    stamp_jitter_s=2e-6,
    clock_ppm=5.0,
)
INDUSTRIAL = ImuClass(
    name="industrial",
    source="LORD MicroStrain, 3DM-GX5-25 data sheet; clipping, stamps and noise floor as in foot-gcp",
    rate_hz=200.0,
    integrates=True,
    bandwidth_hz=225.0,
    accel=TriadQuality(
        60.0 * _MICRO_G, 2.0 * _MILLI_G, 40.0 * _MICRO_G, 5e-4, radians(0.05), 20.0 * _G, 0.02, 1e-4
    ),
    gyro=TriadQuality(
        radians(0.005), radians(0.25), 8.0 * _DEG_PER_HOUR, 5e-4, radians(0.05), radians(500.0), 0.015, 1e-6
    ),
    g_sensitivity=radians(0.01) / _G,
    magnetometer=_CALIBRATED,
    stamp_jitter_s=2e-6,
    clock_ppm=10.0,
    loss_share=1e-5,
)
INDUSTRIAL_OLD = ImuClass(
    name="industrial_old",
    source="LORD MicroStrain, 3DM-GX3-25 data sheet; noise, clipping and stamps as in pyshoe-vicon",
    rate_hz=200.0,
    integrates=True,
    bandwidth_hz=100.0,
    accel=TriadQuality(2.0e-3, 5.0 * _MILLI_G, 0.1 * _MILLI_G, 5e-4, radians(0.1), 18.0 * _G, 0.02, 1e-3),
    gyro=TriadQuality(
        0.8e-3, radians(0.1), 18.0 * _DEG_PER_HOUR, 5e-4, radians(0.1), radians(540.0), 0.03, 1e-5
    ),
    g_sensitivity=radians(0.02) / _G,
    magnetometer=MagnetometerQuality(0.1, 0.5, 0.01, 0.02, 100.0),
    stamp_jitter_s=5e-5,
    late_share=5e-4,
    late_s=2e-3,
    clock_ppm=50.0,
    loss_share=1e-4,
    loss_run=2.0,
)
CONSUMER = ImuClass(
    name="consumer",
    source="InvenSense, MPU-6000/MPU-6050 product specification rev. 3.4, after a calibration that takes nine "
    "tenths of bias, scale and cross-axis error; magnetometer: AKM AK09911 data sheet",
    rate_hz=200.0,
    integrates=False,
    bandwidth_hz=94.0,
    accel=TriadQuality(
        400.0 * _MICRO_G,
        5.0 * _MILLI_G,
        0.3 * _MILLI_G,
        1e-3,
        radians(0.1),
        16.0 * _G,
        0.0,
        16.0 * _G / 2**15,
    ),
    gyro=TriadQuality(
        radians(0.015),
        radians(0.7),
        20.0 * _DEG_PER_HOUR,
        1e-3,
        radians(0.1),
        radians(2000.0),
        0.0,
        radians(2000.0) / 2**15,
    ),
    g_sensitivity=radians(0.1) / _G,
    magnetometer=MagnetometerQuality(0.8, 2.0, 0.02, 0.6, 50.0),
    sample_jitter_s=1e-4,
    stamp_jitter_s=3e-4,
    late_share=2e-3,
    late_s=3e-3,
    clock_ppm=200.0,
    loss_share=1e-3,
    loss_run=3.0,
)
IMU_CLASSES = {unit.name: unit for unit in (TACTICAL, INDUSTRIAL, INDUSTRIAL_OLD, CONSUMER)}


def imu_class(name: str) -> ImuClass:
    """The class of this name; ConfigError names those there are."""
    if name not in IMU_CLASSES:
        raise ConfigError(
            f"unknown quality class {name!r} of inertial units (known: {', '.join(IMU_CLASSES)})"
        )
    return IMU_CLASSES[name]
