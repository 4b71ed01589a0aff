"""Squads on the move, as their fusions tell it: the same tracks for every format of a load test.

``patrol`` and ``building`` are the library's urban patrol and building clearing, ``recorded`` joins recorded walks;
any other scenario of the library goes by its own name. One seed always gives the same tracks.
"""

import difflib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from bootprint.errors import ConfigError
from proving_ground.radio_load.recorded_walks import recorded_walks
from proving_ground.radio_load.scenario_walks import scenario_walks
from proving_ground.radio_load.telling import INDOORS, PERIOD_S, FloatArray, told
from proving_ground.scenario.loading import library

LONGEST_S: Final = 1800.0
RECORDED: Final = "recorded"
DATA_VARIABLE: Final = "BOOTPRINT_DATA"
_ALIASES: Final = {"patrol": "urban-patrol", "building": "building-clearing"}
_RECORDED_S: Final = 1200.0
_TELLING: Final = 2  # the stream of random numbers that the errors of fusion come from


@dataclass(frozen=True)
class SquadTracks:
    """What the fusions of n soldiers tell: ``time_s`` (T,) stamps, ``place_m`` (n, T, 3) ENU, ``velocity_m_s``
    (n, T, 2) east and north. A position is out `telling.DELAY_S` after its stamp."""

    name: str
    seed: int
    time_s: FloatArray
    place_m: FloatArray
    velocity_m_s: FloatArray

    @property
    def soldiers(self) -> int:
        """How many there are."""
        return len(self.place_m)

    @property
    def duration_s(self) -> float:
        """From the first stamp to the last."""
        return float(self.time_s[-1] - self.time_s[0])

    def at(self, soldier: int, time_s: FloatArray) -> FloatArray:
        """What a soldier's fusion says of these times (k,): east and north (k, 2) m."""
        place = self.place_m[soldier]
        return np.column_stack([np.interp(time_s, self.time_s, place[:, axis]) for axis in (0, 1)])


def track_names() -> list[str]:
    """Every name that `squad_tracks` knows."""
    return [*_ALIASES, RECORDED, *library()]


def check_tracks(name: str, data: Path | None) -> None:
    """ConfigError if there are no such tracks, or their data are not at hand."""
    if name == RECORDED:
        _data_folder(data)
    else:
        _scenario_of(name)


def squad_tracks(
    name: str, soldiers: int, seed: int, data: Path | None = None, longest_s: float = LONGEST_S
) -> SquadTracks:
    """The tracks of a name and seed; ConfigError if the name is unknown, or recorded data are not at hand."""
    folder = _data_folder(data) if name == RECORDED else None
    return _made(name, soldiers, seed, folder, longest_s)


@lru_cache(maxsize=8)  # a study asks for the same tracks again and again
def _made(name: str, soldiers: int, seed: int, folder: Path | None, longest_s: float) -> SquadTracks:
    if folder is not None:
        walks = recorded_walks(folder, soldiers, seed, min(longest_s, _RECORDED_S))
        telling = INDOORS
    else:
        walks, telling = scenario_walks(_scenario_of(name), soldiers, seed, longest_s)
    parts = [
        told(walk, telling, np.random.default_rng([seed, soldier, _TELLING]))
        for soldier, walk in enumerate(walks)
    ]
    time_s = np.arange(walks.shape[1], dtype=np.float64) * PERIOD_S
    place_m, velocity_m_s = (np.stack([part[index] for part in parts]) for index in (0, 1))
    for values in (time_s, place_m, velocity_m_s):
        values.setflags(write=False)
    return SquadTracks(name, seed, time_s, place_m, velocity_m_s)


def _scenario_of(name: str) -> str:
    if name in _ALIASES:
        return _ALIASES[name]
    if name in library():
        return name
    nearest = difflib.get_close_matches(name, track_names(), n=1)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"known: {', '.join(track_names())}"
    raise ConfigError(f"no tracks {name!r}; {hint}")


def _data_folder(data: Path | None) -> Path:
    """The folder of recorded data: the one given, else the environment's."""
    named = data or (Path(os.environ[DATA_VARIABLE]) if os.environ.get(DATA_VARIABLE) else None)
    if named is None:
        raise ConfigError(f"tracks {RECORDED!r} want recorded data: --data DIR or {DATA_VARIABLE}")
    if not named.is_dir():
        raise ConfigError(f"--data {named}: no such folder")
    return named
