"""Simulated sensors against recorded ones: a table of figures, each within a stated factor.

The classes' figures were read off data sheets and off these same recordings, so this holds what was chosen and is
no test on unseen data. Not checked, because no recording here tells: bias instability (minutes at rest), scale,
misalignment and g-sensitivity (a turntable), lost samples, true errors of satellite fixes (phone-gps has no truth),
reflections, jamming and spoofing, wind, doors and lifts (no log of them), ranges, and everything about cameras.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.signal import welch

from bootprint.config import Origin
from bootprint.geomagnetism import EarthField
from proving_ground.sensors import (
    BAROMETER_CLASSES,
    GNSS_CLASSES,
    IMU_CLASSES,
    Air,
    Area,
    GnssConditions,
    Magnetics,
    Mounting,
    Zone,
    measure_gnss,
    measure_imu,
    measure_pressure,
    storey_iron,
)
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries
from support.camera_rooms import Swaying
from support.moving import Straight
from support.recorded import recorded_data

pytestmark = pytest.mark.recorded
EARTH = EarthField(0.0, 33.0, -36.0)  # Hangzhou, where msindoor20 was walked
WINDOW_S = 0.64


@cache
def recorded(data_set: str) -> list[ImuSeries]:
    """Every inertial unit of a data set."""
    return [imu for run in load_runs([recorded_data() / data_set]) for imu in run.imus.values()]


@cache
def simulated(quality: str) -> list[ImuSeries]:
    """Half a minute of eight units of a class at rest."""
    return [
        measure_imu(
            Straight(), 30.0, Mounting(), IMU_CLASSES[quality], Magnetics(EARTH), np.random.default_rng(seed)
        )
        for seed in range(8)
    ]


def quietest(imu: ImuSeries, windows: int = 5) -> list[slice]:
    """The windows in which the gyro varies least: the nearest that a worn unit comes to rest."""
    size = int(WINDOW_S / np.median(np.diff(imu.time_s)))
    starts = range(0, len(imu.time_s) - size, size)
    variation = [imu.gyro_rad_s[start : start + size].std(axis=0).sum() for start in starts]
    return [slice(starts[k], starts[k] + size) for k in np.argsort(variation)[:windows]]


def floor_of(imu: ImuSeries, signal: str) -> float:
    """Noise density in the upper part of the band, where bodies hardly move; median of the quietest windows."""
    rate_hz = 1.0 / float(np.median(np.diff(imu.time_s)))
    densities = []
    for window in quietest(imu):
        values = getattr(imu, signal)[window]
        frequency, power = welch(values, rate_hz, nperseg=len(values), axis=0)
        upper = (frequency > 0.3 * rate_hz) & (frequency < 0.475 * rate_hz)
        densities.append(np.sqrt(power[upper].mean()))
    return float(np.median(densities))


def quiet_floor(units: list[ImuSeries], signal: str) -> float:
    """The lower quartile over units: those whose wearers stood stillest."""
    return float(np.percentile([floor_of(imu, signal) for imu in units], 25))


def bias(units: list[ImuSeries]) -> float:
    """Root mean square of the mean rate in each unit's quietest window."""
    return float(np.sqrt(np.mean([imu.gyro_rad_s[quietest(imu, 1)[0]].mean(axis=0) ** 2 for imu in units])))


def stamp_wobble(units: list[ImuSeries]) -> float:
    return float(np.median([np.diff(imu.time_s).std() for imu in units]))


def colour(units: list[ImuSeries]) -> float:
    """1 + the correlation of one gyro sample with the next, at rest: 1 is white."""
    values = []
    for imu in units:
        window = imu.gyro_rad_s[quietest(imu, 1)[0]]
        values += [np.corrcoef(axis[1:], axis[:-1])[0, 1] for axis in window.T]
    return 1.0 + float(np.median(values))


def clip(units: list[ImuSeries]) -> float:
    """The largest rate on any axis of any walk: where the unit clips, if anybody turned so fast."""
    return float(max(np.abs(imu.gyro_rad_s).max() for imu in units))


def clipping(quality: str) -> list[ImuSeries]:
    """Units that spin far too fast about each axis."""
    spin = Swaying(Straight(), turn_rad_s=30.0)
    return [
        measure_imu(spin, 0.2, Mounting(), IMU_CLASSES[quality], None, np.random.default_rng(seed))
        for seed in range(3)
    ]


