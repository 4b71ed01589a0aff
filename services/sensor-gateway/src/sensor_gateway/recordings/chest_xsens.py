"""chest-xsens: a chest-worn Xsens MTi-3, 100 Hz, out and back or an L with a U-turn, MIT. No truth was measured.

Two layouts: ``test*`` (g, rad/s, pressure in hPa, columns in any order) and the maker's export (m/s²). Stamps count
0.1 ms. The magnetometer tells the field in units of that of the place where it was calibrated; it is given here as
if that had been 50 µT.
"""

from pathlib import Path

from sensor_gateway.recordings.run import PressureSeries, Run
from sensor_gateway.recordings.tables import STANDARD_GRAVITY_M_S2, imu_series, peek_header, read_table

SOURCE = "An improved wearable multi-sensor fusion PDR system (MTi-3), MIT"
_TICK_S = 1e-4
_FIELD_UT = 50.0
_PA_PER_HPA = 100.0
_TEST = ("time", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz", "p")
_EXPORT = (
    "SampleTimeFine",
    *(f"{sensor}_{axis}" for sensor in ("Acc", "Gyr", "Mag") for axis in "XYZ"),
)


def recognises(path: Path) -> bool:
    """A table with the columns of one of the two layouts."""
    header = peek_header(path)
    return bool(header) and any(set(layout) <= set(header[0]) for layout in (_TEST, _EXPORT))


def read(path: Path) -> list[Run]:
    """One walk without truth."""
    table = read_table(path)
    exported = set(_EXPORT) <= set(table.header[-1])
    data = table.columns(*(_EXPORT if exported else _TEST))
    time_s = (data[:, 0] - data[0, 0]) * _TICK_S
    force_scale = 1.0 if exported else STANDARD_GRAVITY_M_S2
    imu = imu_series(path, time_s, data[:, 1:4] * force_scale, data[:, 4:7], data[:, 7:10] * _FIELD_UT)
    pressure = None if exported else PressureSeries(time_s, data[:, 10] * _PA_PER_HPA)
    return [Run.worn(path, imu, SOURCE, pressure=pressure)]
