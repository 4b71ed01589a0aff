"""The squad as Cursor on Target: when each soldier's event is due, and what it says.

Accuracy is the doubt that `bootprint.display` gives the place at that moment. A fresh soldier's event turns stale
when the track would; of one who is silent or lost events are told that turn stale at once, so that TAK clients grey
them out, with the duration in the remarks.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.config import Member, Realm
from bootprint.display import Ages, Shown, shown
from bootprint.messages import Message, Status, Track, TrackState
from sa_hub.tak.event import CotEvent
from sa_hub.tak.settings import TakSettings

_SOLDIER: Final = "a-f-G-U-C-I"
_POST: Final = "a-f-G-U-C"
_ROLES: Final = {
    "squad_leader": "Team Lead",
    "command_post": "HQ",
    "medic": "Medic",
    "sniper": "Sniper",
    "forward_observer": "Forward Observer",
    "radio": "RTO",
    "dog": "K9",
}
_HOW: Final = {"gnss": "m-g", "boots": "m-f", "body": "m-f", "camera": "m-f"}
_PREDICTED: Final = "m-p"
_PREDICTED_AFTER_S: Final = 5.0
_GONE_NS: Final = NS_PER_S
_SILENT_REFRESHES: Final = 4
_CLOCK_BACK_NS: Final = 60 * NS_PER_S


def uid_prefix(realm: str) -> str:
    """What all our uids begin with; events with it are our own, come back."""
    return f"bootprint-{realm}-"


@dataclass(frozen=True, slots=True)
class _Told:
    """What was told last of a soldier, and when."""

    time_ns: int
    state: TrackState
    at_ns: int


class Squad:
    """The newest track of everyone, and what TAK has been told of them."""

    def __init__(self, realm: Realm, settings: TakSettings, ages: Ages, *, exercise: bool) -> None:
        self._members = {member.id: member for member in realm.roster}
        self._prefix = uid_prefix(realm.id)
        self._realm = realm.id
        self._settings = settings
        self._ages = ages
        self._exercise = exercise
        self._tracks: dict[str, Track] = {}
        self._batteries: dict[str, float | None] = {}
        self._told: dict[str, _Told] = {}

    def tell(self, message: Message) -> None:
        """Take in a track, or a status for its battery."""
        if isinstance(message, Track) and message.soldier in self._members:
            self._tracks[message.soldier] = message
        elif isinstance(message, Status):
            self._batteries[message.soldier] = message.battery_pct

    def due(self, now_ns: int) -> Iterator[CotEvent]:
        """The events to send now; each counts as told when the next one is asked for."""
        for soldier, track in self._tracks.items():
            view = shown(track, now_ns, self._ages)
            if self._is_due(track, view.state, now_ns):
                yield self._event(track, view, now_ns)
                self._told[soldier] = _Told(track.time_ns, view.state, now_ns)

    def _is_due(self, track: Track, state: TrackState, now_ns: int) -> bool:
        told = self._told.get(track.soldier)
        if told is None or state != told.state or now_ns < told.at_ns - _CLOCK_BACK_NS:
            return True
        silence_s = (now_ns - told.at_ns) / NS_PER_S
        if track.time_ns != told.time_ns:
            return silence_s >= self._settings.least_interval_s
        return silence_s >= self._settings.refresh_s * (1 if state == "fresh" else _SILENT_REFRESHES)

    def _event(self, track: Track, view: Shown, now_ns: int) -> CotEvent:
        member = self._members[track.soldier]
        gone_ns = now_ns + _GONE_NS
        is_new = view.state == "fresh" and view.age_s < _PREDICTED_AFTER_S
        return CotEvent(
            uid=self._prefix + track.soldier,
            type=_POST if member.role == "command_post" else _SOLDIER,
            how=_HOW.get(track.mode, _PREDICTED) if is_new else _PREDICTED,
            time_ns=now_ns,
            start_ns=min(track.time_ns, now_ns),
            stale_ns=max(track.time_ns + self._ages.stale_ns, gone_ns) if view.state == "fresh" else gone_ns,
            latitude_deg=view.latitude_deg,
            longitude_deg=view.longitude_deg,
            hae_m=track.height_m,
            ce_m=view.sigma_m,
            details=self._details(member, track),
            remarks=self._remarks(track, view),
            opex=f"e-{self._realm}" if self._exercise else "",
        )

    def _details(self, member: Member, track: Track) -> dict[str, dict[str, str]]:
        callsign = member.callsign or member.id
        source = "GPS" if track.mode == "gnss" else "Calculated"
        battery_pct = self._batteries.get(member.id)
        details = {
            "takv": {"device": "bootprint", "platform": "bootprint", "os": "Linux", "version": "1"},
            "contact": {"callsign": callsign},
            "uid": {"Droid": callsign},
            "precisionlocation": {"geopointsrc": source, "altsrc": source},
            "__group": {"name": self._settings.team, "role": _ROLES.get(member.role, "Team Member")},
            "track": _track(track),
        }
        if battery_pct is not None:
            details["status"] = {"battery": str(round(battery_pct))}
        return details

    def _remarks(self, track: Track, view: Shown) -> str:
        parts = ["EXERCISE" if self._exercise else "", view.words, f"by {track.mode}"]
        parts.append("" if track.floor is None else f"floor {track.floor}")
        return ", ".join(filter(None, parts))


def _track(track: Track) -> dict[str, str]:
    east, north = track.east_velocity_m_s, track.north_velocity_m_s
    course_deg = math.degrees(math.atan2(east, north)) % 360.0
    return {"course": f"{course_deg:.1f}", "speed": f"{math.hypot(east, north):.2f}"}
