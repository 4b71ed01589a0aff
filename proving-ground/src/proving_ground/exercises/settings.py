"""Parameters of an exercise by name, as sweeps set them: ``net.loss``, ``hub.threshold_m``, ``fusion.rate_hz`` …"""

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from bootprint.errors import ConfigError
from proving_ground.exercises.exercise import Exercise, Soldier
from proving_ground.exercises.processes.emulated_radio import NetProfile
from proving_ground.exercises.processes.exercise_files import check_exercise
from proving_ground.exercises.squad import squad_of
from sensor_gateway.recordings.run import FEET, ImuSeries, Run, Truth

_SECTIONS = ("net", "hub", "pdr", "fusion")
_NET_KEYS = tuple(field.name for field in fields(NetProfile) if field.name not in ("name", "seed"))
_NET_LIMITS = {
    "rate_bits_per_s": (75.0, 1e9),
    "latency_s": (0.0, 60.0),
    "loss": (0.0, 0.9),
    "header_bytes": (0, 200),
}


def with_settings(exercise: Exercise, settings: Mapping[str, Any]) -> Exercise:
    """The exercise with these parameters, ``section.key`` each; ConfigError says which is wrong and why."""
    for name, value in settings.items():
        section, _, key = name.partition(".")
        if section not in _SECTIONS or not key:
            raise ConfigError(f"--set {name}: want one of {', '.join(f'{s}.…' for s in _SECTIONS)}")
        exercise = (
            _with_net(exercise, key, value) if section == "net" else _with(exercise, section, key, value)
        )
    check_exercise(exercise)
    return exercise


def check_settings(settings: Mapping[str, Any]) -> None:
    """ConfigError if an exercise could not have these parameters; nobody has to walk for that."""
    nothing = np.empty((0, 3))
    feet = dict.fromkeys(FEET, ImuSeries(np.empty(0), nothing, nothing))
    run = Run("nobody", "dual", Path(), feet)
    start = {"east_m": 0.0, "north_m": 0.0}
    nobody = Soldier("a1", 1, "", run, Truth(np.empty(0), nothing), start, simulated=True)
    with_settings(squad_of((nobody,), "nobody"), settings)


def with_loss(exercise: Exercise, loss: float | None) -> Exercise:
    """The exercise with this loss on every net; its own if None."""
    return exercise if loss is None else _with_net(exercise, "loss", loss)


def _with_net(exercise: Exercise, key: str, value: Any) -> Exercise:
    if key not in _NET_KEYS:
        raise ConfigError(f"--set net.{key}: unknown; known: {', '.join(_NET_KEYS)}")
    if key == "profile":
        return _with_radio(exercise, str(value))
    low, high = _NET_LIMITS[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ConfigError(f"--set net.{key}={value}: want a number from {low:g} to {high:g}")
    changed: dict[str, Any] = {key: value}
    nets = tuple(replace(net, profile=replace(net.profile, **changed)) for net in exercise.nets)
    return replace(exercise, nets=nets)


def _with_radio(exercise: Exercise, radio: str) -> Exercise:
    """Every net as one of this named radio; its losses stay."""

    def of_radio(old: NetProfile) -> NetProfile:
        return NetProfile.of_radio(old.name, radio, loss=old.loss, seed=old.seed)

    nets = tuple(replace(net, profile=of_radio(net.profile)) for net in exercise.nets)
    return replace(exercise, nets=nets)


def _with(exercise: Exercise, section: str, key: str, value: Any) -> Exercise:
    """``[section]`` of every computer with ``key`` (dotted for tables within) set."""
    values = _nested(dict(getattr(exercise.settings, section)), key.split("."), value)
    return replace(exercise, settings=replace(exercise.settings, **{section: values}))


def _nested(table: dict[str, Any], path: list[str], value: Any) -> dict[str, Any]:
    head, *rest = path
    inner = table.get(head, {})
    return table | {head: _nested(dict(inner), rest, value) if rest else value}