def mag_noise(units: list[ImuSeries]) -> float:
    """Median over units and axes of the field's deviation in the quietest window, µT."""
    sizes = [imu.mag_ut[quietest(imu, 1)[0]].std(axis=0) for imu in units if imu.mag_ut is not None]
    return float(np.median(sizes))


@cache
def mall_walks() -> list[tuple[np.ndarray, np.ndarray]]:
    """Distance walked (by the way-points) and strength of the field of every walk in msindoor20."""
    walks = []
    for path in sorted((recorded_data() / "msindoor20").glob("*.txt")):
        field, way = [], []
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            cells = line.split("\t")
            if len(cells) > 1 and cells[1] == "TYPE_MAGNETIC_FIELD":
                field.append([float(cell) for cell in (cells[0], *cells[2:5])])
            elif len(cells) > 1 and cells[1] == "TYPE_WAYPOINT":
                way.append([float(cell) for cell in (cells[0], *cells[2:4])])
        samples, points = np.array(field), np.array(way)
        place = [np.interp(samples[:, 0], points[:, 0], points[:, axis]) for axis in (1, 2)]
        gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=1)))])
        walks.append((gone, np.linalg.norm(samples[:, 1:], axis=1)))
    return walks


@cache
def simulated_mall_walks() -> list[tuple[np.ndarray, np.ndarray]]:
    """The same in the middle one of three storeys of 5 m."""
    walks, gone = [], np.arange(0.0, 100.0, 0.05)
    for seed in range(10):
        storeys = [
            storey_iron(
                np.array([-9.0, -9.0, 5.0 * floor]),
                np.array([109.0, 9.0, 5.0 * floor + 5.0]),
                10 * seed + floor,
            )
            for floor in range(3)
        ]
        place = np.column_stack([gone, 3.0 * np.sin(gone / 9.0), np.full(len(gone), 6.2)])
        field = Magnetics(EARTH, storeys[0] + storeys[1] + storeys[2]).field_ut(place)
        walks.append((gone, np.linalg.norm(field, axis=1)))
    return walks


def ripple(walks: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Median over walks of the deviation of the field's strength, µT."""
    return float(np.median([strength.std() for _, strength in walks]))


def alike(walks: list[tuple[np.ndarray, np.ndarray]], apart_m: float) -> float:
    """Median over walks of 1 + the correlation of the strength here and so far on."""
    values = []
    for gone, strength in walks:
        there, first = np.unique(gone, return_index=True)
        even = np.interp(np.arange(0.0, there[-1], 0.25), there, strength[first])
        step = round(apart_m / 0.25)
        values.append(np.corrcoef(even[step:], even[:-step])[0, 1])
    return 1.0 + float(np.median(values))


@cache
def chest_pressure() -> list[np.ndarray]:
    """Each barometer reading once (Pa), of both walks of chest-xsens: new ones come about five times a second."""
    series = []
    for name in ("test1_sensors.csv", "test2_sensors.csv"):
        table = np.genfromtxt(recorded_data() / "chest-xsens" / name, delimiter=",", names=True)
        pressure = 100.0 * table["p"]
        series.append(pressure[np.concatenate([[True], np.diff(pressure) != 0.0])])
    return series


@cache
def simulated_pressure() -> list[np.ndarray]:
    walker = Swaying(Straight((0.0, 0.0, 1.3), (1.2, 0.0, 0.0)))
    quality = BAROMETER_CLASSES["industrial"]
    return [
        measure_pressure(
            walker, 95.0, Mounting(), quality, Air(seed=seed), np.random.default_rng(seed)
        ).pressure_pa
        for seed in range(8)
    ]


def pressure_noise(series: list[np.ndarray]) -> float:
    return float(np.median([np.diff(pressure).std() for pressure in series]))


def pressure_range(series: list[np.ndarray]) -> float:
    """How far a minute and a half takes the reading, smoothed over some seconds, Pa."""
    smooth = [np.convolve(pressure, np.full(25, 1 / 25), "valid") for pressure in series]
    return float(np.median([np.ptp(pressure) for pressure in smooth]))


def phone_accuracy() -> float:
    table = np.genfromtxt(recorded_data() / "phone-gps" / "Location.csv", delimiter=",", skip_header=1)
    return float(np.median(table[:, 6]))


def simulated_phone_accuracy() -> float:
    town = GnssConditions(
        zones=(Zone("urban", Area.box(-999.0, -999.0, 999.0, 999.0), 20.0, outage_share=0.4),)
    )
    walker, origin = Straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), Origin(latitude_deg=43.6, longitude_deg=1.4)
    rng = np.random.default_rng(1)
    series = measure_gnss(walker, 600.0, Mounting(), GNSS_CLASSES["phone"], town, origin, rng)
    return float(np.nanmedian(series.h_acc_m))


