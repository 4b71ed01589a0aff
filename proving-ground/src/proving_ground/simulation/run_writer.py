"""Writes a `Run` as a run folder of CSV files, so that a simulated walk is replayed like anybody's own data."""

from pathlib import Path

import numpy as np
import tomli_w

from proving_ground.simulation.walker import FloatArray
from sensor_gateway.recordings.run import GnssSeries, ImuSeries, Run, Truth

_IMU_HEADER = "time_s,ax,ay,az,gx,gy,gz"
_GNSS_COLUMNS = (
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


def write_run_folder(run: Run, folder: Path) -> Path:
    """Write the inertial units, GNSS, truth and notes of a run below ``folder`` (made if need be)."""
    folder.mkdir(parents=True, exist_ok=True)
    for place, imu in run.imus.items():
        _write_imu(imu, folder / f"{place}.csv")
    if run.gnss is not None:
        _write_gnss(run.gnss, folder / "gnss.csv")
    for truth in run.truth.values():
        _write_truth(truth, folder / "truth.csv")
    notes: dict[str, object] = {"kind": run.kind, "licence": run.source}
    if run.origin is not None:
        notes["origin"] = list(run.origin)
    (folder / "run.toml").write_text(tomli_w.dumps(notes), encoding="utf-8")
    return folder


def _write(path: Path, header: str, columns: FloatArray, formats: list[str]) -> None:
    np.savetxt(path, columns, fmt=formats, delimiter=",", header=header, comments="")


def _write_imu(imu: ImuSeries, path: Path) -> None:
    columns = np.column_stack([imu.time_s, imu.accel_m_s2, imu.gyro_rad_s])
    _write(path, _IMU_HEADER, columns, ["%.4f", *["%.4f"] * 3, *["%.5f"] * 3])


def _write_truth(truth: Truth, path: Path) -> None:
    _write(
        path, "time_s,east_m,north_m,up_m", np.column_stack([truth.time_s, truth.position_m]), ["%.3f"] * 4
    )


def _write_gnss(gnss: GnssSeries, path: Path) -> None:
    rows = zip(*(getattr(gnss, column) for column in _GNSS_COLUMNS), strict=True)
    lines = [",".join("" if np.isnan(value) else f"{value:.10g}" for value in row) for row in rows]
    path.write_text("\n".join([",".join(_GNSS_COLUMNS), *lines]) + "\n", encoding="utf-8")
