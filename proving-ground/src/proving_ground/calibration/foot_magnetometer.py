"""`bootprint calibrate foot-magnetometer`: what iron on a boot does to its magnetometer, for computer.toml.

It stands here because it reads every kind of recording; the fit is pdr-engine's own (`pdr_engine.ellipsoid`).
"""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bootprint.commands.options import write_text
from bootprint.config import load_computer
from bootprint.errors import RecordingError
from proving_ground.calibration.compass import compass

if TYPE_CHECKING:
    from bootprint.messages import Float64Array
    from pdr_engine.ellipsoid import EllipsoidFit


def register(app: typer.Typer) -> None:
    """Add ``calibrate`` with its commands."""
    group = typer.Typer(help="Calibrate sensors from a recording.", no_args_is_help=True)
    group.command("foot-magnetometer")(foot_magnetometer)
    group.command("compass")(compass)
    app.add_typer(group, name="calibrate")


def foot_magnetometer(
    recording: Annotated[
        Path, typer.Argument(help="A recording or run folder: the boot turned in all directions.")
    ],
    place: Annotated[str | None, typer.Option(help="left_foot or right_foot; if it is not clear.")] = None,
    config: Annotated[
        Path | None, typer.Option(help="The computer.toml that knows the realm: scales to the field there.")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="Write the table to this file.")] = None,
) -> None:
    """Fit hard and soft iron of a boot's magnetometer; print the table that computer.toml takes.

    Example: bootprint calibrate foot-magnetometer turned.mcap --place left_foot --config computer.toml
    """
    from pdr_engine.ellipsoid import fit_ellipsoid

    chosen, mag_ut = _samples(recording, place)
    try:
        fit = fit_ellipsoid(mag_ut, None if config is None else _strength_ut(config))
    except RecordingError as error:
        raise RecordingError(f"{recording}: {chosen}: {error}") from error
    write_text(calibration_table(chosen, fit), output)


def _samples(recording: Path, place: str | None) -> "tuple[str, Float64Array]":
    """The place and its magnetic samples (n, 3) µT; RecordingError unless exactly one is meant."""
    from sensor_gateway.recordings import load_runs
    from sensor_gateway.recordings.run import FEET

    runs = load_runs([recording])
    found = [
        (name, imu.mag_ut)
        for run in runs
        for name, imu in run.imus.items()
        if name in FEET and imu.mag_ut is not None and place in (None, name)
    ]
    if not found:
        raise RecordingError(f"{recording}: no magnetometer of {place or 'a foot'} in it")
    if len(found) > 1:
        names = ", ".join(name for name, _ in found)
        raise RecordingError(f"{recording}: magnetometers of {names}: name one by --place, of a single run")
    return found[0]


def _strength_ut(config: Path) -> float:
    """The earth's field at the realm's origin, today: it changes by a thousandth a year."""
    from bootprint.geomagnetism import earth_field

    return earth_field(load_computer(config).realm.origin, time.time_ns()).strength_ut


def calibration_table(place: str, fit: "EllipsoidFit") -> str:
    """The TOML table, with what is to be said about it as comments."""
    from pdr_engine.ellipsoid import DIRECTIONS

    rows = ", ".join(f"[{', '.join(f'{value:.5f}' for value in row)}]" for row in fit.matrix)
    offset = ", ".join(f"{value:.2f}" for value in fit.offset_ut)
    return (
        f"# {fit.directions} of {len(DIRECTIONS)} directions covered; strength {fit.strength_ut:.1f} µT, differs by"
        f" {fit.residual_ut:.2f} µT RMS (uncalibrated: {fit.raw_residual_ut:.2f} µT)\n"
        f"[pdr.foot.magnetometer.{place}]\n"
        f"offset_ut = [{offset}]\n"
        f"matrix = [{rows}]\n"
    )