@dataclass(frozen=True)
class Row:
    """A figure of recordings, the same of simulated sensors, and the factor within which they agree."""

    name: str
    recorded: Callable[[], float]
    simulated: Callable[[], float]
    factor: float


def compared(
    name: str, figure: Callable[[list[ImuSeries]], float], data: str, quality: str, factor: float
) -> Row:
    return Row(f"{name}: {data}", lambda: figure(recorded(data)), lambda: figure(simulated(quality)), factor)


def gyro_floor(units: list[ImuSeries]) -> float:
    return quiet_floor(units, "gyro_rad_s")


def accel_floor(units: list[ImuSeries]) -> float:
    return quiet_floor(units, "accel_m_s2")


ROWS = [
    compared("gyro noise", gyro_floor, "pyshoe-vicon", "industrial_old", 1.2),
    compared("gyro noise", gyro_floor, "foot-gcp", "industrial", 1.5),
    compared("gyro noise", gyro_floor, "gaitmap-example", "consumer", 2.5),
    compared("accelerometer noise", accel_floor, "pyshoe-vicon", "industrial_old", 1.5),
    compared("accelerometer noise", accel_floor, "foot-gcp", "industrial", 2.0),
    compared("accelerometer noise", accel_floor, "gaitmap-example", "consumer", 1.6),
    compared("colour of the gyro's noise", colour, "pyshoe-vicon", "industrial_old", 1.1),
    compared("gyro bias", bias, "pyshoe-vicon", "industrial_old", 2.5),
    compared("gyro bias", bias, "foot-gcp", "industrial", 2.5),
    compared("wobble of the stamps", stamp_wobble, "pyshoe-vicon", "industrial_old", 1.5),
    compared("wobble of the stamps", stamp_wobble, "foot-gcp", "industrial", 1.5),
    compared("magnetometer noise", mag_noise, "foot-gcp", "industrial", 2.5),
    Row(
        "clipping: pyshoe-vicon",
        lambda: clip(recorded("pyshoe-vicon")),
        lambda: clip(clipping("industrial_old")),
        1.1,
    ),
    Row("clipping: foot-gcp", lambda: clip(recorded("foot-gcp")), lambda: clip(clipping("industrial")), 1.1),
    Row(
        "field's ripple: msindoor20",
        lambda: ripple(mall_walks()),
        lambda: ripple(simulated_mall_walks()),
        1.6,
    ),
    Row("field 1 m on", lambda: alike(mall_walks(), 1.0), lambda: alike(simulated_mall_walks(), 1.0), 1.15),
    Row("field 2 m on", lambda: alike(mall_walks(), 2.0), lambda: alike(simulated_mall_walks(), 2.0), 1.25),
    Row("field 4 m on", lambda: alike(mall_walks(), 4.0), lambda: alike(simulated_mall_walks(), 4.0), 1.35),
    Row(
        "pressure noise",
        lambda: pressure_noise(chest_pressure()),
        lambda: pressure_noise(simulated_pressure()),
        1.8,
    ),
    Row(
        "pressure drift",
        lambda: pressure_range(chest_pressure()),
        lambda: pressure_range(simulated_pressure()),
        3.0,
    ),
    Row("stated accuracy: phone-gps", phone_accuracy, simulated_phone_accuracy, 2.0),
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name.replace(" ", "_"))
def test_simulated_sensors_agree_with_recorded_ones(row: Row) -> None:
    recorded_figure, simulated_figure = row.recorded(), row.simulated()
    assert 1.0 / row.factor < simulated_figure / recorded_figure < row.factor
