"""`bootprint calibrate compass`: a worn compass, by turning on the spot and by a known track (METHODS A5).

It stands here because it reads every kind of recording; the fits are the engine's (`body.compass_calibration`).
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.commands.options import write_text
from bootprint.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    from bootprint.messages import Float64Array
    from pdr_engine.body.azimuth.calibration import DynamicFit, StaticFit
    from sensor_gateway.recordings.run import ImuSeries

AXES = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}


def compass(
    turn: Annotated[
        Path, typer.Argument(help="A recording: worn as ever, turning slowly on the spot, a turn or more.")
    ],
    walk: Annotated[
        Path | None, typer.Option(help="A second recording: a straight way out and back, or a closed one.")
    ] = None,
    azimuth_deg: Annotated[
        float | None,
        typer.Option(help="Magnetic azimuth of the straight way out; without, the walk is closed."),
    ] = None,
    ahead: Annotated[
        str, typer.Option(help="The unit's axis that points ahead: x, y, z, -x, -y or -z.")
    ] = "x",
    output: Annotated[Path | None, typer.Option(help="Write the table to this file.")] = None,
) -> None:
    """Fit what clothes and gait do to a worn compass; print the table that computer.toml takes.

    Example: bootprint calibrate compass turn.mcap --walk out-and-back.mcap --azimuth-deg 74
    """
    if ahead not in AXES:
        raise ConfigError(f"--ahead {ahead}: no axis; known: {', '.join(AXES)}")
    if walk is None and azimuth_deg is not None:
        raise ConfigError("--azimuth-deg needs --walk, the recording of that way")
    write_text(_calibrated(turn, walk, azimuth_deg, ahead), output)


def _calibrated(turn: Path, walk: Path | None, azimuth_deg: float | None, ahead: str) -> str:
    import numpy as np

    from pdr_engine.body.azimuth.calibration import fit_static, in_device_axes
    from proving_ground.evaluation.body.strides import level_frames

    axis = np.array(AXES[ahead])
    imu = _worn(turn)
    frames = level_frames(imu, axis)
    assert imu.mag_ut is not None
    field = np.einsum("nij,nj->ni", frames, imu.mag_ut)
    try:
        static = fit_static(field[:, :2])
    except RecordingError as error:
        raise RecordingError(f"{turn}: {error}") from error
    dynamic = None if walk is None else _walked(walk, static, azimuth_deg, axis)
    upright = np.linalg.qr(frames.mean(axis=0).T)[0].T
    upright *= np.sign(np.einsum("ij,ij->i", upright, frames.mean(axis=0)))[:, None]
    matrix, offset = in_device_axes(static, dynamic, upright)
    return compass_table(static, dynamic, matrix, offset)


def _worn(path: Path) -> "ImuSeries":
    """The body-worn unit of a recording; RecordingError unless there is one with a magnetometer."""
    from sensor_gateway.recordings import load_runs

    found = [run.imus["body"] for run in load_runs([path]) if "body" in run.imus]
    if len(found) != 1 or found[0].mag_ut is None:
        raise RecordingError(
            f"{path}: wants one run of a body-worn unit with a magnetometer, has {len(found)}"
        )
    return found[0]


def _walked(path: Path, static: "StaticFit", azimuth_deg: float | None, axis: "Float64Array") -> "DynamicFit":
    """Virtual pitch and roll by a walk, with the static calibration applied."""
    import numpy as np

    from pdr_engine.body.azimuth.calibration import fit_closed, fit_straight
    from proving_ground.evaluation.body.strides import cut_strides

    strides = cut_strides(_worn(path), axis)
    field = np.array([s.level_field_ut.mean(axis=0) for s in strides if s.level_field_ut is not None])
    field = field.reshape(-1, 3)
    field[:, :2] = static.scale * field[:, :2] + static.offset_ut
    try:
        if azimuth_deg is None:
            return fit_closed(field, np.ones(len(field)))
        way = math.radians(azimuth_deg)
        gyro = -np.cumsum([stride.turn_rad for stride in strides])
        back = np.cos(gyro - np.median(gyro[: max(len(gyro) // 4, 1)])) < 0.0
        return fit_straight(field, np.where(back, way + math.pi, way))
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error


def compass_table(
    static: "StaticFit", dynamic: "DynamicFit | None", matrix: "Float64Array", offset_ut: "Float64Array"
) -> str:
    """The TOML table, with what is to be said about it as comments."""
    rows = ", ".join(f"[{', '.join(f'{value:.5f}' for value in row)}]" for row in matrix)
    offset = ", ".join(f"{value:.2f}" for value in offset_ut)
    walked = ""
    if dynamic is not None:
        pitch, roll = math.degrees(dynamic.pitch_rad), math.degrees(dynamic.roll_rad)
        walked = (
            f"# virtual pitch {pitch:.2f}°, roll {roll:.2f}°: error on the track {dynamic.after:.3g}, "
            f"without them {dynamic.before:.3g} (rad of a straight, steps of a closed one)\n"
        )
    return (
        f"# horizontal field {static.horizontal_ut:.1f} µT, differs by {static.residual_ut:.2f} µT RMS "
        f"(uncalibrated: {static.raw_residual_ut:.2f} µT)\n{walked}"
        f"[pdr.body.calibration]\noffset_ut = [{offset}]\nmatrix = [{rows}]\n"
    )
