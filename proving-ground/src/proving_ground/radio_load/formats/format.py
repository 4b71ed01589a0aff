"""What a format of others is here: when a device speaks, what bytes it says, what a receiver makes of them.

Whose message it is the radio knows, so identity costs only those bytes that the format spends on it anyway.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from proving_ground.radio_load.load import Load
from proving_ground.radio_load.picture_error import Moving, stay


class Moment(NamedTuple):
    """What a soldier's device knows: stamp s from the tracks' zero, place m and smoothed velocity m/s, ENU."""

    time_s: float
    east_m: float
    north_m: float
    up_m: float
    east_m_s: float
    north_m_s: float


class Place(NamedTuple):
    """The same for an encoder: soldier's number, UTC ns, WGS84 (ellipsoidal height), velocity m/s."""

    number: int
    time_ns: int
    latitude_deg: float
    longitude_deg: float
    height_m: float
    east_m_s: float
    north_m_s: float


class Shown(NamedTuple):
    """What a receiver reads; ``time_ns`` is None if the message does not tell the position's time."""

    time_ns: int | None
    latitude_deg: float
    longitude_deg: float
    east_m_s: float = 0.0
    north_m_s: float = 0.0


class Rule(Protocol):
    """When one soldier's device speaks."""

    def due(self, moment: Moment) -> bool:
        """Whether it speaks now; asked at every position, and taken to speak when it says so."""
        ...  # pragma: no cover


@dataclass(frozen=True)
class Format:
    """One of others' formats. ``rule`` makes the rule of a soldier's number; ``moving`` is what receivers do
    between reports; ``source`` tells where rule and bytes come from."""

    name: str
    title: str
    rule: Callable[[Load, int], Rule]
    encode: Callable[[Place], bytes]
    decode: Callable[[bytes], Shown]
    source: str
    moving: Moving = stay
