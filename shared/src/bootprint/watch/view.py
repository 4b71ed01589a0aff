"""What the watch knows and how it says it: own place, nearest friends, alerts and warnings; no screen, no bus."""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bootprint.awareness import FriendlyWarning
from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.display import AGES, RADIUS_95, Ages, age_words, shown
from bootprint.geodesy import azimuth_of, ground_offset, major_axis_sigma_m
from bootprint.messages import Alert, Observation, Position, Track
from bootprint.mgrs import mgrs

SUBJECTS: Final = ("position", "track", "alert", "observation", "friendly_warning")
_TOLD: Final = 50
_FRESH_NS: Final = 3 * NS_PER_S
_ARROWS: Final = "↑↗→↘↓↙←↖"
_REASONS: Final = {
    "near": "is near you",
    "in_aim": "IS IN YOUR LINE OF FIRE",
    "in_facing": "is in front of you",
    "in_target_line": "is between you and a target",
    "near_target": "is near a target",
}


@dataclass(frozen=True, slots=True)
class Friend:
    """Another soldier as seen from here; azimuth clockwise from true north, ``turn_deg`` from where we face."""

    callsign: str
    distance_m: float
    azimuth_deg: float
    turn_deg: float | None
    floor: int | None
    radius_95_m: float
    words: str
    state: str

    @property
    def arrow(self) -> str:
        """The way to turn, as an arrow up for ahead; "·" while it is not known where we face."""
        return "·" if self.turn_deg is None else _ARROWS[round(self.turn_deg / 45.0) % 8]


class WatchView:
    """One soldier's. Messages in by `take`; everything that is said is as of a moment of event time."""

    def __init__(self, soldier: str, ages: Ages = AGES) -> None:
        self._soldier = soldier
        self._ages = ages
        self._tracks: dict[str, Track] = {}
        self._warnings: dict[str, FriendlyWarning] = {}
        self._told: deque[Alert | Observation] = deque(maxlen=_TOLD)
        self.position: Position | None = None

    def take(self, envelope: Envelope) -> None:
        """A message of our own bus."""
        match envelope.message:
            case Position() as position:
                self.position = position
            case Track() as track:
                self._tracks[track.soldier] = track
            case FriendlyWarning() as warning:
                self._warnings[warning.friendly] = warning
            case Alert() | Observation() as told:
                if told not in self._told:
                    self._told.append(told)

    @property
    def place(self) -> tuple[float, float] | None:
        """Our latitude and longitude, None while nobody knows."""
        position = self.position
        if position is None or position.mode == "unplaced":
            return None
        return position.latitude_deg, position.longitude_deg

    def own_lines(self, now_ns: int) -> list[str]:
        """Where we are, and in words how far to believe it."""
        position, place = self.position, self.place
        if position is None:
            return ["no position yet"]
        if place is None:
            return ["not placed: say where you are (x)"]
        radius_m = RADIUS_95 * _sigma_m(position)
        floor = "" if position.floor is None else f"  floor {position.floor}"
        return [
            mgrs(*place) + floor,
            f"{_trust(position, radius_m)}, within {radius_m:.0f} m{self._age(now_ns)}",
        ]

    def _age(self, now_ns: int) -> str:
        assert self.position is not None
        age_ns = now_ns - self.position.time_ns
        return "" if age_ns < _FRESH_NS else f" — {age_words('stale', age_ns / NS_PER_S)}"

    def friends(self, now_ns: int) -> list[Friend]:
        """The others, the nearest first; none while we do not know where we are."""
        place = self.place
        if place is None:
            return []
        others = (track for track in self._tracks.values() if track.soldier != self._soldier)
        found = [self._friend(track, place, now_ns) for track in others if track.mode != "unplaced"]
        return sorted(found, key=lambda friend: friend.distance_m)

    def _friend(self, track: Track, place: tuple[float, float], now_ns: int) -> Friend:
        where = shown(track, now_ns, self._ages)
        east_m, north_m = ground_offset(place, (where.latitude_deg, where.longitude_deg))
        azimuth_deg = math.degrees(azimuth_of(east_m, north_m))
        facing_rad = self.position.facing_rad if self.position else None
        if facing_rad is None and self.position:
            facing_rad = self.position.course_rad
        return Friend(
            callsign=track.callsign or track.soldier,
            distance_m=math.hypot(east_m, north_m),
            azimuth_deg=azimuth_deg,
            turn_deg=None if facing_rad is None else (azimuth_deg - math.degrees(facing_rad)) % 360.0,
            floor=track.floor,
            radius_95_m=where.radius_95_m,
            words=where.words,
            state=where.state,
        )

    def callsign(self, soldier: str) -> str:
        """What a soldier is called."""
        track = self._tracks.get(soldier)
        return (track.callsign if track else None) or soldier

    def alarms(self, now_ns: int, most: int = 5) -> list[str]:
        """What must be seen: friendlies in danger, then alerts and things seen, the newest first."""
        return [*self._warned(), *self._news(now_ns)][:most]

    def _warned(self) -> Iterator[str]:
        for warning in self._warnings.values():
            if not warning.is_over:
                why = _REASONS[warning.reasons[0]]
                yield f"⚠ {self.callsign(warning.friendly)} {why}, {warning.distance_m:.0f} m"

    def _news(self, now_ns: int) -> Iterator[str]:
        for told in sorted(self._told, key=lambda each: each.time_ns, reverse=True):
            age = age_words("fresh", (now_ns - told.time_ns) / NS_PER_S)
            what = told.kind.upper() if isinstance(told, Alert) else f"sees {told.code or ''}".strip()
            yield " ".join(filter(None, (self.callsign(told.soldier) + ":", what, told.text, f"({age})")))


def _sigma_m(position: Position) -> float:
    east_m2, cross_m2, _, north_m2, _, _ = position.covariance_m2
    return major_axis_sigma_m(east_m2, cross_m2, north_m2)


def _trust(position: Position, radius_m: float) -> str:
    """The position's reliability in words, by what measures it and by the circle that holds us."""
    if position.mode in ("coasting", "lost"):
        return "GUESSED: no sensor measures you"
    return "good" if radius_m <= 10.0 else "fair" if radius_m <= 40.0 else "POOR"
