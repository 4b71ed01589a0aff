"""What a frame can say, in physical units: reports of soldiers, alerts, observations, status."""

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeVar, get_args

from bootprint.messages import Mode

AlertKind = Literal["contact", "casualty", "help", "fire", "withdraw", "other"]
Condition = Literal["ok", "busy", "wounded", "out"]
ALERT_KINDS: Final[tuple[AlertKind, ...]] = get_args(AlertKind)
CONDITIONS: Final[tuple[Condition, ...]] = get_args(Condition)
MAX_HOPS: Final = 3
MAX_TEXT_CHARACTERS: Final = 200
MAX_TEXT_BYTES: Final = 255


@dataclass(frozen=True, slots=True)
class Report:
    """Where one soldier was at ``time_ns``; velocity is east and north, accuracy one sigma, height ellipsoidal.

    ``hops`` counts the relays it passed. ``cell_m`` is the edge of the lattice cell that a frame rounded the
    position to, 0 for a position that has not travelled.
    """

    number: int
    time_ns: int
    latitude_deg: float
    longitude_deg: float
    accuracy_m: float
    east_m_s: float = 0.0
    north_m_s: float = 0.0
    height_m: float | None = None
    mode: Mode = "boots"
    floor: int | None = None
    condition: Condition = "ok"
    hops: int = 0
    cell_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Reports:
    """Reports of one or many soldiers in one frame."""

    reports: tuple[Report, ...]


@dataclass(frozen=True, slots=True)
class AlertNotice:
    """An alert of soldier ``number``."""

    number: int
    time_ns: int
    kind: AlertKind
    text: str = ""
    hops: int = 0


@dataclass(frozen=True, slots=True)
class ObservationNotice:
    """A thing that soldier ``number`` saw, with its place."""

    number: int
    time_ns: int
    latitude_deg: float
    longitude_deg: float
    accuracy_m: float
    text: str = ""
    hops: int = 0


@dataclass(frozen=True, slots=True)
class StatusNotice:
    """How soldier ``number`` is."""

    number: int
    time_ns: int
    condition: Condition
    battery_pct: float | None = None
    hops: int = 0


Notice = AlertNotice | ObservationNotice | StatusNotice
Content = Reports | Notice
Relayable = TypeVar("Relayable", bound=Report | AlertNotice | ObservationNotice | StatusNotice)


def one_hop_on(item: Relayable) -> Relayable:
    """The same as it goes out from a relay."""
    return replace(item, hops=item.hops + 1)


def cut_text(text: str, limit_bytes: int) -> str:
    """``text`` cut to what fits a frame (200 characters, 255 bytes, ``limit_bytes``), between characters."""
    cut = text[:MAX_TEXT_CHARACTERS].encode("utf-8", "replace")[: max(0, min(limit_bytes, MAX_TEXT_BYTES))]
    return cut.decode("utf-8", "ignore")
