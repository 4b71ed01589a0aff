"""What of an archive is exported: a span of time and some soldiers, as segments of tracks and as marked places."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from heapq import merge
from typing import Final
from xml.sax.saxutils import escape

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.display import AGES
from bootprint.messages import Alert, Message, Observation, Track
from sa_hub.history.archive import Archive

Advance = Callable[[], None]
MARKED: Final = ("alert", "observation")
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Source:
    """An archive, the span ``begin_ns <= time < end_ns`` and the soldiers to export: everyone if none are named.

    ``advance`` is called for each message read.
    """

    archive: Archive
    begin_ns: int
    end_ns: int
    soldiers: tuple[str, ...] = ()
    advance: Advance = field(default=lambda: None)

    def everyone(self) -> list[str]:
        """The soldiers to export, in order."""
        return sorted(self.soldiers) or self.archive.soldiers()

    def messages(self, *subjects: str) -> Iterator[Envelope]:
        """The messages of these subjects about the wanted soldiers, in order of time."""
        streams = (self.archive.messages(subject, self.begin_ns, self.end_ns) for subject in subjects)
        for envelope in merge(*streams, key=lambda each: each.message.time_ns):
            self.advance()
            about: str = getattr(envelope.message, "soldier", envelope.address.soldier)
            if not self.soldiers or about in self.soldiers:
                yield envelope

    def segments(self, soldier: str) -> Iterator[list[Track]]:
        """A soldier's tracks, cut where nothing was heard for as long as makes one lost."""
        segment: list[Track] = []
        for track in self._tracks(soldier):
            if segment and track.time_ns - segment[-1].time_ns >= AGES.lost_ns:
                yield segment
                segment = []
            if not segment or track.time_ns > segment[-1].time_ns:
                segment.append(track)
        if segment:
            yield segment

    def _tracks(self, soldier: str) -> Iterator[Track]:
        for envelope in self.archive.messages("track", self.begin_ns, self.end_ns, soldier):
            self.advance()
            if isinstance(envelope.message, Track):
                yield envelope.message

    def places(self) -> Iterator["Place"]:
        """Observations where they are, and alerts where their soldier was then believed to be."""
        for envelope in self.messages(*MARKED):
            place = self._place(envelope.message)
            if place is not None:
                yield place

    def _place(self, message: Message) -> "Place | None":
        match message:
            case Observation():
                name = " ".join(filter(None, (message.code, message.text))) or "observation"
                return Place(
                    message.time_ns, message.soldier, name, message.latitude_deg, message.longitude_deg
                )
            case Alert():
                track = self._track_at(message.soldier, message.time_ns)
                if track is not None:
                    name = f"{message.kind} {message.text}".strip()
                    return Place(
                        message.time_ns, message.soldier, name, track.latitude_deg, track.longitude_deg
                    )
        return None

    def _track_at(self, soldier: str, time_ns: int) -> Track | None:
        """Where a soldier was last known to be."""
        known = (each.message for each in self.archive.picture_at(time_ns))
        return next((each for each in known if isinstance(each, Track) and each.soldier == soldier), None)


@dataclass(frozen=True, slots=True)
class Place:
    """Something marked on the map: by whom, when and what."""

    time_ns: int
    soldier: str
    name: str
    latitude_deg: float
    longitude_deg: float


def utc(time_ns: int) -> str:
    """A time as all formats here write it, to the microsecond."""
    text = f"{_EPOCH + timedelta(microseconds=time_ns // 1000):%Y-%m-%dT%H:%M:%S.%f}"
    return f"{text.rstrip('0').rstrip('.')}Z"


def seconds_ns(time: datetime) -> int:
    """UTC ns of a time that was given without a zone."""
    return round((time.replace(tzinfo=UTC) - _EPOCH).total_seconds()) * NS_PER_S


def xml_text(text: str) -> str:
    """Text as XML may hold it: control characters are none."""
    return escape("".join(character for character in text if character.isprintable()))


def named(tracks: list[Track]) -> str:
    """What to call the soldier of these tracks."""
    return tracks[-1].callsign or tracks[-1].soldier
