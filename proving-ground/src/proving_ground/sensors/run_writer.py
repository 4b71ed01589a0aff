"""Writes a `Run` as a run folder of CSV files, so that a simulated walk is replayed like anybody's own data."""

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import tomli_w

from proving_ground.motion import FloatArray
from sensor_gateway.recordings.run import (
    CameraSeries,
    GnssSeries,
    ImuSeries,
    PressureSeries,
    RangeSeries,
    Run,
    Truth,
)

_IMU = ("time_s", "ax", "ay", "az", "gx", "gy", "gz")
_MAG = ("mx", "my", "mz")
_CAMERA = ("start_time_s", "time_s", "tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
_CAMERA_DOUBT = ("translation_sigma_m", "rotation_sigma_rad", "confidence_pct")
_GNSS = (
    "time_s",
    "lat_deg",
    "lon_deg",
    "alt_m",
    "h_acc_m",
    "v_acc_m",
    "satellites",
    "speed_m_s",
    "course_deg",
)
_TIME = "%.6f"


def write_run_folder(run: Run, folder: Path) -> Path:
    """Write every sensor, the person's truth and the notes of a run below ``folder`` (made if need be).

    A sensor that never said anything gets no file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for place, imu in run.imus.items():
        _write_imu(imu, folder / f"{place}.csv")
    if run.pressure is not None and run.pressure.time_s.size:
        _write_pressure(run.pressure, folder / "pressure.csv")
    if run.gnss is not None and run.gnss.time_s.size:
        _write_gnss(run.gnss, folder / "gnss.csv")
    if run.camera is not None and run.camera.time_s.size:
        _write_camera(run.camera, folder / "camera_motion.csv")
    if run.ranges is not None and run.ranges.time_s.size:
        _write_ranges(run.ranges, folder / "ranges.csv")
    truth = run.truth_of("body") or next(iter(run.truth.values()), None)
    if truth is not None:
        _write_truth(truth, folder / "truth.csv")
    (folder / "run.toml").write_text(tomli_w.dumps(_notes(run)), encoding="utf-8")
    return folder


def _notes(run: Run) -> dict[str, object]:
    notes: dict[str, object] = {"kind": run.kind, "licence": run.source}
    return notes if run.origin is None else {**notes, "origin": list(run.origin)}


def _write(path: Path, names: Iterable[str], columns: FloatArray, formats: list[str]) -> None:
    np.savetxt(path, columns, fmt=formats, delimiter=",", header=",".join(names), comments="")


def _write_imu(imu: ImuSeries, path: Path) -> None:
    columns = [imu.time_s, imu.accel_m_s2, imu.gyro_rad_s]
    formats = [_TIME, *["%.5f"] * 3, *["%.6f"] * 3]
    if imu.mag_ut is None:
        _write(path, _IMU, np.column_stack(columns), formats)
    else:
        _write(path, _IMU + _MAG, np.column_stack([*columns, imu.mag_ut]), [*formats, *["%.3f"] * 3])


def _write_truth(truth: Truth, path: Path) -> None:
    names = ("time_s", "east_m", "north_m", "up_m")
    columns = np.column_stack([truth.time_s, truth.position_m])
    if truth.has_height:
        _write(path, names, columns, ["%.4f"] * 4)
    else:
        _write(path, names[:3], columns[:, :3], ["%.4f"] * 3)


def _write_pressure(series: PressureSeries, path: Path) -> None:
    columns = np.column_stack([series.time_s, series.pressure_pa])
    _write(path, ("time_s", "pressure_pa"), columns, [_TIME, "%.3f"])


def _write_camera(series: CameraSeries, path: Path) -> None:
    motion = np.column_stack([series.start_time_s, series.time_s, series.translation_m, series.rotation_rad])
    known = [name for name in _CAMERA_DOUBT if getattr(series, name) is not None]
    columns = np.column_stack([motion, *(getattr(series, name) for name in known)])
    _write(path, (*_CAMERA, *known), columns, [_TIME, _TIME, *["%.6g"] * (6 + len(known))])


def _write_gnss(series: GnssSeries, path: Path) -> None:
    columns = (getattr(series, name) for name in _GNSS)
    _write_cells(path, _GNSS, ([_cell(value) for value in row] for row in zip(*columns, strict=True)))


def _write_ranges(series: RangeSeries, path: Path) -> None:
    rows = zip(series.time_s, series.peer, series.distance_m, series.sigma_m, strict=True)
    cells = ([f"{time:.6f}", peer, _cell(distance), _cell(sigma)] for time, peer, distance, sigma in rows)
    _write_cells(path, ("time_s", "peer", "distance_m", "sigma_m"), cells)


def _cell(value: float) -> str:
    """Empty where unknown; eleven digits tell a latitude to a centimetre and less."""
    return "" if np.isnan(value) else f"{value:.11g}"


def _write_cells(path: Path, names: Iterable[str], rows: Iterable[list[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)
