"""Run folders: bring your own data. CSV files with fixed names and headers, and an optional strict ``run.toml``.

Any of ``left_foot.csv right_foot.csv body.csv`` (``time_s,ax,ay,az,gx,gy,gz[,mx,my,mz]``: s, m/s², rad/s, µT,
sensor axes as mounted), ``pressure.csv``, ``gnss.csv``, ``camera_motion.csv``, ``ranges.csv`` and ``truth.csv``
(``time_s,east_m,north_m[,up_m][,floor]``; way-points are enough). An empty cell is unknown.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from bootprint.config import Config, Origin, load_toml
from bootprint.errors import RecordingError
from sensor_gateway.recordings.range_table import read_ranges
from sensor_gateway.recordings.run import (
    CameraSeries,
    GnssSeries,
    ImuSeries,
    Kind,
    PressureSeries,
    Run,
    Truth,
)
from sensor_gateway.recordings.tables import Table, imu_series, peek_header, read_table, table_pieces

PLACES = ("left_foot", "right_foot", "body")
_IMU = ("time_s", "ax", "ay", "az", "gx", "gy", "gz")
_MAG = ("mx", "my", "mz")
_GNSS = ("lat_deg", "lon_deg", "alt_m", "h_acc_m", "v_acc_m", "satellites", "speed_m_s", "course_deg")
_CAMERA = ("start_time_s", "time_s", "tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
_CAMERA_DOUBT = ("translation_sigma_m", "rotation_sigma_rad", "confidence_pct")
_LEAST_HPA, _MOST_HPA = 300.0, 1100.0  # wherever people are
RANGES = "ranges"  # not only numbers, so it has a reader of its own
_OPTIONAL_SENSORS = ("pressure", "gnss", "camera_motion", RANGES)
_HEADERS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **dict.fromkeys(PLACES, (_IMU, _MAG)),
    "pressure": (("time_s", "pressure_pa"), ()),
    "gnss": (("time_s", "lat_deg", "lon_deg"), _GNSS[2:]),
    "camera_motion": (_CAMERA, _CAMERA_DOUBT),
    "truth": (("time_s", "east_m", "north_m"), ("up_m", "floor")),
}


class RunNotes(Config, frozen=True):
    """``run.toml``: what the tables do not tell. ``sensors`` names those to use (default: all that are there)."""

    kind: Kind | None = None
    sensors: Annotated[tuple[str, ...], msgspec.Meta(min_length=1)] | None = None
    origin: Origin | tuple[float, float, float] | None = None
    licence: str = ""


def recognises_folder(folder: Path) -> bool:
    """A folder with at least one sensor file of the right name that begins like one."""
    return any(_looks_like(folder / f"{name}.csv") for name in (*PLACES, *_OPTIONAL_SENSORS))


def _looks_like(path: Path) -> bool:
    header = peek_header(path) if path.is_file() else ()
    return bool(header) and header[0][0] in ("time_s", "start_time_s")


def read_folder(folder: Path) -> list[Run]:
    """The folder's one run; RecordingError or ConfigError on anything wrong in it."""
    notes = _notes(folder)
    sensors = _sensors(folder, notes)
    tables = {name: _read(folder / f"{name}.csv", name) for name in sensors if name != RANGES}
    imus = {place: _imu(tables[place]) for place in PLACES if place in tables}
    truth = folder / "truth.csv"
    return [
        Run(
            name=folder.resolve().name,
            kind=notes.kind or _kind(set(imus), "camera_motion" in tables),
            path=folder,
            imus=imus,
            truth={"body": _truth(_read(truth, "truth"))} if truth.exists() else {},
            pressure=pressure_of(tables["pressure"]) if "pressure" in tables else None,
            gnss=gnss_of(tables["gnss"]) if "gnss" in tables else None,
            camera=camera_of(tables["camera_motion"]) if "camera_motion" in tables else None,
            ranges=read_ranges(folder / f"{RANGES}.csv") if RANGES in sensors else None,
            origin=_origin(notes),
            source=notes.licence,
        )
    ]


def _notes(folder: Path) -> RunNotes:
    return load_toml(folder / "run.toml", RunNotes) if (folder / "run.toml").exists() else RunNotes()


