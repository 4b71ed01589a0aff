"""What a hub publishes: messages under its own subtree of keys, numbered per subject and source."""

from collections.abc import Mapping

import msgspec

from bootprint.bus import Envelope
from bootprint.config import Member
from bootprint.display import Held
from bootprint.messages import Message, Track
from bootprint.topics import SUBJECT_OF, Address, Identity
from sa_hub.radio.content import Notice
from sa_hub.tracks import Known
from sa_hub.translate import message_of, track_of


class Publisher:
    """Envelopes of one hub; what is of another soldier has that soldier as its source."""

    def __init__(self, identity: Identity, roster: Mapping[int, Member]) -> None:
        self._identity = identity
        self._roster = roster
        self._next: dict[tuple[type[Message], str], tuple[Address, int]] = {}

    def track(self, known: Known, held: Held | None) -> Envelope:
        """What is known of a soldier; built once, since a hub publishes thousands."""
        member = self._roster[known.report.number]
        address, sequence = self._take(Track, member.id)
        return Envelope(address, track_of(known, member, held, sequence))

    def notice(self, notice: Notice) -> Envelope:
        """What was heard of a soldier."""
        soldier = self._roster[notice.number].id
        return self.message(soldier, message_of(notice, soldier))

    def message(self, source: str, message: Message) -> Envelope:
        """Any message, of this source."""
        address, sequence = self._take(type(message), source)
        return Envelope(address, msgspec.structs.replace(message, sequence=sequence))

    def _take(self, type_: type[Message], source: str) -> tuple[Address, int]:
        """Where a message of this type and source belongs, and its number there."""
        found = self._next.get((type_, source))
        address, sequence = found or (self._identity.address(SUBJECT_OF[type_], source), 0)
        self._next[type_, source] = (address, sequence + 1)
        return address, sequence
