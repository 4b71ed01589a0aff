"""The one table of topics: what travels under which subject, how often, how carefully, and by whom.

Keys are ``{realm}/@v1/{unit}/{soldier}/{subject}/{source}``, e.g. ``bp/@v1/alpha/a3/imu/left_foot``. Zenoh's
wildcards do not match ``@v1``, so versions never mix; subscribe ``{realm}/@v1/**``. Recording, rate warnings,
quality of service and the documentation's table all derive from `TOPICS`.
"""

import re
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache

from bootprint import awareness as aware
from bootprint import messages as m
from bootprint.errors import WireError
from bootprint.foreign import ForeignTrack
from bootprint.rooms import RoomMap

VERSION = "@v1"
FRAMES = "@air1"
"""Sealed frames of radio nets that run over zenoh: ``{realm}/@air1/{net}/{number}``, no topic."""
_PART = re.compile(r"[A-Za-z0-9_.-]{1,64}\Z")


class Qos(Enum):
    """How a topic travels."""

    STREAM = "stream"  # dense samples: the newest matter, a congested bus may drop
    RECENT = (
        "recent"  # as a stream, and who comes late is told the last seconds: a restart has missed nothing
    )
    ASSURED = "assured"  # events: cached by the publisher, recovered by subscribers that missed some
    STATE = "state"  # the newest value matters, and a late joiner gets it at once


CACHED_SAMPLES = {Qos.RECENT: 160, Qos.ASSURED: 64, Qos.STATE: 1}
"""How many messages of a key its publisher keeps for who comes late: eight seconds of inertial samples."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One row of the table; ``rate_hz`` is what one source is expected to send, None for events.

    ``tolerance`` is how many times as fast or as slow (beyond once) is still as expected.
    """

    subject: str
    message: type[m.Message]
    qos: Qos
    rate_hz: float | None
    publisher: str
    recorded: bool
    meaning: str
    tolerance: float = 0.2


TOPICS: tuple[Topic, ...] = (
    Topic(
        "imu", m.ImuBatch, Qos.RECENT, 20.0, "sensor-gateway", True, "inertial samples, ~10 a message", 1.0
    ),
    Topic("pressure", m.Pressure, Qos.STREAM, 10.0, "sensor-gateway", True, "air pressure", 1.0),
    Topic("gnss", m.GnssFix, Qos.STREAM, 1.0, "sensor-gateway", True, "satellite fixes", 9.0),
    Topic("camera_motion", m.CameraMotion, Qos.STREAM, 10.0, "sensor-gateway", True, "visual odometry"),
    Topic("range", m.Range, Qos.STREAM, 1.0, "sensor-gateway", True, "ranges to feet, peers, beacons"),
    Topic("foot_step", m.FootStep, Qos.ASSURED, None, "pdr-engine", True, "stance-to-stance displacement"),
    Topic("foot_pose", m.FootPose, Qos.STREAM, 10.0, "pdr-engine", True, "pose since the last step"),
    Topic("body_step", m.BodyStep, Qos.ASSURED, None, "pdr-engine", True, "steps of the body-worn unit"),
    Topic("fix", m.Fix, Qos.ASSURED, None, "people", True, "a place given by a person"),
    Topic("position", m.Position, Qos.ASSURED, 5.0, "fusion", True, "the soldier's fused position"),
    Topic(
        "rooms",
        RoomMap,
        Qos.STATE,
        None,
        "fusion, sa-hub",
        True,
        "a soldier's map of rooms; from a hub: another's, source: who",
    ),
    Topic(
        "aim", aware.Aim, Qos.STREAM, None, "weapon sensors, tools", True, "where a soldier's weapon points"
    ),
    Topic("track", m.Track, Qos.STATE, None, "sa-hub", True, "a hub's picture of one soldier"),
    Topic("foreign_track", ForeignTrack, Qos.STATE, None, "sa-hub", True, "a unit of others, from TAK"),
    Topic("link", m.LinkReport, Qos.STATE, 1.0, "sa-hub", True, "what a radio link carried"),
    Topic("alert", m.Alert, Qos.ASSURED, None, "sa-hub", True, "alerts"),
    Topic("observation", m.Observation, Qos.ASSURED, None, "sa-hub", True, "observations"),
    Topic("status", m.Status, Qos.STATE, None, "sa-hub", True, "soldiers' condition"),
    Topic(
        "friendly_warning",
        aware.FriendlyWarning,
        Qos.STATE,
        None,
        "sa-hub",
        True,
        "a friendly is near, or in the line of a weapon; source: the friendly",
    ),
    Topic("contacts", aware.Contacts, Qos.STATE, 0.2, "sa-hub", True, "who is known to whom"),
    Topic("health", m.Health, Qos.STATE, 1.0, "all", True, "processes' state and counts"),
)
BY_SUBJECT: dict[str, Topic] = {topic.subject: topic for topic in TOPICS}
SUBJECT_OF: dict[type[m.Message], str] = {topic.message: topic.subject for topic in TOPICS}


@dataclass(frozen=True, slots=True, order=True)
class Address:
    """A key on the bus, taken apart."""

    realm: str
    unit: str
    soldier: str
    subject: str
    source: str

    @property
    def key(self) -> str:
        """The key expression, e.g. ``bp/@v1/alpha/a3/imu/left_foot``."""
        return f"{self.realm}/{VERSION}/{self.unit}/{self.soldier}/{self.subject}/{self.source}"

    @property
    def topic(self) -> Topic:
        """This address's row of the topic table."""
        return BY_SUBJECT[self.subject]

    def with_subject(self, subject: str, source: str | None = None) -> "Address":
        """The same soldier's address of another subject (and source)."""
        return replace(self, subject=subject, source=source or self.source)


@dataclass(frozen=True, slots=True)
class Identity:
    """Whose process this is: the part of the key that all its topics share."""

    realm: str
    unit: str
    soldier: str

    def __post_init__(self) -> None:
        for name in ("realm", "unit", "soldier"):
            check_part(name, getattr(self, name))

    def address(self, subject: str, source: str) -> Address:
        """The address of one of this soldier's topics."""
        if subject not in BY_SUBJECT:
            raise KeyError(f"unknown subject {subject!r}; known: {', '.join(BY_SUBJECT)}")
        return Address(self.realm, self.unit, self.soldier, subject, check_part("source", source))

    def selector(self, subject: str, source: str = "*") -> str:
        """The key expression of one subject of this soldier, all sources by default."""
        return f"{self.realm}/{VERSION}/{self.unit}/{self.soldier}/{subject}/{source}"


def check_part(name: str, value: str) -> str:
    """Return ``value`` if it can stand between two slashes of a key; ValueError if not."""
    if not _PART.match(value):
        raise ValueError(f"{name} {value!r} must be 1 to 64 letters, digits, '_', '-' or '.'")
    return value


@lru_cache(maxsize=4096)
def parse_key(key: str) -> Address:
    """Take a key apart; WireError if it is not of this version or names an unknown subject."""
    parts = key.split("/")
    if len(parts) != 6 or parts[1] != VERSION:
        raise WireError(f"key {key!r} is not realm/{VERSION}/unit/soldier/subject/source")
    realm, _, unit, soldier, subject, source = parts
    if subject not in BY_SUBJECT:
        raise WireError(f"key {key!r} has the unknown subject {subject!r}")
    if not all(map(_PART.match, (realm, unit, soldier, source))):
        raise WireError(f"key {key!r} has a part that is not 1 to 64 letters, digits, '_', '-' or '.'")
    return Address(realm, unit, soldier, subject, source)
