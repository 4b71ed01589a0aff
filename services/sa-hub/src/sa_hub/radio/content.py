"""What a frame can say, in physical units: reports of soldiers, alerts, observations, status."""

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeVar, get_args

from bootprint.messages import Mode, ObservationCode
from sa_hub.radio.control import Acknowledgement, Fragment, Request
from sa_hub.radio.layout import FAR_BITS, NEAR_BITS

AlertKind = Literal["contact", "casualty", "help", "fire", "withdraw", "other"]
Condition = Literal["ok", "busy", "wounded", "out"]
ALERT_KINDS: Final[tuple[AlertKind, ...]] = get_args(AlertKind)
CONDITIONS: Final[tuple[Condition, ...]] = get_args(Condition)
OBSERVATION_CODES: Final[tuple[ObservationCode, ...]] = get_args(ObservationCode)
"""In the order of their numbers on the air, from 1; new ones are added at the end, at most 63 in all."""
MAX_HOPS: Final = 3
MAX_TEXT_CHARACTERS: Final = 200
MAX_TEXT_BYTES: Final = 255


@dataclass(frozen=True, slots=True)
class Report:
    """Where one soldier was at ``time_ns``; velocity is east and north, accuracy one sigma, height ellipsoidal.

    ``hops`` counts the relays it passed. ``cell_m`` is the edge of the lattice cell that a frame rounded the
    position to, 0 for a position that has not travelled. ``facing_deg``: where the body faces, clockwise from true
    north; frames tell it of who stands.
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
    facing_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Feedback:
    """Which frames of sender ``about`` were heard: the ``newest``, a counter or its low bits, and some before.

    ``heard`` has a bit for each of the ``span`` counters before the newest, bit 0 for the one right before it.
    """

    about: int
    newest: int
    span: int
    heard: int


@dataclass(frozen=True, slots=True)
class Quality:
    """What changes seldom about a soldier, as codes of the layout: accuracy, mode, hops, condition."""

    accuracy: int
    mode: int
    hops: int
    condition: int


@dataclass(frozen=True, slots=True)
class Level:
    """Floor and height, whole metres (modulo 256 when read from a frame); None where unknown."""

    floor: int | None
    height_m: int | None


@dataclass(frozen=True, slots=True)
class Facing:
    """Where the body faces, as a code of the layout; None where that is unknown."""

    direction: int | None


@dataclass(frozen=True, slots=True)
class Entry:
    """One soldier in an update: row and column (told modulo), velocity codes or None, what has changed."""

    number: int
    row: int
    column: int
    velocity: tuple[int, int] | None
    age_ticks: int = 0
    quality: Quality | None = None
    level: Level | None = None
    facing: Facing | None = None
    far: bool = False
    steady: bool = False


@dataclass(frozen=True, slots=True)
class Update:
    """Soldiers told against what receivers predict: rows and columns of ``resolution`` modulo 2^``reach_bits``.

    Whoever missed no more than ``misses`` of the sender's frames since it last heard of a soldier can resolve that
    entry. ``tick`` is the frame's time, modulo 256 when it is read from a frame. ``varied``: entries that are
    ``far`` have more low bits and others fewer, and those that are ``steady`` tell no velocity.
    """

    tick: int
    resolution: int
    reach_bits: int
    misses: int
    entries: tuple[Entry, ...]
    feedback: Feedback | None = None
    varied: bool = False

    def reach_of(self, entry: Entry) -> int:
        """How many low bits of row and column the entry tells."""
        return self.reach_bits + self.varied * (FAR_BITS if entry.far else NEAR_BITS)


@dataclass(frozen=True, slots=True)
class Reports:
    """Reports of one or many soldiers in one frame, of the time ``tick`` (the newest report's if None)."""

    reports: tuple[Report, ...]
    feedback: Feedback | None = None
    tick: int | None = None


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
    """A thing that soldier ``number`` saw, with its place; ``code`` None: the text tells what it is."""

    number: int
    time_ns: int
    latitude_deg: float
    longitude_deg: float
    accuracy_m: float
    text: str = ""
    hops: int = 0
    code: ObservationCode | None = None


@dataclass(frozen=True, slots=True)
class StatusNotice:
    """How soldier ``number`` is."""

    number: int
    time_ns: int
    condition: Condition
    battery_pct: float | None = None
    hops: int = 0


Notice = AlertNotice | ObservationNotice | StatusNotice
Content = Reports | Update | Feedback | Notice | Acknowledgement | Request | Fragment
Relayable = TypeVar("Relayable", bound=Report | AlertNotice | ObservationNotice | StatusNotice)


def one_hop_on(item: Relayable) -> Relayable:
    """The same as it goes out from a relay."""
    return replace(item, hops=item.hops + 1)


def cut_text(text: str, limit_bytes: int) -> str:
    """``text`` cut to what fits a frame (200 characters, 255 bytes, ``limit_bytes``), between characters."""
    cut = text[:MAX_TEXT_CHARACTERS].encode("utf-8", "replace")[: max(0, min(limit_bytes, MAX_TEXT_BYTES))]
    return cut.decode("utf-8", "ignore")
