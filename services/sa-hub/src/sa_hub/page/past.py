"""What the page's interface says of the past, by the hub's archive: pictures, trails, events, exports."""

import math
import os
import tempfile
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import msgspec

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.messages import Track
from sa_hub.page import geojson
from sa_hub.page.answers import PictureView
from sa_hub.page.asking import Ask, Refused
from sa_hub.page.desk import Desk
from sa_hub.page.geojson import Trails
from sa_hub.page.views import UtcSeconds, View, seconds, view_of

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

MOST_POINTS: Final = 50_000
_LONGEST_S: Final = 7 * 86_400.0


class History(msgspec.Struct, kw_only=True, frozen=True):
    """From when to when there is something in the archive; nothing while it is empty or not kept."""

    kept: bool
    begin_s: UtcSeconds | None = None
    end_s: UtcSeconds | None = None


@dataclass(frozen=True)
class Download:
    """A file that is to be sent and then removed."""

    path: Path
    name: str


Time = Annotated[float, msgspec.Meta(ge=0.0, lt=4_102_444_800.0)]


class Moment(msgspec.Struct, kw_only=True, frozen=True):
    """A moment of event time."""

    time_s: Time


class Range(msgspec.Struct, kw_only=True, frozen=True):
    """From a moment until before another, of one soldier or of all."""

    begin_s: Time
    end_s: Time
    soldier: str | None = None


class ExportRange(msgspec.Struct, kw_only=True, frozen=True):
    """From a moment until before another, in a format that other programs read."""

    begin_s: Time
    end_s: Time
    format: Literal["gpx", "kml", "geojson", "csv", "mcap"] = "gpx"


class EventRange(msgspec.Struct, kw_only=True, frozen=True):
    """From a moment until before another."""

    begin_s: Time
    end_s: Time


def history(desk: Desk, _ask: Ask) -> History:
    """The archive's span."""
    span = None if desk.archive is None else desk.archive.span_ns()
    if span is None:
        return History(kept=desk.archive is not None)
    return History(kept=True, begin_s=seconds(span[0]), end_s=seconds(span[1]))


def past_picture(desk: Desk, ask: Ask) -> PictureView:
    """Everybody's newest track at a moment."""
    time_ns = _ns(ask.query.time_s)
    return _picture_of(_archive(desk).picture_at(time_ns), time_ns)


def past_trails(desk: Desk, ask: Ask) -> Trails:
    """Lines of one soldier or all, of the earliest `MOST_POINTS` reports."""
    begin_ns, end_ns = _span_ns(ask)
    found = _archive(desk).messages("track", begin_ns, end_ns, ask.query.soldier)
    tracks = [each.message for each in islice(found, MOST_POINTS + 1) if isinstance(each.message, Track)]
    until_ns = end_ns if len(tracks) <= MOST_POINTS else tracks.pop().time_ns
    return geojson.trails(tracks, until_ns)


def past_events(desk: Desk, ask: Ask) -> PictureView:
    """Alerts and observations."""
    begin_ns, end_ns = _span_ns(ask)
    archive = _archive(desk)
    found = [
        envelope
        for subject in ("alert", "observation")
        for envelope in islice(archive.messages(subject, begin_ns, end_ns), MOST_POINTS)
    ]
    return _picture_of(found, end_ns)


def export(desk: Desk, ask: Ask) -> Download:
    """Tracks, alerts and observations as a file."""
    from sa_hub.exports.exporting import export as write
    from sa_hub.exports.source import Source

    begin_ns, end_ns = _span_ns(ask)
    archive = _archive(desk)
    chosen = ask.query.format
    handle, name = tempfile.mkstemp(suffix=f".{chosen}")
    os.close(handle)
    try:
        write(Source(archive, begin_ns, end_ns), Path(name), chosen, overwrite=True)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return Download(Path(name), f"{desk.post.realm.id}-{math.floor(ask.query.begin_s)}.{chosen}")


def _archive(desk: Desk) -> "Archive":
    if desk.archive is None:
        raise Refused(404, "no history is kept: want [hub.history] in computer.toml")
    return desk.archive


def _picture_of(envelopes: list[Envelope], time_ns: int) -> PictureView:
    views: dict[str, dict[str, View]] = {}
    for found in map(view_of, envelopes):
        if found is not None:
            kind, key, view = found
            views.setdefault(kind, {})[key] = view
    changes: dict[str, Any] = dict(views)
    return PictureView(now_s=seconds(time_ns), **changes)


def _span_ns(ask: Ask) -> tuple[int, int]:
    length_s = ask.query.end_s - ask.query.begin_s
    if not 0.0 < length_s <= _LONGEST_S:
        raise Refused(422, "want begin_s < end_s, no more than a week apart")
    return _ns(ask.query.begin_s), _ns(ask.query.end_s)


def _ns(time_s: float) -> int:
    return math.floor(time_s * NS_PER_S)
