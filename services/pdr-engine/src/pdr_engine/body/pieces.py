"""What the parts of the body module hand to each other: one step as it was cut out of the stream."""

from dataclasses import dataclass

from bootprint.messages import Float64Array

FloatArray = Float64Array


@dataclass(frozen=True, slots=True)
class Stride:
    """One step, before its length and azimuth are judged.

    The level frame is the device's own forward made horizontal: x ahead, y left, z up. ``level_accel_m_s2`` (n, 3)
    is free of gravity, ``level_gyro_rad_s`` (n, 3) and ``level_field_ut`` (n, 3, None without magnetometer) are in
    the same frame; ``time_s`` (n,) counts from ``start_ns``. ``turn_rad`` is the gyro's heading change over the
    step, counter-clockwise; ``pressure_pa`` the air pressure at its end.
    """

    start_ns: int
    end_ns: int
    level_accel_m_s2: FloatArray
    level_gyro_rad_s: FloatArray
    time_s: FloatArray
    level_field_ut: FloatArray | None
    turn_rad: float
    pressure_pa: float | None
