"""What to show of a track at a time: where the soldier is believed to be, how sure that is, and in words how old.

Everybody who shows, scores or warns of a track asks here, so that all pictures agree. The place is the newest
report's, moved on by the prediction that senders go by (`bootprint.prediction`). Its doubt grows with the report's
age, for people turn, stop and set off.
"""

import math
from dataclasses import dataclass
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.geodesy import moved_place
from bootprint.messages import Track, TrackState
from bootprint.prediction import moved_m

RADIUS_95: Final = math.sqrt(-2.0 * math.log(0.05))
"""Radius that holds 95 % of a circular normal distribution, in its sigmas."""
_PACE_M_S: Final = 0.6
_STEADY_S: Final = 200.0
_SOONEST_S: Final = 1.0
_STATES: Final[tuple[TrackState, ...]] = ("fresh", "stale", "lost")
_JUST_NOW_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class Ages:
    """From which age a track is stale, and lost."""

    stale_ns: int
    lost_ns: int

    def state(self, age_ns: int) -> TrackState:
        """The state of a track of this age."""
        if age_ns >= self.lost_ns:
            return "lost"
        return "stale" if age_ns >= self.stale_ns else "fresh"


AGES: Final = Ages(75 * NS_PER_S, 180 * NS_PER_S)
"""What hubs go by unless they are told otherwise."""


@dataclass(frozen=True, slots=True)
class Held:
    """What a hub has seen of late of the net that a report came over: how well its senders keep the picture right.

    A sender speaks when the prediction has become wrong, so while reports come no later than ``silence_s`` after
    each other, the prediction stays right to ``sigma_m`` (one sigma).
    """

    sigma_m: float
    silence_s: float


@dataclass(frozen=True, slots=True)
class Shown:
    """A track as it is to be drawn; ``sigma_m`` is across any horizontal direction, ``height_m`` as last told."""

    latitude_deg: float
    longitude_deg: float
    height_m: float | None
    floor: int | None
    sigma_m: float
    age_s: float
    state: TrackState

    @property
    def radius_95_m(self) -> float:
        """The circle that the soldier is in, 95 times of a hundred."""
        return RADIUS_95 * self.sigma_m

    @property
    def words(self) -> str:
        """The age as people say it, e.g. "lost for 3:40"."""
        return age_words(self.state, self.age_s)


def shown(track: Track, now_ns: int, ages: Ages = AGES) -> Shown:
    """What to show of ``track`` at ``now_ns``; the state is the hub's, or a worse one if its age says so."""
    age_ns = now_ns - track.time_ns
    age_s = age_ns / NS_PER_S
    velocity_m_s = track.east_velocity_m_s, track.north_velocity_m_s
    place = track.latitude_deg, track.longitude_deg
    latitude_deg, longitude_deg = moved_place(place, *moved_m(*velocity_m_s, age_s))
    return Shown(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=track.height_m,
        floor=track.floor,
        sigma_m=sigma_m(track.accuracy_m, age_s, held_of(track)),
        age_s=age_s,
        state=max(track.state, ages.state(age_ns), key=_STATES.index),
    )


def held_of(track: Track) -> Held | None:
    """What the track's hub says of the net it came over."""
    if track.held_m is None or track.held_s is None:
        return None
    return Held(track.held_m, track.held_s)


def sigma_m(accuracy_m: float, age_s: float, held: Held | None = None) -> float:
    """One sigma of a believed place: what its sender said of it, and what the prediction has lost since.

    ``accuracy_m`` is a track's: the sender's own sigma and the rounding to the cell of a frame's lattice. With
    ``held`` the doubt stays within what the net's senders let pass for as long as a silence has meant nothing
    before. In as long again the trust in that fades: the sender may have been cut off right after the report.
    """
    free_m = free_sigma_m(age_s)
    if held is None or free_m <= held.sigma_m:
        return math.hypot(accuracy_m, free_m)
    beyond_s = max(0.0, age_s - held.silence_s)
    faded = min(1.0, beyond_s / max(held.silence_s, _SOONEST_S))
    return math.hypot(accuracy_m, held.sigma_m + faded * (free_m - held.sigma_m))


def free_sigma_m(elapsed_s: float) -> float:
    """How wrong the prediction is after so long of which nothing is known; one sigma across any direction.

    People go on at their pace for minutes, whatever way, then back and forth as in a random walk: 0.6 m/s · t /
    √(1 + t / 200 s), so that 95 % of walkers are within 2.45 of these. Fitted to the 95th percentiles of simulated
    patrols, simulated building clearing and recorded walks alike, 1 s to 240 s after a report at any moment.
    """
    elapsed_s = max(0.0, elapsed_s)
    return _PACE_M_S * elapsed_s / math.sqrt(1.0 + elapsed_s / _STEADY_S)


def age_words(state: TrackState, age_s: float) -> str:
    """How old a track is, as people say it: "now", "40 s ago", "silent for 1:20", "lost for 3:40"."""
    if state == "lost":
        return f"lost for {_duration(age_s)}"
    if state == "stale":
        return f"silent for {_duration(age_s)}"
    return "now" if age_s < _JUST_NOW_S else f"{_duration(age_s)} ago"


def _duration(seconds: float) -> str:
    whole = max(0, math.floor(seconds))
    minutes, rest = divmod(whole, 60)
    if minutes == 0:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
