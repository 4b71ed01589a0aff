"""The others of the squad, as ranges and the own hub's picture of them tell: who is how far away, and where.

A range through walls is too long, never too short, so of a peer's ranges within a few seconds a short one counts:
the lower quartile of what they exceed the prediction by (the very shortest would be the noise's choice). A peer's
place is the hub's track, moved on and doubted by its age as everybody shows it (`bootprint.display`).
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from bootprint.clock import NS_PER_S
from bootprint.config import Origin
from bootprint.display import shown
from bootprint.geodesy import LocalFrame
from bootprint.messages import Mode, Range, Track
from fusion.config import PeersConfig
from fusion.state import Array

_NOWHERE: tuple[Mode, ...] = ("unplaced", "lost")
_SHORT_QUARTILE = 25.0
_FURTHEST_M = 20_000.0  # no radio on a soldier ranges further
_UNPLACED_STALE_S = 1.5  # a radio ranges once a second or faster; later the soldier is elsewhere


@dataclass(frozen=True, slots=True)
class Sight:
    """A peer at ``place`` (3,) m ENU, ``distance_m`` away; ``place_sigma_m`` in any horizontal direction."""

    peer: str
    place: Array
    place_sigma_m: float
    distance_m: float
    distance_sigma_m: float


@dataclass(frozen=True, slots=True)
class _Ranged:
    time_ns: int
    distance_m: float
    sigma_m: float
    here: Array | None  # the own body then, ENU; None if unplaced


class Peers:
    """Newest track and last ranges of every peer."""

    def __init__(self, config: PeersConfig, origin: Origin) -> None:
        self._config = config
        self._frame = LocalFrame(origin)
        self._tracks: dict[str, Track] = {}
        self._ranges: dict[str, deque[_Ranged]] = {}

    def track(self, track: Track) -> None:
        """The own hub tells of a soldier; of the own one it tells what fusion has said."""
        if track.via != "own":
            self._tracks[track.soldier] = track

    def range(self, message: Range, here: Array | None) -> None:
        """A range to a peer, measured when the own body was at ``here`` (3,) m ENU; None: unplaced."""
        if message.distance_m > _FURTHEST_M:
            return
        sigma_m = max(message.sigma_m or 0.0, self._config.range_floor_m)
        ranges = self._ranges.setdefault(message.peer, deque())
        ranges.append(_Ranged(message.time_ns, message.distance_m, sigma_m, here))
        self._forget_before(ranges, message.time_ns)

    def _forget_before(self, ranges: deque[_Ranged], now_ns: int) -> None:
        while ranges and now_ns - ranges[0].time_ns > self._config.window_s * NS_PER_S:
            ranges.popleft()

    def clear_ranges(self) -> None:
        """The own body has been moved: it was not where it was thought to be when they were measured."""
        self._ranges.clear()

    def shift(self, by_ns: int) -> None:
        """The own clock has been set: ranges are of the old one."""
        self._ranges.clear()

    def sights(self, now_ns: int, here: Array | None) -> list[Sight]:
        """The peers that are in range and whose place is known, seen from ``here`` (3,) m ENU; None: unplaced."""
        found = (self._sight(peer, ranges, now_ns, here) for peer, ranges in sorted(self._ranges.items()))
        return [sight for sight in found if sight is not None]

    def _sight(self, peer: str, ranges: deque[_Ranged], now_ns: int, here: Array | None) -> Sight | None:
        self._forget_before(ranges, now_ns)
        track = self._tracks.get(peer)
        if track is None or not ranges or track.mode in _NOWHERE:
            return None
        place, sigma_m, lost = self._place(track, now_ns)
        if lost:
            return None
        if here is None:
            return _at_once(peer, place, sigma_m, ranges[-1], now_ns)
        excess = [
            one.distance_m - float(np.linalg.norm(one.here - self._place(track, one.time_ns)[0]))
            for one in ranges
            if one.here is not None
        ]
        if not excess:
            return None
        distance_m = float(np.linalg.norm(here - place) + np.percentile(excess, _SHORT_QUARTILE))
        return Sight(peer, place, sigma_m, max(0.0, distance_m), ranges[-1].sigma_m)

    def _place(self, track: Track, now_ns: int) -> tuple[Array, float, bool]:
        """Where a track is at a time (3,) m, how sure, and whether it is lost."""
        seen = shown(track, now_ns)
        height_m = self._frame.origin.height_m if seen.height_m is None else seen.height_m
        place = self._frame.to_enu(seen.latitude_deg, seen.longitude_deg, height_m)
        return np.array(place), seen.sigma_m, seen.state == "lost"


def _at_once(peer: str, place: Array, sigma_m: float, newest: _Ranged, now_ns: int) -> Sight | None:
    """Of who does not know which way they went since: the newest range, if it is of now."""
    age_s = (now_ns - newest.time_ns) / NS_PER_S
    if age_s > _UNPLACED_STALE_S:
        return None
    return Sight(peer, place, sigma_m, newest.distance_m, newest.sigma_m + age_s)
