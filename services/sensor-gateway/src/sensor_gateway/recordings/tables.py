"""Numbers out of files: CSV tables and MATLAB matrices, with one-line errors that say where a file is damaged."""

import csv
import math
import os
import struct
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np
import structlog

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FloatArray, ImuSeries

STANDARD_GRAVITY_M_S2 = 9.80665
UT_PER_GAUSS = 100.0
_PEEK_BYTES = 4096
_PIECE_LINES = 500
_MATLAB_HEADER_BYTES = 128


@dataclass(frozen=True, slots=True)
class Table:
    """A CSV file: ``header`` rows of text, ``values`` (n, columns), NaN where a cell is empty."""

    path: Path
    header: tuple[tuple[str, ...], ...]
    values: FloatArray

    def columns(self, *names: str) -> FloatArray:
        """The columns with these names in the last header row, (n, len(names))."""
        known = self.header[-1]
        missing = [name for name in names if name not in known]
        if missing:
            raise RecordingError(
                f"{self.path}: column {', '.join(missing)} is missing (found: {', '.join(known)})"
            )
        return self.values[:, [known.index(name) for name in names]]

    def column(self, name: str) -> FloatArray:
        """One column, (n,)."""
        return self.columns(name)[:, 0]

    def optional(self, *names: str) -> FloatArray:
        """Columns that need not be there: all NaN then, (n, len(names))."""
        if all(name in self.header[-1] for name in names):
            return self.columns(*names)
        return np.full((len(self.values), len(names)), np.nan)


def peek_header(path: Path, rows: int = 1) -> tuple[tuple[str, ...], ...]:
    """The first rows of a text file split at commas, without reading the rest; empty if it is no text."""
    with path.open("rb") as file:
        head = file.read(_PEEK_BYTES)
    try:
        lines = head.decode(
            "utf-8-sig", errors="strict" if len(head) < _PEEK_BYTES else "ignore"
        ).splitlines()
    except UnicodeDecodeError:
        return ()
    if b"\0" in head:
        return ()
    return tuple(_cells(row) for row in csv.reader(lines[:rows]))


def read_table(path: Path, header_rows: int = 1) -> Table:
    """Read a CSV file of numbers; RecordingError names the line that is not."""
    pieces = list(table_pieces(path, header_rows))
    return Table(path, pieces[0].header, np.concatenate([piece.values for piece in pieces]))


def table_pieces(path: Path, header_rows: int = 1) -> Iterator[Table]:
    """The same piece by piece, each of some hundred rows: one at least, or RecordingError."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            header = tuple(_cells(row) for row in csv.reader(islice(file, header_rows)))
            if len(header) < header_rows:
                raise RecordingError(f"{path}: ends within its header")
            piece = None
            for lines, number in _blocks(file, header_rows):
                values = _parsed(path, lines, number, len(header[-1]))
                if len(values):
                    piece = Table(path, header, values)
                    yield piece
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
    if piece is None:
        raise RecordingError(f"{path}: no data below its header")


def _blocks(file: TextIO, line: int) -> Iterator[tuple[list[str], int]]:
    """Lines in blocks, with the number of lines before each."""
    while lines := list(islice(file, _PIECE_LINES)):
        yield lines, line
        line += len(lines)


def _parsed(path: Path, lines: list[str], before: int, width: int) -> FloatArray:
    """The numbers (n, width) of some lines: by numpy where all is plain, else cell by cell to say what is not."""
    if any(map(str.strip, lines)):
        with suppress(ValueError):
            plain: FloatArray = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
            if plain.shape[1] == width:
                return plain
    values = list(_numbers(path, csv.reader(lines), before, width))
    return np.array(values, dtype=np.float64).reshape(-1, width)


def _cells(row: list[str]) -> tuple[str, ...]:
    return tuple(cell.strip() for cell in row)


def _numbers(path: Path, rows: Any, before: int, width: int) -> Iterator[list[float]]:
    for row in rows:
        if not row:
            continue
        line = before + rows.line_num
        if len(row) != width:
            raise RecordingError(f"{path}: line {line} has {len(row)} cells, the header has {width}")
        try:
            yield [float(cell) if cell else math.nan for cell in row]
        except ValueError as error:
            raise RecordingError(f"{path}: line {line}: {error}") from None


def matlab_names(path: Path) -> set[str]:
    """The names of the matrices in a MATLAB 5 file; empty if it is none; RecordingError if it is damaged."""
    from scipy.io import whosmat

    with path.open("rb") as file:
        head = file.read(_MATLAB_HEADER_BYTES)
        if not head.startswith(b"MATLAB 5.0"):
            return set()
        if not _is_whole_matlab(file, "<" if head.endswith(b"IM") else ">"):
            raise RecordingError(f"{path}: damaged MATLAB file: it is cut off")
    try:
        return {name for name, _, _ in whosmat(path)}
    except Exception as error:  # a damaged file makes the parser raise anything at all
        raise RecordingError(f"{path}: damaged MATLAB file: {error}") from error


def _is_whole_matlab(file: BinaryIO, byte_order: str) -> bool:
    """Whether the elements after the header end where the file ends; the parser does not notice if they do not."""
    size, at = file.seek(0, os.SEEK_END), _MATLAB_HEADER_BYTES
    while at + 8 <= size:
        file.seek(at + 4)
        (length,) = struct.unpack(f"{byte_order}I", file.read(4))
        at += 8 + length
    return at == size and size > _MATLAB_HEADER_BYTES


def read_matlab(path: Path, shapes: Mapping[str, int]) -> dict[str, FloatArray]:
    """Matrices of a MATLAB 5 file by name: (n,) where ``shapes`` says 1 column, else (n, columns)."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, variable_names=list(shapes))
    except Exception as error:  # as above
        raise RecordingError(f"{path}: damaged MATLAB file: {error}") from error
    return {name: _matrix(path, name, content.get(name), columns) for name, columns in shapes.items()}


