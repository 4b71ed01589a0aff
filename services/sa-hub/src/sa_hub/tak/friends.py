"""Friends that others tell of, told on to our people by radio: as observations, few, and the nearest first.

Radio frames know only the roster, so another unit's friend travels as a thing seen: code ``friendly``, which nobody
takes for a target, and the friend's name as text. One that has been told is told again when it has moved by a good
part of its distance.
"""

import math
from typing import Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.foreign import ForeignTrack
from bootprint.geodesy import ground_offset
from bootprint.messages import Message, Observation, Track
from bootprint.topics import Identity
from sa_hub.tak.settings import TakSettings

_SOURCE: Final = "tak"
_LEAST_MOVE_M: Final = 25.0
_MOVE_SHARE: Final = 0.2
_AGAIN_S: Final = 600.0
_MOST: Final = 1000
_UNKNOWN_ACCURACY_M: Final = 50.0
_NAME: Final = 40
Place = tuple[float, float]


class Friends:
    """Hears our tracks and the others', and says what is due; time is event time."""

    def __init__(self, identity: Identity, settings: TakSettings) -> None:
        self._identity = identity
        self._within_m = settings.friends_within_m
        self._every_ns = round(settings.friends_every_s * NS_PER_S)
        self._own: dict[str, Place] = {}
        self._friends: dict[str, ForeignTrack] = {}
        self._told: dict[str, tuple[int, Place]] = {}
        self._said_ns: int | None = None

    def hear(self, message: Message) -> None:
        """A track of ours, or of another system's unit."""
        if isinstance(message, Track) and message.mode != "unplaced":
            self._own[message.soldier] = (message.latitude_deg, message.longitude_deg)
        elif isinstance(message, ForeignTrack) and message.affiliation == "friend":
            self._friends[message.uid] = message
            if len(self._friends) > _MOST:
                del self._friends[next(iter(self._friends))]

    def due(self, now_ns: int) -> Envelope | None:
        """The nearest friend that our people do not know of yet, if it is time to tell of one."""
        if self._said_ns is not None and now_ns - self._said_ns < self._every_ns:
            return None
        self._forget(now_ns)
        ranked = sorted((self._distance_m(each), each.uid) for each in self._friends.values())
        for distance_m, uid in ranked:
            if distance_m <= self._within_m and self._is_news(self._friends[uid], distance_m, now_ns):
                return self._tell(self._friends[uid], now_ns)
        return None

    def _forget(self, now_ns: int) -> None:
        """Nobody is told of a friend who may no longer be there."""
        self._friends = {uid: each for uid, each in self._friends.items() if each.stale_ns > now_ns}
        self._told = {uid: told for uid, told in self._told.items() if uid in self._friends}

    def _distance_m(self, friend: ForeignTrack) -> float:
        """To the nearest of our people."""
        place = _place(friend)
        return min((math.hypot(*ground_offset(own, place)) for own in self._own.values()), default=math.inf)

    def _is_news(self, friend: ForeignTrack, distance_m: float, now_ns: int) -> bool:
        if friend.uid not in self._told:
            return True
        told_ns, place = self._told[friend.uid]
        moved_m = math.hypot(*ground_offset(place, _place(friend)))
        return (
            moved_m > max(_LEAST_MOVE_M, _MOVE_SHARE * distance_m) or now_ns - told_ns > _AGAIN_S * NS_PER_S
        )

    def _tell(self, friend: ForeignTrack, now_ns: int) -> Envelope:
        self._said_ns = now_ns
        self._told[friend.uid] = now_ns, _place(friend)
        observation = Observation(
            time_ns=friend.time_ns,
            soldier=self._identity.soldier,
            latitude_deg=friend.latitude_deg,
            longitude_deg=friend.longitude_deg,
            accuracy_m=_UNKNOWN_ACCURACY_M if friend.accuracy_m is None else friend.accuracy_m,
            text=(friend.callsign or friend.uid)[:_NAME],
            code="friendly",
        )
        return Envelope(self._identity.address("observation", _SOURCE), observation)


def _place(friend: ForeignTrack) -> Place:
    return friend.latitude_deg, friend.longitude_deg
