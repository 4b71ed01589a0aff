"""Named radios: one TOML file each beside this module; `named` loads one, `names` lists them.

A file tells what a sender pays for on that radio (`Medium`), in ``summary`` what it is, and in ``source`` where the
figures come from. A link takes them over with ``profile = "vhf-1200"``.
"""

import tomllib
from difflib import get_close_matches
from functools import cache
from importlib import resources
from typing import Any

from bootprint.config import convert
from bootprint.errors import ConfigError
from sa_hub.radio.medium import Lora, Medium

_ENDING = ".toml"


class RadioProfile(Medium, kw_only=True, frozen=True):
    """A medium with a name; ``order`` is its place in lists."""

    name: str
    summary: str
    source: str
    order: int = 0


@cache
def names() -> tuple[str, ...]:
    """The names of all profiles: plain ones first, then by band and rate."""
    return tuple(profile.name for profile in _all().values())


def named(name: str) -> RadioProfile:
    """The profile of that name; ConfigError tells the nearest one if there is none."""
    try:
        return _all()[name]
    except KeyError:
        near = get_close_matches(name, names(), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(names())}"
        raise ConfigError(f"no radio profile {name!r}; {hint}") from None


@cache
def _all() -> dict[str, RadioProfile]:
    files = [file for file in resources.files(__name__).iterdir() if file.name.endswith(_ENDING)]
    profiles = (_loaded(file.name.removesuffix(_ENDING), file.read_text(encoding="utf-8")) for file in files)
    return {each.name: each for each in sorted(profiles, key=lambda each: (each.order, each.name))}


def _loaded(name: str, text: str) -> RadioProfile:
    where = f"radio profile {name}"
    values: dict[str, Any] = {"name": name, **tomllib.loads(text)}
    if "lora" in values:
        values["rate_bits_per_s"] = convert(values["lora"], Lora, where).rate_bits_per_s
    return convert(values, RadioProfile, where)
