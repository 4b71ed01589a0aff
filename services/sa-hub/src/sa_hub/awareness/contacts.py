"""Who is known to whom: what the frames on the air prove about their senders.

A frame proves that its sender is on that net. A report in it proves that the sender knows that soldier as of the
report's time: itself, or, for a relay, whoever it passes on. What a sender knows beyond that stays unknown.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from bootprint.awareness import Contact, Contacts
from bootprint.config import Member


@dataclass(slots=True)
class _Spell:
    """Since when somebody has been known without a break, and by how new a report."""

    since_ns: int
    newest_ns: int


@dataclass(slots=True)
class _Spells:
    """Whom one member knows, by number."""

    fresh_ns: int
    of: dict[int, _Spell] = field(default_factory=dict)

    def prove(self, number: int, time_ns: int) -> None:
        """The member knows this soldier as of ``time_ns``."""
        spell = self.of.get(number)
        if spell is None or time_ns - spell.newest_ns >= self.fresh_ns:
            self.of[number] = _Spell(time_ns, time_ns)
        else:
            spell.newest_ns = max(spell.newest_ns, time_ns)

    def forget(self, now_ns: int) -> None:
        """Let go of those who are no longer known freshly."""
        self.of = {n: spell for n, spell in self.of.items() if now_ns - spell.newest_ns < self.fresh_ns}

    def since(self, roster: Mapping[int, Member]) -> dict[str, int]:
        """Since when, by id."""
        return {roster[number].id: spell.since_ns for number, spell in sorted(self.of.items())}

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much."""
        for spell in self.of.values():
            spell.since_ns -= by_ns
            spell.newest_ns -= by_ns


@dataclass(slots=True)
class _Heard:
    """A member as heard here."""

    link: str
    heard_ns: int
    knows: _Spells


class ContactMap:
    """Who knows whom, as one hub can tell. ``fresh_ns``: how old a report may be to count as knowledge."""

    def __init__(self, own: int, roster: Mapping[int, Member], fresh_ns: int) -> None:
        self._own = own
        self._roster = roster
        self._fresh_ns = fresh_ns
        self._ours = _Spells(fresh_ns)
        self._members: dict[int, _Heard] = {}

    def heard(self, sender: int, link: str, now_ns: int) -> None:
        """An authentic frame of ``sender`` came over ``link``."""
        member = self._members.get(sender)
        if member is None:
            self._members[sender] = _Heard(link, now_ns, _Spells(self._fresh_ns))
        else:
            member.link, member.heard_ns = link, now_ns

    def proven(self, member: int, soldier: int, time_ns: int) -> None:
        """A ``member`` who was heard knows ``soldier`` by a report of ``time_ns``: it passed it on, or says so."""
        if soldier in self._roster and member in self._members:
            self._members[member].knows.prove(soldier, time_ns)

    def told(self, soldier: int, time_ns: int) -> None:
        """We know a soldier by a report of ``time_ns``."""
        self._ours.prove(soldier, time_ns)

    def set_back(self, by_ns: int) -> None:
        """Our clock was set back by so much."""
        self._ours.set_back(by_ns)
        for member in self._members.values():
            member.heard_ns -= by_ns
            member.knows.set_back(by_ns)

    def message(self, now_ns: int) -> Contacts:
        """The map as of now; members who were silent for long have no place in it."""
        self._members = {
            number: member
            for number, member in self._members.items()
            if now_ns - member.heard_ns < self._fresh_ns
        }
        self._ours.forget(now_ns)
        return Contacts(
            time_ns=now_ns,
            soldier=self._roster[self._own].id,
            knows=self._ours.since(self._roster),
            members=tuple(self._contacts(now_ns)),
        )

    def _contacts(self, now_ns: int) -> Iterable[Contact]:
        for number, member in sorted(self._members.items()):
            member.knows.forget(now_ns)
            yield Contact(
                soldier=self._roster[number].id,
                link=member.link,
                heard_ns=member.heard_ns,
                knows=member.knows.since(self._roster),
            )
