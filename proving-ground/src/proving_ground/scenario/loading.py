"""Scenario files: found by name or path, read strictly; whatever is wrong is named with the file and the line."""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any

from bootprint.config import fit
from bootprint.config_errors import Misfit
from bootprint.errors import ConfigError
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.geojson import read_plan
from proving_ground.scenario.scenario import Play, Scenario, understand
from proving_ground.scenario.schema.scenario import ScenarioFile
from proving_ground.scenario.toml_lines import KeyLines, parse_key

LIBRARY = Path(__file__).parent / "library"
STARTER = Path(__file__).with_name("starter.toml")
_LARGEST_BYTES = 4_000_000


def library() -> list[str]:
    """Names of the scenarios that come with the project."""
    return sorted(path.stem for path in LIBRARY.glob("*.toml"))


def load_scenario(path_or_name: str | Path) -> Scenario:
    """A scenario of the library by its name, or of one's own by its path.

    ConfigError in one line says the file, the line at fault, what is wrong there and what would be right.
    """
    path = _find(path_or_name)
    text = _read(path)
    try:
        return understand(path.stem, path, _convert(tomllib.loads(text), path))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}:{_line_of(error, text)}: not valid TOML: {error}") from error
    except RecursionError:
        raise ConfigError(f"{path}: nested too deeply to be a scenario") from None
    except ScenarioFault as fault:
        raise ConfigError(_located(path, text, fault)) from fault


def _line_of(error: tomllib.TOMLDecodeError, text: str) -> int:
    """The line that tomllib speaks of; the last one if the text ends too early."""
    said = re.search(r"at line (\d+)", str(error))
    return int(said[1]) if said else text.count("\n") + 1


def play(scenario: Scenario, seed: int) -> Play:
    """The scenario with the persons of a seed; ConfigError with the line if it does not work out."""
    try:
        return scenario.play(seed)
    except ScenarioFault as fault:
        raise ConfigError(_located(scenario.path, _read(scenario.path), fault)) from fault


def _find(path_or_name: str | Path) -> Path:
    name = str(path_or_name)
    if name in library():
        return LIBRARY / f"{name}.toml"
    path = Path(path_or_name)
    if path.exists() or path.suffix or path.name != name:
        return path
    nearest = difflib.get_close_matches(name, library(), n=1)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"known: {', '.join(library())}"
    raise ConfigError(f"no scenario {name!r}; {hint} (or give the path of a .toml file)")


def _read(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise ConfigError(f"{path}: larger than {_LARGEST_BYTES} bytes: not a scenario")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from error


def _convert(values: dict[str, Any], path: Path) -> ScenarioFile:
    file = fit(values, ScenarioFile)
    if isinstance(file, Misfit):
        raise ScenarioFault(file.key, file.reason)
    if file.site.plan is None:
        return file
    return read_plan(path.parent / file.site.plan, file)


def _located(path: Path, text: str, fault: ScenarioFault) -> str:
    """``file:line: reason``; the key too where the reason does not begin with it."""
    line = KeyLines(text).of(parse_key(fault.key))
    said = fault.key and fault.key not in fault.reason
    return f"{path}:{line}: {f'{fault.key}: ' if said else ''}{fault.reason}"
