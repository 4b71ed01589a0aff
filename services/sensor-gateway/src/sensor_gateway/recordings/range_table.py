"""``ranges.csv`` of a run folder: ``time_s,peer,distance_m[,sigma_m]``, the one table that names somebody."""

import csv
import math
from pathlib import Path
from typing import TextIO

import numpy as np

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import RangeSeries

_WANTED = {"time_s", "peer", "distance_m"}
_KNOWN = _WANTED | {"sigma_m"}


def read_ranges(path: Path) -> RangeSeries:
    """The ranges in the order of the file; RecordingError names the line that is wrong."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _parse(path, file)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error


def _parse(path: Path, file: TextIO) -> RangeSeries:
    rows = csv.DictReader(file, skipinitialspace=True)
    _check_header(path, set(rows.fieldnames or ()))
    peers, numbers = [], []
    for row in rows:
        peers.append(_peer(path, rows.line_num, row))
        numbers.append(
            [_number(path, rows.line_num, row, name) for name in ("time_s", "distance_m", "sigma_m")]
        )
    if not peers:
        raise RecordingError(f"{path}: no data below its header")
    values = np.array(numbers, dtype=np.float64).reshape(-1, 3)
    return RangeSeries(values[:, 0], tuple(peers), values[:, 1], values[:, 2])


def _check_header(path: Path, found: set[str]) -> None:
    if _WANTED - found:
        raise RecordingError(f"{path}: column {', '.join(sorted(_WANTED - found))} is missing")
    if found - _KNOWN:
        raise RecordingError(
            f"{path}: unknown column {sorted(found - _KNOWN)[0]!r} (known: {', '.join(sorted(_KNOWN))})"
        )


def _peer(path: Path, line: int, row: dict[str, str]) -> str:
    if None in row or None in row.values() or not row["peer"]:
        raise RecordingError(f"{path}: line {line}: want a peer, and as many cells as the header has")
    return row["peer"]


def _number(path: Path, line: int, row: dict[str, str], name: str) -> float:
    try:
        return float(row.get(name) or math.nan)
    except ValueError as error:
        raise RecordingError(f"{path}: line {line}: {error}") from None
