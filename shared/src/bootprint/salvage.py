"""The account of a recording: what is intact, what is not, and where."""

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from bootprint import foxglove, mcap_survey
from bootprint.errors import WireError
from bootprint.topics import Address, parse_key


@dataclass(slots=True)
class TopicCount:
    """How much of one key a recording holds."""

    messages: int
    first_ns: int
    last_ns: int


@dataclass(slots=True)
class Salvage:
    """What is intact in a recording and what is not.

    ``messages`` counts ours, by key in ``topics``; ``derived`` what was written a second time for other tools;
    ``unknown`` intact messages of other versions, subjects or encodings; ``lost`` is how many the file promised
    but no longer has, None where it does not say. ``invalid`` counts payloads that are not what their topic
    says; it grows while envelopes are read.
    """

    path: Path
    topics: dict[str, TopicCount] = field(default_factory=dict)
    derived: int = 0
    unknown: int = 0
    lost: int | None = None
    truncated_at: int | None = None
    faults: tuple[mcap_survey.Fault, ...] = ()
    invalid: Counter[str] = field(default_factory=Counter)

    @property
    def messages(self) -> int:
        """Intact messages of known topics."""
        return sum(topic.messages for topic in self.topics.values())

    @property
    def first_ns(self) -> int:
        """The earliest time of any message, 0 if there is none."""
        return min((topic.first_ns for topic in self.topics.values()), default=0)

    @property
    def last_ns(self) -> int:
        """The latest time of any message, 0 if there is none."""
        return max((topic.last_ns for topic in self.topics.values()), default=0)

    def add(self, key: str, messages: int, first_ns: int, last_ns: int) -> None:
        """Count messages of a key, which may stand in more than one channel."""
        known = self.topics.setdefault(key, TopicCount(0, first_ns, last_ns))
        known.messages += messages
        known.first_ns = min(known.first_ns, first_ns)
        known.last_ns = max(known.last_ns, last_ns)

    def sentence(self) -> str:
        """One line: what is wrong where, and what is left."""
        places = [str(fault) for fault in self.faults]
        if self.truncated_at is not None:
            places.append(f"not finished, ends at byte {self.truncated_at}")
        if len(places) > 3:
            places[3:] = [f"and {len(places) - 3} more"]
        lost = f", {self.lost} are lost" if self.lost else ""
        return f"{self.path}: " + "; ".join([*places, f"{self.messages} messages are intact{lost}"])


@lru_cache(maxsize=4096)
def address_of(topic: str, encoding: str) -> Address | None:
    """The address of a channel of ours; None for other versions, subjects and encodings."""
    try:
        return parse_key(topic) if encoding == "msgpack" else None
    except WireError:
        return None


def survey_report(path: Path, survey: mcap_survey.Survey) -> Salvage:
    """Account for what a survey found."""
    report = Salvage(path, truncated_at=survey.truncated_at, faults=tuple(survey.faults))
    if survey.promised is not None:
        report.lost = max(0, survey.promised - survey.found)
    for number, count in survey.counts.items():
        channel = survey.channels.get(number)
        if channel is None:
            continue
        if address_of(channel.topic, channel.message_encoding):
            report.add(channel.topic, count, *survey.spans[number])
        elif foxglove.suffix_of(channel.topic) is not None:
            report.derived += count
        else:
            report.unknown += count
    return report
