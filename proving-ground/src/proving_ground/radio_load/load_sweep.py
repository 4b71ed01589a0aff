"""Load tests by the proving ground's sweep runner: one seed is a job, with every combination of settings."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from bootprint.errors import ConfigError
from proving_ground.exercises.sweep import Figures, Settings
from proving_ground.radio_load.contest import play, row_of
from proving_ground.radio_load.floor import squad_floor_bits_per_s
from proving_ground.radio_load.formats import OURS, check_format
from proving_ground.radio_load.load import Load
from proving_ground.radio_load.squad_tracks import SquadTracks

FORMAT: Final = "format"
FIGURES: Final = (
    "bits_per_s",
    "added_error_p50_m",
    "added_error_p95_m",
    "added_error_p99_m",
    "age_p95_s",
    "missing_pct",
    "squeezed_error_p95_m",
)
FLOOR: Final = "floor_bits_per_s"
_GIVEN: Final = ("tracks", "seed", "data")
_SETTINGS: Final = tuple(field.name for field in fields(Load) if field.name not in _GIVEN)


def load_of(tracks: str, settings: Settings, data: Path | None = None) -> tuple[str, Load]:
    """A format and its load test; ConfigError names the settings there are."""
    values = dict(settings)
    name = check_format(str(values.pop(FORMAT, OURS)))
    for key, value in values.items():
        if key not in _SETTINGS:
            raise ConfigError(f"--set {key}: no such setting; known: {', '.join((FORMAT, *_SETTINGS))}")
        _check_kind(key, value)
    return name, replace(Load(tracks=tracks, data=data), **_typed(values))


def _check_kind(key: str, value: Any) -> None:
    """ConfigError if a value is not of its setting's kind."""
    default = getattr(Load, key)
    wanted: tuple[type, ...] = (int, float) if isinstance(default, float) else (type(default),)
    if not isinstance(value, wanted) or (isinstance(value, bool) and not isinstance(default, bool)):
        raise ConfigError(f"--set {key}={value}: want a value such as {default}")


def _typed(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: type(getattr(Load, key))(value) for key, value in values.items()}


def play_load_seed(tracks: str, seed: int, grid: Sequence[Settings]) -> list[Figures]:
    """One job: a seed's figures for every combination; equal tracks are made once."""
    made: dict[tuple[int, float], SquadTracks] = {}
    found = []
    for settings in grid:
        name, load = load_of(tracks, settings)
        load = replace(load, seed=seed)
        key = load.soldiers, load.duration_s
        if key not in made:
            made[key] = load.squad()
        found.append(_figures(name, load, made[key]))
    return found


def _figures(name: str, load: Load, tracks: SquadTracks) -> Figures:
    """A test's row, and the floor at the p95 that it came to."""
    row = row_of(name, [play(name, load, tracks)])
    figures: Figures = {figure: row[figure] for figure in FIGURES}
    p95_m = row["added_error_p95_m"]
    figures[FLOOR] = squad_floor_bits_per_s(tracks, p95_m) if p95_m else None
    return figures