def _matrix(path: Path, name: str, value: Any, columns: int) -> FloatArray:
    if value is None:
        raise RecordingError(f"{path}: matrix {name} is missing")
    matrix = np.asarray(value, dtype=np.float64)
    if columns == 1:
        return matrix.ravel()
    if matrix.ndim != 2 or matrix.shape[1] != columns:
        raise RecordingError(f"{path}: matrix {name} has shape {matrix.shape}, want (n, {columns})")
    return matrix


def imu_series(
    path: Path,
    time_s: FloatArray,
    accel_m_s2: FloatArray,
    gyro_rad_s: FloatArray,
    mag_ut: FloatArray | None = None,
) -> ImuSeries:
    """A series of what is usable: samples that are not finite or do not advance in time are dropped and told."""
    counts = {len(time_s), len(accel_m_s2), len(gyro_rad_s)}
    if len(counts) > 1:
        raise RecordingError(f"{path}: times, accelerations and rates differ in number ({sorted(counts)})")
    finite = np.isfinite(time_s) & np.isfinite(accel_m_s2).all(axis=1) & np.isfinite(gyro_rad_s).all(axis=1)
    usable = finite & advancing(np.where(finite, time_s, -np.inf))
    dropped = int(len(usable) - usable.sum())
    if dropped:
        structlog.get_logger().warning(
            "recording.samples_dropped", path=str(path), samples=dropped, of=len(usable)
        )
    if usable.sum() < 2:
        raise RecordingError(f"{path}: has fewer than two usable inertial samples")
    mag = None if mag_ut is None or not np.isfinite(mag_ut[usable]).all() else mag_ut[usable]
    return ImuSeries(time_s[usable], accel_m_s2[usable], gyro_rad_s[usable], mag)


def resampled(time_s: FloatArray, series: FloatArray) -> FloatArray:
    """The values of ``series`` (k, 1 + m), rows of (s, values), linearly at other times (n,): (n, m)."""
    usable = series[np.isfinite(series).all(axis=1)]
    rising = usable[advancing(usable[:, 0])]
    return np.column_stack([np.interp(time_s, rising[:, 0], column) for column in rising[:, 1:].T])


def phone_ahead(vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) from a phone's axes (x right, y top, z screen) to forward, left, up: held flat, top ahead."""
    return np.column_stack([vectors[:, 1], -vectors[:, 0], vectors[:, 2]])


def advancing(time_s: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which stamps are later than all before them, (n,)."""
    if not len(time_s):
        return np.zeros(0, dtype=np.bool_)
    before = np.concatenate([[-np.inf], np.maximum.accumulate(time_s)[:-1]])
    return np.asarray(time_s > before)
