"""TAK as a companion of the hub: the squad goes out, others come in."""

from collections.abc import Callable, Iterator

from bootprint.bus import Envelope
from bootprint.display import Ages
from bootprint.messages import Status, Track
from bootprint.service import Context
from sa_hub.tak.event import to_xml
from sa_hub.tak.foreign import Foreigners
from sa_hub.tak.friends import Friends
from sa_hub.tak.link import open_link
from sa_hub.tak.protobuf import to_protobuf
from sa_hub.tak.settings import TakSettings, endpoint_of
from sa_hub.tak.squad import Squad

Announce = Callable[[Envelope], None]
OBSERVER = "tak"
"""Who has observed what TAK users have marked, when it is not passed on to the squad."""


class TakSink:
    """Sends what is due and announces what was heard, twice a second."""

    name = "tak"
    interval_s = 0.5
    most = 500
    keeps = False

    def __init__(
        self,
        context: Context,
        settings: TakSettings,
        ages: Ages,
        announce: Announce,
        *,
        exercise: bool,
        where: str,
    ) -> None:
        computer = context.computer
        self._link = open_link(settings, endpoint_of(settings, where), computer.path.parent, where)
        self._encode = to_protobuf if settings.protocol == "protobuf" else to_xml
        self._squad = Squad(computer.realm, settings, ages, exercise=exercise)
        observer = context.identity.soldier if settings.tell_squad else OBSERVER
        self._foreigners = Foreigners(context.identity, observer) if settings.receive else None
        self._friends = Friends(context.identity, settings) if settings.tell_friends else None
        self._announce = announce
        self._now_ns = context.clock.now_ns
        self._sent = self._told = 0

    def wants(self, envelope: Envelope) -> bool:
        """Tracks, and statuses for their batteries."""
        return isinstance(envelope.message, Track | Status)

    def take(self, envelopes: list[Envelope]) -> None:
        """Tell what is new, listen to what has come."""
        for envelope in envelopes:
            self._squad.tell(envelope.message)
            self._note(envelope)
        for event in self._squad.due(self._now_ns()):
            self._link.send(self._encode(event))
            self._sent += 1
        for heard in self._heard():
            self._note(heard)
            self._announce(heard)
        if self._friends is not None and (told := self._friends.due(self._now_ns())) is not None:
            self._told += 1
            self._announce(told)

    def _heard(self) -> Iterator[Envelope]:
        if self._foreigners is not None:
            for data in self._link.receive():
                heard = self._foreigners.hear(data, self._now_ns())
                if heard is not None:
                    yield heard

    def _note(self, envelope: Envelope) -> None:
        if self._friends is not None:
            self._friends.hear(envelope.message)

    def counters(self) -> dict[str, int]:
        """Events sent, friends told of by radio, and what became of events heard."""
        heard = {} if self._foreigners is None else self._foreigners.counters
        return {
            "sent": self._sent,
            "friends_told": self._told,
            **{f"heard_{name}": count for name, count in heard.items()},
        }

    def close(self) -> None:
        """Close the connection."""
        self._link.close()
