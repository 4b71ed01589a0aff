"""Recorded walks, cut and joined to as many soldiers' ways as wanted.

Walks are those of data sets that know the truth: surveyed footprints, motion capture of a foot, way-points of
walks through malls. A soldier walks one after the other, each set down where the last one ended and turned at
random, with a halt between. No walk comes twice in a soldier's way before all have come once.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
from scipy.ndimage import uniform_filter1d

from bootprint.errors import RecordingError
from proving_ground.radio_load.scenario_walks import turned
from proving_ground.radio_load.telling import PERIOD_S, FloatArray
from sensor_gateway.recordings import load_runs

_STRIDE_S: Final = 1.2
_SHORTEST_S: Final = 10.0
_HALT_S: Final = (5.0, 30.0)
_APART_M: Final = 20.0
_WAY_POINT: Final = "TYPE_WAYPOINT"
_FOLDERS: Final = ("foot-gcp", "pyshoe-vicon")


def recorded_walks(folder: Path, soldiers: int, seed: int, longest_s: float) -> FloatArray:
    """Ways (n, T, 3) m every `PERIOD_S`, all ``longest_s`` long; RecordingError if there are no walks."""
    walks = list(_walks(folder))
    if not walks:
        raise RecordingError(f"{folder}: no recorded walks there (want {', '.join(_FOLDERS)} or way-points)")
    count = round(longest_s / PERIOD_S)
    ways = []
    for soldier in range(soldiers):
        rng = np.random.default_rng([seed, soldier])
        ways.append(_joined(walks, count, rng))
    return np.stack(ways)


def _joined(walks: list[FloatArray], count: int, rng: np.random.Generator) -> FloatArray:
    """Walks one after the other, halts between, until there are ``count`` places."""
    way = np.zeros((1, 3))
    way[0, :2] = rng.normal(0.0, _APART_M, 2)
    deck: list[int] = []
    while len(way) < count:
        deck = deck or [int(index) for index in rng.permutation(len(walks))]
        walk = walks[deck.pop()]
        halt = np.repeat(way[-1:], round(rng.uniform(*_HALT_S) / PERIOD_S), axis=0)
        placed = turned(walk, walk[0], rng.uniform(0.0, 2.0 * np.pi), way[-1, :2])
        placed[:, 2] = 0.0
        way = np.concatenate([way, halt, placed])
    return way[:count]


def _walks(folder: Path) -> Iterator[FloatArray]:
    """Every walk under the folder, (k, 3) every `PERIOD_S`, the swing of a foot smoothed."""
    for name in _FOLDERS:
        if (folder / name).is_dir():
            for run in load_runs([folder / name], "foot"):
                truth = next(iter(run.truth.values()), None)
                if truth is not None:
                    yield from _sampled(truth.time_s, truth.position_m[:, :2])
    for path in sorted(folder.rglob("*.txt")):
        yield from _sampled(*_way_points(path))


def _sampled(time_s: FloatArray, place_m: FloatArray) -> Iterator[FloatArray]:
    """A walk every `PERIOD_S`, each place the mean over a stride; nothing if it is too short to tell anything."""
    if len(time_s) < 2 or time_s[-1] - time_s[0] < _SHORTEST_S:
        return
    fine_s = np.arange(time_s[0], time_s[-1], PERIOD_S / 4.0)
    fine = np.column_stack([np.interp(fine_s, time_s, column) for column in place_m.T])
    smooth = uniform_filter1d(fine, round(_STRIDE_S / (PERIOD_S / 4.0)), axis=0, mode="nearest")[::4]
    yield np.column_stack([smooth, np.zeros(len(smooth))])


def _way_points(path: Path) -> tuple[FloatArray, FloatArray]:
    """Times (k,) s and places (k, 2) m of the way-points in a text file; none if it holds no such lines."""
    with path.open(encoding="utf-8", errors="replace") as lines:
        rows = [line.split("\t") for line in lines if _WAY_POINT in line]
    values = np.array([[float(row[0]), float(row[2]), float(row[3])] for row in rows]).reshape(-1, 3)
    return values[:, 0] / 1000.0, values[:, 1:]
