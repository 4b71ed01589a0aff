"""What a soldier types at the watch, as messages: ``alert help``, ``status wounded 40``, ``seen vehicle 90 200``,
``here 59.35 18.07 90``."""

import math
from collections.abc import Callable, Sequence
from typing import Final

import msgspec

from bootprint.errors import ConfigError
from bootprint.geodesy import moved_place
from bootprint.messages import Alert, Fix, Message, Observation, Status

USAGE: Final = {
    "alert": "alert KIND [TEXT] — contact, casualty, help, fire, withdraw, other",
    "status": "status ok|busy|wounded|out [BATTERY %]",
    "seen": "seen CODE AZIMUTH° RANGE_M [TEXT] — infantry, vehicle, sniper, ied, casualty, …",
    "here": "here LAT LON [FACING°] — where you are",
}
_AZIMUTH_SIGMA_RAD: Final = math.radians(5.0)
_RANGE_SIGMA: Final = 0.05
_FACING_SIGMA_RAD: Final = math.radians(10.0)
_FIX_ACCURACY_M: Final = 3.0


def message_of(line: str, soldier: str, place: tuple[float, float] | None, now_ns: int) -> Message:
    """The message of a typed line; ConfigError says how it is to be typed. ``place``: our latitude, longitude."""
    word, *rest = line.split() or [""]
    if word not in _MAKERS:
        raise ConfigError(f"want one of: {', '.join(USAGE)}")
    try:
        values = _MAKERS[word](rest, place)
        type_ = _TYPES[word]
        own = {} if type_ is Fix else {"soldier": soldier}
        return msgspec.convert({"time_ns": now_ns, **own, **values}, type_)
    except (ValueError, IndexError, msgspec.ValidationError) as error:
        raise ConfigError(f"{error or 'too few words'}; want: {USAGE[word]}") from error


def _alert(words: Sequence[str], _place: tuple[float, float] | None) -> dict[str, object]:
    return {"kind": words[0], "text": " ".join(words[1:])}


def _status(words: Sequence[str], _place: tuple[float, float] | None) -> dict[str, object]:
    return {"condition": words[0], "battery_pct": float(words[1]) if len(words) > 1 else None}


def _seen(words: Sequence[str], place: tuple[float, float] | None) -> dict[str, object]:
    """By bearing and range from where we are; the worse direction's sigma counts."""
    if place is None:
        raise ValueError("nobody knows where you are")
    azimuth_rad, range_m = math.radians(float(words[1])), float(words[2])
    if not 0.0 <= range_m <= 20_000.0:
        raise ValueError(f"{range_m:g} m is no range")
    latitude, longitude = moved_place(place, range_m * math.sin(azimuth_rad), range_m * math.cos(azimuth_rad))
    accuracy_m = max(1.0, range_m * max(_AZIMUTH_SIGMA_RAD, _RANGE_SIGMA))
    return {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "accuracy_m": accuracy_m,
        "code": words[0],
        "text": " ".join(words[3:]),
    }


def _here(words: Sequence[str], _place: tuple[float, float] | None) -> dict[str, object]:
    values: dict[str, object] = {
        "latitude_deg": float(words[0]),
        "longitude_deg": float(words[1]),
        "accuracy_m": _FIX_ACCURACY_M,
    }
    if len(words) > 2:
        values["azimuth_rad"] = math.radians(float(words[2]) % 360.0)
        values["azimuth_sigma_rad"] = _FACING_SIGMA_RAD
    return values


_MAKERS: Final[dict[str, Callable[[Sequence[str], tuple[float, float] | None], dict[str, object]]]] = {
    "alert": _alert,
    "status": _status,
    "seen": _seen,
    "here": _here,
}
_TYPES: Final[dict[str, type[Message]]] = {
    "alert": Alert,
    "status": Status,
    "seen": Observation,
    "here": Fix,
}
