"""Recorded data sets, one reader module a format, found by their shape: `load_runs`.

Formats are recognised by what is in a file or folder, hardly ever by its name. What no reader knows is skipped
with a warning; what a reader knows but cannot read is an error.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import structlog

from bootprint.errors import RecordingError
from sensor_gateway.recordings import (
    bus_recording,
    camera_folder,
    chest_xsens,
    dualfoot_fgo,
    foot_gcp,
    gaitmap_example,
    msindoor20,
    phyphox,
    pyshoe_vicon,
    run_folder,
    xio_gait,
)
from sensor_gateway.recordings.run import Kind, Run

_NAMED_AT_MOST = 5


@dataclass(frozen=True, slots=True)
class Format:
    """How to know a path and how to read it; a companion of other files is known and gives no runs."""

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path], list[Run]]


def _no_runs(_: Path) -> list[Run]:
    return []


FOLDERS: tuple[Format, ...] = (
    Format("run folder", run_folder.recognises_folder, run_folder.read_folder),
    Format("camera folder", camera_folder.recognises, camera_folder.read),
    Format("dualfoot-fgo", dualfoot_fgo.recognises_folder, dualfoot_fgo.read_folder),
    Format("gaitmap-example", gaitmap_example.recognises_folder, gaitmap_example.read_folder),
    Format("phyphox", phyphox.recognises_folder, phyphox.read_folder),
)
FILES: tuple[Format, ...] = (
    Format("bus recording", bus_recording.recognises, bus_recording.read),
    Format("pyshoe-vicon", pyshoe_vicon.recognises, pyshoe_vicon.read),
    Format("pyshoe-vicon notes", pyshoe_vicon.recognises_notes, _no_runs),
    Format("foot-gcp", foot_gcp.recognises, foot_gcp.read),
    Format("foot-gcp notes", foot_gcp.recognises_notes, _no_runs),
    Format("foot-gcp logger", foot_gcp.recognises_logger, foot_gcp.read_logger),
    Format("xio-gait", xio_gait.recognises, xio_gait.read),
    Format("gaitmap walk", gaitmap_example.recognises, gaitmap_example.read),
    Format("gaitmap motion capture", gaitmap_example.recognises_mocap, _no_runs),
    Format("msindoor20", msindoor20.recognises, msindoor20.read),
    Format("msindoor20 notes", msindoor20.recognises_notes, _no_runs),
    Format("chest-xsens", chest_xsens.recognises, chest_xsens.read),
    Format("dualfoot-fgo part", dualfoot_fgo.recognises_part, _no_runs),
)


def load_runs(paths: Sequence[Path], kind: Kind | None = None) -> list[Run]:
    """Every run at these paths (files, run folders, or folders of them at any depth), in the order of their names.

    With ``kind`` only runs that offer it: a dual run offers ``foot`` too. RecordingError when a path is missing,
    a recording is damaged, or nothing is found at all.
    """
    runs = [run for path in paths for run in _load(path)]
    if not runs:
        raise RecordingError(f"no recording of a known format in {', '.join(map(str, paths))}")
    chosen = [run for run in runs if kind is None or run.offers(kind)]
    if not chosen:
        found = ", ".join(sorted({run.kind for run in runs}))
        raise RecordingError(f"no run of kind {kind} in {', '.join(map(str, paths))} (found: {found})")
    return chosen


def _load(path: Path) -> Iterator[Run]:
    if path.is_dir():
        yield from _load_folder(path)
    elif path.is_file():
        yield from _load_files([path], path.parent, named=[path])
    else:
        raise RecordingError(f"{path}: no such file or folder")


def _load_folder(folder: Path) -> Iterator[Run]:
    format_ = _format_of(folder, FOLDERS)
    if format_:
        yield from format_.read(folder)
        return
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    yield from _load_files([entry for entry in entries if entry.is_file()], folder)
    for entry in entries:
        if entry.is_dir():
            yield from _load_folder(entry)


def _read_found(format_: Format, path: Path) -> list[Run]:
    """The runs of a file nobody named but a folder holds: what is wrong with it must not hide the others."""
    try:
        return format_.read(path)
    except RecordingError as error:
        structlog.get_logger().warning("recording.skipped", error=str(error))
        return []


def _load_files(files: Sequence[Path], folder: Path, named: Collection[Path] = ()) -> Iterator[Run]:
    unknown: list[str] = []
    for path in files:
        format_ = _format_of(path, FILES)
        if format_ is None:
            unknown.append(path.name)
        elif path in named:
            yield from format_.read(path)
        else:
            yield from _read_found(format_, path)
    if unknown:
        some = ", ".join(unknown[:_NAMED_AT_MOST])
        structlog.get_logger().warning(
            "recording.unknown_skipped", folder=str(folder), files=some, count=len(unknown)
        )


def _format_of(path: Path, formats: Sequence[Format]) -> Format | None:
    try:
        return next((format_ for format_ in formats if format_.recognises(path)), None)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
