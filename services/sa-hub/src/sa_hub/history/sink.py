"""The archive as a companion of the hub: all that it is to keep, written in batches, tried until it is kept."""

from typing import Final

from bootprint.bus import Envelope
from sa_hub.history.archive import Archive
from sa_hub.history.settings import HistorySettings

_INTERVAL_S: Final = 0.25
_MOST: Final = 500


class HistorySink:
    """Writes at most every 0.25 s, or 500 messages: what ``taken`` counts is on the disk."""

    name = "history"
    interval_s = _INTERVAL_S
    most = _MOST
    keeps = True

    def __init__(self, archive: Archive, settings: HistorySettings) -> None:
        self._archive = archive
        self._subjects = frozenset(settings.subjects)

    def wants(self, envelope: Envelope) -> bool:
        """Whether its subject is kept."""
        return envelope.address.subject in self._subjects

    def take(self, envelopes: list[Envelope]) -> None:
        """Store them; a transaction's fsync costs the same for one and for hundreds."""
        self._archive.store(envelopes)

    def counters(self) -> dict[str, int]:
        """None of its own."""
        return {}

    def close(self) -> None:
        """Let go of the database."""
        self._archive.close()
