"""MAVLink inertial and pressure messages. HIGHRES_IMU is what boots should send; SCALED_IMU is coarse."""

import math
from collections import Counter
from typing import Any

from bootprint.messages import Pressure, Vector3
from sensor_gateway.readings import ClockId, ImuReading

HIGHRES = "HIGHRES_IMU"
_ACCEL, _GYRO, _MAG, _PRESSURE, _TEMPERATURE = 0x7, 0x38, 0x1C0, 0x200, 0x1000
_UT_PER_GAUSS = 100.0
_UT_PER_MGAUSS = 0.1
_PA_PER_HPA = 100.0
_M_S2_PER_MG = 9.80665e-3
# A magnetometer is slower than the gyro: its last value stands for so long.
_MAG_HOLD_NS = 100_000_000


class ImuDecoder:
    """Inertial messages of one stream to readings; remembers the last field and who sends the finer message."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._mag: dict[str, tuple[int, Vector3]] = {}
        self._fine: set[str] = set()

    def highres(self, message: Any, place: str, clock: ClockId, device_ns: int) -> ImuReading | None:
        """HIGHRES_IMU: m/s², rad/s, gauss."""
        if message.fields_updated & (_ACCEL | _GYRO) != _ACCEL | _GYRO:
            self._counts["imu_incomplete"] += 1
            return None
        self._fine.add(place)
        if message.fields_updated & _MAG == _MAG:
            self._hold_mag(place, device_ns, _vector(message, "mag", _UT_PER_GAUSS))
        return ImuReading(
            place,
            clock,
            device_ns,
            _vector(message, "acc", 1.0),
            _vector(message, "gyro", 1.0),
            self._held_mag(place, device_ns),
        )

    def scaled(self, message: Any, place: str, clock: ClockId, device_ns: int) -> ImuReading | None:
        """SCALED_IMU, 2, 3: milli-g, milli-rad/s, milli-gauss; not used where HIGHRES_IMU comes too."""
        self._counts["imu_scaled_coarse"] += 1
        if place in self._fine:
            return None
        mag = _vector(message, "mag", _UT_PER_MGAUSS)
        return ImuReading(
            place,
            clock,
            device_ns,
            _vector(message, "acc", _M_S2_PER_MG),
            _vector(message, "gyro", 1e-3),
            mag if any(mag) else None,
        )

    def _hold_mag(self, place: str, device_ns: int, mag: Vector3) -> None:
        if all(map(math.isfinite, mag)):
            self._mag[place] = device_ns, mag

    def _held_mag(self, place: str, device_ns: int) -> Vector3 | None:
        measured_ns, mag = self._mag.get(place, (0, None))
        return mag if abs(device_ns - measured_ns) <= _MAG_HOLD_NS else None


def has_pressure(message: Any) -> bool:
    """Whether a HIGHRES_IMU carries a new pressure."""
    return bool(message.fields_updated & _PRESSURE)


def highres_pressure(message: Any, device_ns: int) -> Pressure:
    """The pressure (hPa) and temperature of a HIGHRES_IMU."""
    warm = message.fields_updated & _TEMPERATURE and math.isfinite(message.temperature)
    return Pressure(
        time_ns=device_ns,
        pressure_pa=message.abs_pressure * _PA_PER_HPA,
        temperature_c=message.temperature if warm else None,
    )


def scaled_pressure(message: Any, device_ns: int) -> Pressure:
    """SCALED_PRESSURE, 2, 3: hPa and hundredths of a degree."""
    return Pressure(
        time_ns=device_ns,
        pressure_pa=message.press_abs * _PA_PER_HPA,
        temperature_c=message.temperature / 100.0,
    )


def _vector(message: Any, quantity: str, unit: float) -> Vector3:
    x, y, z = (getattr(message, axis + quantity) * unit for axis in "xyz")
    return x, y, z
