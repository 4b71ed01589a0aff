"""What others tell by Cursor on Target, as messages of our bus.

Units become foreign tracks. What a person has put on the map (``how`` "h-…") as hostile, neutral or unknown, points
on the map and emergencies become observations. A point or a friend is never given as something to be shot at.
"""

import hashlib
import math
import re
from collections import Counter, OrderedDict
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.foreign import Affiliation, ForeignTrack
from bootprint.messages import Message, Observation, ObservationCode
from bootprint.topics import SUBJECT_OF, Identity
from sa_hub.tak.event import CotError, CotEvent, from_xml
from sa_hub.tak.protobuf import MAGIC, from_protobuf
from sa_hub.tak.squad import uid_prefix

_AFFILIATIONS: Final[dict[str, Affiliation]] = {
    "f": "friend",
    "a": "friend",
    "h": "hostile",
    "s": "hostile",
    "j": "hostile",
    "k": "hostile",
    "n": "neutral",
}
_CODES: Final[tuple[tuple[str, ObservationCode], ...]] = (
    ("a-h-G-U-C-I", "infantry"),
    ("a-h-G-U-C-A", "armour"),
    ("a-h-G-U-C-F", "artillery"),
    ("a-h-G-E-V-A", "armour"),
    ("a-h-G-E-V", "vehicle"),
    ("a-h-G-E-X-I", "ied"),
    ("a-h-G-E-X-M", "mine"),
    ("a-h-A-M-F-Q", "drone"),
    ("a-h-A", "aircraft"),
    ("a-n", "civilian"),
    ("b-m-p-w-GOTO", "rally_point"),
    ("b-m-p", "route"),
    ("b-a-o", "casualty"),
    ("b-r-f-h-c", "casualty"),
)
_CANCELLED: Final = "b-a-o-can"
_UNKNOWN_ACCURACY_M: Final = 50.0
_LEAST_INTERVAL_NS: Final = NS_PER_S
_REMEMBERED: Final = 4096
_PART: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}\Z")
_SOURCE: Final = "tak"
_LONGEST: Final = 200


class Foreigners:
    """Reads events, at most one a second of each uid; a marker is told again only when it has changed.

    ``counters``: what was refused as malformed, what is our own come back, what came too often, and of what is no
    use here. ``observer``: whose observations markers are; the hub's own soldier's go to the squad by radio.
    """

    def __init__(self, identity: Identity, observer: str) -> None:
        self.counters: Counter[str] = Counter(
            refused=0, own=0, too_often=0, no_use=0, tracks=0, observations=0
        )
        self._identity = identity
        self._observer = observer
        self._own = uid_prefix(identity.realm)
        self._seen: OrderedDict[str, tuple[int, CotEvent]] = OrderedDict()

    def hear(self, data: bytes, now_ns: int) -> Envelope | None:
        """What an event, XML or protobuf, means for us; anything may be in it."""
        try:
            event = from_protobuf(data) if data.startswith(MAGIC) else from_xml(data)
        except CotError:
            self.counters["refused"] += 1
            return None
        if event.uid.startswith(self._own):
            self.counters["own"] += 1
            return None
        return self._fresh(event, now_ns)

    def _fresh(self, event: CotEvent, now_ns: int) -> Envelope | None:
        message = self._message(event)
        if message is None:
            self.counters["no_use"] += 1
            return None
        if self._is_repeated(event, message, now_ns):
            self.counters["too_often"] += 1
            return None
        self.counters["tracks" if isinstance(message, ForeignTrack) else "observations"] += 1
        source = source_of(event.uid) if isinstance(message, ForeignTrack) else _SOURCE
        return Envelope(self._identity.address(SUBJECT_OF[type(message)], source), message)

    def _is_repeated(self, event: CotEvent, message: Message, now_ns: int) -> bool:
        before = self._seen.pop(event.uid, None)
        if before is not None:
            at_ns, earlier = before
            is_same = isinstance(message, Observation) and _marked(event) == _marked(earlier)
            if is_same or 0 <= now_ns - at_ns < _LEAST_INTERVAL_NS:
                self._seen[event.uid] = before
                return True
        self._seen[event.uid] = now_ns, event
        if len(self._seen) > _REMEMBERED:
            self._seen.popitem(last=False)
        return False

    def _message(self, event: CotEvent) -> Message | None:
        code = _code(event.type)
        is_marker = event.how.startswith("h") and affiliation_of(event.type) != "friend"
        if event.type.startswith("a-"):
            return self._observation(event, code) if is_marker else foreign_track(event)
        return None if code is None or event.type == _CANCELLED else self._observation(event, code)

    def _observation(self, event: CotEvent, code: ObservationCode | None) -> Observation:
        words = filter(None, (event.detail("contact", "callsign"), event.remarks))
        return Observation(
            time_ns=event.time_ns,
            soldier=self._observer,
            latitude_deg=event.latitude_deg,
            longitude_deg=event.longitude_deg,
            accuracy_m=_UNKNOWN_ACCURACY_M if event.ce_m is None else event.ce_m,
            text=": ".join(words)[:_LONGEST],
            code=code,
        )


def foreign_track(event: CotEvent) -> ForeignTrack:
    """A unit as it is told."""
    speed_m_s = _number(event.detail("track", "speed"))
    course_deg = _number(event.detail("track", "course"))
    return ForeignTrack(
        time_ns=event.time_ns,
        uid=event.uid,
        affiliation=affiliation_of(event.type),
        cot_type=event.type,
        how=event.how,
        latitude_deg=event.latitude_deg,
        longitude_deg=event.longitude_deg,
        stale_ns=event.stale_ns,
        callsign=_text(event.detail("contact", "callsign")),
        team=_text(event.detail("__group", "name")),
        role=_text(event.detail("__group", "role")),
        height_m=event.hae_m,
        accuracy_m=event.ce_m,
        course_rad=None if course_deg is None else math.radians(course_deg % 360.0),
        speed_m_s=None if speed_m_s is None or speed_m_s < 0.0 else speed_m_s,
        exercise=event.opex.startswith("e"),
    )


def affiliation_of(cot_type: str) -> Affiliation:
    """Whose side an atom is on, by its second letter."""
    return _AFFILIATIONS.get(cot_type[2:3] if cot_type.startswith("a-") else "", "unknown")


def source_of(uid: str) -> str:
    """The uid as the last part of a key; one that cannot stand there by its digest."""
    return uid if _PART.match(uid) else f"uid-{hashlib.sha256(uid.encode()).hexdigest()[:16]}"


def _code(cot_type: str) -> ObservationCode | None:
    """What a marker means: suspects and other enemies like hostiles."""
    if affiliation_of(cot_type) == "hostile":
        cot_type = f"a-h{cot_type[3:]}"
    return next((code for prefix, code in _CODES if cot_type.startswith(prefix)), None)


def _marked(event: CotEvent) -> tuple[object, ...]:
    return (
        event.type,
        event.latitude_deg,
        event.longitude_deg,
        event.remarks,
        event.detail("contact", "callsign"),
    )


def _text(text: str | None) -> str | None:
    return None if text is None else text[:_LONGEST]


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) else None
