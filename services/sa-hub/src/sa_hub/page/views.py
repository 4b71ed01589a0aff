"""What the page's interface says of messages: plain structs for JSON, times in UTC seconds, units in the names.

The interface's description (OpenAPI) is made of these structs, so they are its one definition.
"""

from typing import Annotated, Any

import msgspec

from bootprint.awareness import FriendlyWarning
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.config import Member
from bootprint.foreign import ForeignTrack
from bootprint.messages import Alert, Health, LinkReport, Message, Observation, Status, Track
from bootprint.rooms import RoomMap

UtcSeconds = Annotated[float, msgspec.Meta(description="UTC seconds since 1970, of event time")]


class View(msgspec.Struct, kw_only=True, frozen=True):
    """What all views carry: the event's time."""

    time_s: UtcSeconds


class SoldierView(msgspec.Struct, kw_only=True, frozen=True):
    """A line of the roster."""

    soldier: str
    number: int
    unit: str
    callsign: str
    role: str


class TrackView(View, frozen=True):
    """What the hub knows of a soldier; ``time_s`` is the time of the position, ``accuracy_m`` its one sigma."""

    soldier: str
    state: str
    latitude_deg: float
    longitude_deg: float
    height_m: float | None
    accuracy_m: float
    east_velocity_m_s: float
    north_velocity_m_s: float
    mode: str
    floor: int | None
    via: str
    hops: int
    received_s: float | None
    held_m: float | None
    held_s: float | None
    facing_rad: float | None


class ForeignView(View, frozen=True):
    """A unit of another system (TAK), to be doubted from ``stale_s`` on."""

    uid: str
    callsign: str | None
    affiliation: str
    cot_type: str
    latitude_deg: float
    longitude_deg: float
    accuracy_m: float | None
    course_rad: float | None
    speed_m_s: float | None
    stale_s: UtcSeconds


class AlertView(View, frozen=True):
    """Something that must be seen now; ``acknowledged_by`` is who has seen it on a page."""

    id: str
    soldier: str
    kind: str
    text: str
    acknowledged_by: str | None = None


class ObservationView(View, frozen=True):
    """A thing seen, with its place."""

    id: str
    soldier: str
    latitude_deg: float
    longitude_deg: float
    accuracy_m: float
    text: str
    code: str | None


class StatusView(View, frozen=True):
    """How a soldier is."""

    soldier: str
    condition: str
    battery_pct: float | None


class LinkView(View, frozen=True):
    """What a radio link carries, and by soldier the age of the net's news and the error that receivers see."""

    link: str
    budget_bits_per_s: float
    bits_per_s: float
    frames_sent: int
    frames_received: int
    frames_rejected: int
    frames_lost: int
    airtime_share: float | None
    duty_left_s: float | None
    drops: dict[str, int]
    ages_s: dict[str, float]
    expected_errors_m: dict[str, float | None]


class HealthView(View, frozen=True):
    """How a process is."""

    soldier: str
    service: str
    state: str
    note: str
    counters: dict[str, int]
    gauges: dict[str, float]


class WarningView(View, frozen=True):
    """A friendly is near the command post, or in a line; no reasons: it is over."""

    friendly: str
    reasons: tuple[str, ...]
    distance_m: float
    probability_pct: float


class RoomsView(View, frozen=True):
    """That a soldier's map of rooms is there, or has grown; what is in it: ``rooms.geojson``."""

    soldier: str
    floors: tuple[int, ...]


def seconds(time_ns: int) -> float:
    """Nanoseconds as seconds; at today's UTC good to a quarter of a microsecond."""
    return time_ns / NS_PER_S


def soldier_view(member: Member) -> SoldierView:
    """A roster's line."""
    return SoldierView(
        soldier=member.id,
        number=member.number,
        unit=member.unit,
        callsign=member.callsign or member.id,
        role=member.role,
    )


def track_view(track: Track) -> TrackView:
    """A track as the interface tells it."""
    received_s = None if track.received_ns is None else seconds(track.received_ns)
    return TrackView(received_s=received_s, **_alike(track, TrackView, "received_s"))


def event_id(message: Alert | Observation) -> str:
    """Names an event: the same event has the same name however often it is heard."""
    return f"{message.soldier}-{message.time_ns}"


def view_of(envelope: Envelope) -> tuple[str, str, View] | None:
    """The kind, the key within it and the view of a message; None if the page does not show such a message."""
    message = envelope.message
    match message:
        case Track():
            return "tracks", message.soldier, track_view(message)
        case ForeignTrack():
            stale_s = seconds(message.stale_ns)
            return (
                "foreign",
                message.uid,
                ForeignView(stale_s=stale_s, **_alike(message, ForeignView, "stale_s")),
            )
        case Alert():
            found = AlertView(id=event_id(message), **_alike(message, AlertView, "id", "acknowledged_by"))
            return "alerts", found.id, found
        case Observation():
            seen = ObservationView(id=event_id(message), **_alike(message, ObservationView, "id"))
            return "observations", seen.id, seen
        case Status():
            return "statuses", message.soldier, StatusView(**_alike(message, StatusView))
        case LinkReport():
            return "links", message.link, LinkView(**_alike(message, LinkView))
        case FriendlyWarning():
            return "warnings", message.friendly, WarningView(**_alike(message, WarningView))
        case RoomMap():
            floors = tuple(floor for floor, _ in message.levels)
            return "rooms", message.soldier, RoomsView(floors=floors, **_alike(message, RoomsView, "floors"))
        case Health():
            soldier = envelope.address.soldier
            health = HealthView(soldier=soldier, **_alike(message, HealthView, "soldier"))
            return "health", f"{soldier}/{message.service}", health
        case _:
            return None


def _alike(message: Message, view: type[View], *others: str) -> dict[str, Any]:
    """The values of all fields that a message and its view share, and the time."""
    names = (name for name in view.__struct_fields__ if name != "time_s" and name not in others)
    return {"time_s": seconds(message.time_ns)} | {name: getattr(message, name) for name in names}