def sensors_of(folder: Path) -> list[str]:
    """The sensors to read: those named, which must be there, or all that are there."""
    return _sensors(folder, _notes(folder))


def _sensors(folder: Path, notes: RunNotes) -> list[str]:
    known = (*PLACES, *_OPTIONAL_SENSORS)
    there = [name for name in known if (folder / f"{name}.csv").exists()]
    if notes.sensors is None:
        return there
    for name in notes.sensors:
        if name not in known:
            raise RecordingError(
                f"{folder / 'run.toml'}: unknown sensor {name!r} (known: {', '.join(known)})"
            )
        if name not in there:
            raise RecordingError(f"{folder / 'run.toml'}: sensor {name!r} has no file {name}.csv beside it")
    return list(notes.sensors)


def _read(path: Path, name: str) -> Table:
    table = read_table(path)
    _check_columns(table, name)
    return table


def read_pieces(folder: Path, name: str) -> Iterator[Table]:
    """A sensor's table piece by piece; RecordingError, when it is come to, on what is wrong."""
    for piece in table_pieces(folder / f"{name}.csv"):
        _check_columns(piece, name)
        yield piece


def _check_columns(table: Table, name: str) -> None:
    """All columns are there that are wanted, and all are known."""
    wanted, optional = _HEADERS[name]
    table.columns(*wanted)
    unknown = set(table.header[-1]) - {*wanted, *optional}
    if unknown:
        raise RecordingError(
            f"{table.path}: unknown column {sorted(unknown)[0]!r} (known: {', '.join(wanted + optional)})"
        )


def _kind(places: set[str], has_camera: bool) -> Kind:
    if {"left_foot", "right_foot"} <= places:
        return "dual"
    if places & {"left_foot", "right_foot"}:
        return "foot"
    return "body" if places or not has_camera else "camera"


def _imu(table: Table) -> ImuSeries:
    raw = raw_imu_of(table)
    return imu_series(table.path, raw.time_s, raw.accel_m_s2, raw.gyro_rad_s, raw.mag_ut)


def raw_imu_of(table: Table) -> ImuSeries:
    """An inertial unit's samples as they stand there, the unusable ones too."""
    data = table.columns(*_IMU)
    mag = table.columns(*_MAG) if _MAG[0] in table.header[-1] else None
    return ImuSeries(data[:, 0], data[:, 1:4], data[:, 4:7], mag)


def _truth(table: Table) -> Truth:
    time_s, track = table.column("time_s"), table.columns("east_m", "north_m")
    if not np.isfinite(track).all() or not (np.diff(time_s) > 0.0).all():
        raise RecordingError(f"{table.path}: truth must be finite and its time_s must rise")
    floor = table.column("floor") if "floor" in table.header[-1] else None
    return Truth(time_s, np.column_stack([track, table.optional("up_m")]), floor=floor)


def pressure_of(table: Table) -> PressureSeries:
    """A barometer's table as a series; RecordingError where it is in hectopascals."""
    pressure = table.column("pressure_pa")
    known = pressure[np.isfinite(pressure)]
    if len(known) and _LEAST_HPA < float(np.median(known)) < _MOST_HPA:
        raise RecordingError(
            f"{table.path}: pressure_pa is about {np.median(known):.0f}: must be Pa, not hPa"
        )
    return PressureSeries(table.column("time_s"), pressure)


def gnss_of(table: Table) -> GnssSeries:
    """A receiver's table as a series."""
    return GnssSeries(table.column("time_s"), *(table.optional(name)[:, 0] for name in _GNSS))


def camera_of(table: Table) -> CameraSeries:
    """A camera's table as a series."""
    translation = table.columns("tx_m", "ty_m", "tz_m")
    rotation = table.columns("rx_rad", "ry_rad", "rz_rad")
    doubts = (table.column(name) if name in table.header[-1] else None for name in _CAMERA_DOUBT)
    return CameraSeries(table.column("start_time_s"), table.column("time_s"), translation, rotation, *doubts)


def _origin(notes: RunNotes) -> tuple[float, float, float] | None:
    if isinstance(notes.origin, Origin):
        return notes.origin.latitude_deg, notes.origin.longitude_deg, notes.origin.height_m
    return notes.origin
