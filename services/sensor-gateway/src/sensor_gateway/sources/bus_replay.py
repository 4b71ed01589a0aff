"""Recordings of the bus (MCAP): the sensor messages of one soldier, re-addressed to this computer."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bootprint import recording
from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.topics import TOPICS, VERSION, Identity
from sensor_gateway.stamps import restamped

SENSOR_SUBJECTS = frozenset(topic.subject for topic in TOPICS if topic.publisher == "sensor-gateway")


class BusRecording:
    """What the sensors of ``soldier`` said, in the order in which it was recorded."""

    def __init__(self, path: Path, identity: Identity, soldier: str) -> None:
        self.counts: Counter[str] = Counter()
        self._recording = recording.Recording(path)
        self._identity = identity
        self._soldier = soldier
        first = next(self._recorded(soldier), None)
        if first is None:
            raise RecordingError(f"{path}: no sensor messages of soldier {soldier!r}; {self._whose()}")
        self._first_ns = first.message.time_ns

    def messages(self, start_ns: int) -> Iterator[Envelope]:
        """All messages, shifted so that the first recorded one is of ``start_ns``; sequences as recorded."""
        shift_ns = start_ns - self._first_ns
        for envelope in self._recorded(self._soldier):
            address = self._identity.address(envelope.address.subject, envelope.address.source)
            yield Envelope(address, restamped(envelope.message, shift_ns, envelope.message.sequence))
        self.counts["messages_invalid"] = sum(self._recording.report.invalid.values())

    def _recorded(self, soldier: str) -> Iterator[Envelope]:
        for _, envelope in self._recording.envelopes(f"*/{VERSION}/*/{soldier}/**"):
            if envelope.address.subject in SENSOR_SUBJECTS:
                yield envelope

    def _whose(self) -> str:
        soldiers = sorted({envelope.address.soldier for envelope in self._recorded("*")})
        return f"it holds those of {', '.join(soldiers)}" if soldiers else "it holds none at all"
