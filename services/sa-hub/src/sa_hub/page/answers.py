"""What each request of the page's interface does, and the structs that it answers with."""

import json
from typing import Any, cast

import msgspec

from bootprint.messages import Message, Track
from sa_hub.page import geojson
from sa_hub.page.asking import Ask, Refused
from sa_hub.page.basemap import BasemapKind, kind_of
from sa_hub.page.desk import Desk
from sa_hub.page.geojson import FeatureCollection
from sa_hub.page.operations import ALERT_KINDS, CODES
from sa_hub.page.rooms import rooms_layer
from sa_hub.page.settings import Role
from sa_hub.page.views import (
    AlertView,
    ForeignView,
    HealthView,
    LinkView,
    ObservationView,
    RoomsView,
    SoldierView,
    StatusView,
    TrackView,
    UtcSeconds,
    View,
    WarningView,
    seconds,
    soldier_view,
    view_of,
)


class PostView(msgspec.Struct, kw_only=True, frozen=True):
    """The command post: ``now_s`` of event time runs ``speed`` times as fast as the host's clock."""

    realm: str
    soldier: str
    origin_deg: tuple[float, float]
    now_s: UtcSeconds
    speed: float
    stale_s: float
    lost_s: float
    has_plan: bool
    basemap: BasemapKind | None
    has_history: bool
    alert_kinds: tuple[str, ...]
    codes: tuple[str, ...]
    who: str
    role: Role


class PictureView(msgspec.Struct, kw_only=True, frozen=True):
    """The picture, or what is new in it since the revision before; views by key."""

    now_s: UtcSeconds
    revision: int = 0
    tracks: dict[str, TrackView] = {}
    foreign: dict[str, ForeignView] = {}
    statuses: dict[str, StatusView] = {}
    alerts: dict[str, AlertView] = {}
    observations: dict[str, ObservationView] = {}
    links: dict[str, LinkView] = {}
    health: dict[str, HealthView] = {}
    warnings: dict[str, WarningView] = {}
    rooms: dict[str, RoomsView] = {}


class Fixed(msgspec.Struct, kw_only=True, frozen=True):
    """``told``: the soldier's own computer hears it; else the place is in this hub's picture alone."""

    soldier: str
    told: bool


class Acknowledged(msgspec.Struct, kw_only=True, frozen=True):
    """Who has seen an alert first."""

    id: str
    acknowledged_by: str


class AuditRow(msgspec.Struct, kw_only=True, frozen=True):
    """One change."""

    time_s: UtcSeconds
    who: str
    client: str
    change: str
    outcome: int
    asked: Any = None


# -- now --------------------------------------------------------------------------------------------------------


def post(desk: Desk, ask: Ask) -> PostView:
    """The command post and what it has to offer."""
    origin = desk.post.realm.origin
    return PostView(
        realm=desk.post.realm.id,
        soldier=desk.post.member.id,
        origin_deg=(origin.latitude_deg, origin.longitude_deg),
        now_s=seconds(desk.post.now_ns()),
        speed=desk.post.speed,
        stale_s=seconds(desk.post.ages.stale_ns),
        lost_s=seconds(desk.post.ages.lost_ns),
        has_plan=desk.plan is not None,
        basemap=None if desk.basemap is None else kind_of(desk.basemap),
        has_history=desk.archive is not None,
        alert_kinds=ALERT_KINDS,
        codes=CODES,
        who=ask.who.name,
        role=ask.who.role,
    )


def roster(desk: Desk, _ask: Ask) -> list[SoldierView]:
    """Everybody, by number."""
    return [soldier_view(member) for _, member in sorted(desk.post.realm.by_number().items())]


def picture(desk: Desk, _ask: Ask) -> PictureView:
    """Everything."""
    return news(desk, -1)


def news(desk: Desk, revision: int) -> PictureView:
    """What came after a revision."""
    changes: dict[str, Any] = dict(desk.picture.since(revision))
    return PictureView(now_s=seconds(desk.post.now_ns()), revision=desk.picture.revision, **changes)


def soldiers(desk: Desk, _ask: Ask) -> FeatureCollection:
    """Everybody where they are believed to be."""
    return geojson.soldiers(desk.tracks.values(), desk.post.now_ns(), desk.post.ages)


def observations(desk: Desk, _ask: Ask) -> FeatureCollection:
    """All that is shown."""
    return geojson.observations(
        cast("list[ObservationView]", list(desk.picture.all("observations").values()))
    )


def rooms(desk: Desk, _ask: Ask) -> FeatureCollection:
    """Everybody's maps."""
    return rooms_layer(desk.rooms.values(), desk.post.realm.origin)


def plan(desk: Desk, _ask: Ask) -> Any:
    """The file as it stands."""
    if desk.plan is None:
        return FeatureCollection(features=[])
    try:
        return json.loads(desk.plan.read_bytes())
    except (OSError, ValueError) as error:
        raise Refused(500, f"{desk.plan.name} cannot be read: {error}") from error


# -- changes ----------------------------------------------------------------------------------------------------


def alert(desk: Desk, ask: Ask) -> View:
    """Alert everybody."""
    return _kept(desk, desk.post.alert(ask.body))


def acknowledge(desk: Desk, ask: Ask) -> Acknowledged:
    """An alert has been seen."""
    seen = desk.picture.acknowledge(ask.path["id"], ask.who.name)
    if seen is None:
        raise Refused(404, f"no alert {ask.path['id']!r} is shown")
    return Acknowledged(id=seen.id, acknowledged_by=seen.acknowledged_by or ask.who.name)


def observe(desk: Desk, ask: Ask) -> View:
    """A thing seen."""
    _must_say_something(ask)
    return _kept(desk, desk.post.observe(ask.body))


def sight(desk: Desk, ask: Ask) -> View:
    """A thing seen from a soldier."""
    _must_say_something(ask)
    return _kept(desk, desk.post.sight(ask.body, _track(desk, ask.body.soldier)))


def status(desk: Desk, ask: Ask) -> View:
    """How the command post is."""
    return _kept(desk, desk.post.tell_status(ask.body))


def fix(desk: Desk, ask: Ask) -> Fixed:
    """Where a soldier is."""
    member = desk.post.of(ask.body.soldier)
    if member is None:
        raise Refused(404, f"no soldier {ask.body.soldier!r} in the roster")
    return Fixed(soldier=member.id, told=desk.post.fix(ask.body, member))


def audit(desk: Desk, _ask: Ask) -> list[AuditRow]:
    """The newest two hundred changes."""
    return msgspec.convert(desk.audit.newest(200), list[AuditRow])


def _must_say_something(ask: Ask) -> None:
    if ask.body.code is None and not ask.body.text:
        raise Refused(422, "an observation needs a code or a text")


def _track(desk: Desk, soldier: str) -> Track:
    track = desk.tracks.get(soldier)
    if track is None:
        raise Refused(404, f"nobody knows where {soldier!r} is")
    return track


def _kept(desk: Desk, message: Message) -> View:
    """What was published, as a view: it is on the disk before anybody is told that it was done."""
    envelope = desk.post.own(message)
    desk.keep(envelope)
    found = view_of(envelope)
    assert found is not None, "every message that the page publishes has a view"
    return found[2]
