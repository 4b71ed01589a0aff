"""Formats that others use, each with its own update rule and, where there is one, its library's encoder."""

import difflib
from typing import Final

from bootprint.errors import ConfigError
from proving_ground.radio_load.formats.cot import COT_XML, TAK_PROTOBUF
from proving_ground.radio_load.formats.dis import DIS
from proving_ground.radio_load.formats.format import Format
from proving_ground.radio_load.formats.mavlink import MAVLINK2
from proving_ground.radio_load.formats.meshtastic import MESHTASTIC
from proving_ground.radio_load.formats.nmea import NMEA
from proving_ground.radio_load.formats.vmf import VMF

__all__ = ["FORMATS", "OURS", "Format", "check_format", "format_names"]

OURS: Final = "bootprint"
FORMATS: Final[dict[str, Format]] = {
    each.name: each for each in (COT_XML, TAK_PROTOBUF, MAVLINK2, MESHTASTIC, NMEA, VMF, DIS)
}


def format_names() -> list[str]:
    """All formats, ours first."""
    return [OURS, *FORMATS]


def check_format(name: str) -> str:
    """The name, if there is such a format; else ConfigError with the names there are."""
    names = format_names()
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}? known" if near else "known"
    raise ConfigError(f"--format {name!r}: {hint}: {', '.join(names)}")
