"""The page's desk: what a request reads and changes, apart from HTTP; all of it runs in the server's thread.

Messages come from the hub's thread through a bounded queue (`Desk.tell`), which never waits: what does not fit is
dropped and counted.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bootprint.bus import Envelope
from bootprint.errors import RecordingError
from bootprint.messages import Track
from bootprint.rooms import RoomMap
from sa_hub.page.audit import Audit
from sa_hub.page.operations import Post
from sa_hub.page.picture import Picture

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

_WAITING: Final = 20_000
Source = Callable[[], Iterable[Envelope]]
SHOWN: Final = (
    "track",
    "foreign_track",
    "alert",
    "observation",
    "status",
    "link",
    "health",
    "friendly_warning",
    "rooms",
)
"""Subjects that the page shows."""


class Desk:
    """``more`` gives what waits in places of its own (health on the bus); ``archive`` what was, if it is kept."""

    def __init__(
        self,
        post: Post,
        audit: Audit,
        *,
        plan: Path | None = None,
        basemap: Path | None = None,
        archive: "Archive | None" = None,
        more: Source = lambda: (),
    ) -> None:
        self.post = post
        self.audit = audit
        self.plan = plan
        self.basemap = basemap
        self.archive = archive
        self.picture = Picture()
        self.tracks: dict[str, Track] = {}
        self.rooms: dict[str, RoomMap] = {}
        self.dropped = 0
        self.refused = 0
        self.clients = 0
        self._more = more
        self._waiting: deque[Envelope] = deque()
        self._lock = threading.Lock()

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """Take messages from the hub's thread; never waits for the page."""
        shown = [each for each in envelopes if each.address.subject in SHOWN]
        with self._lock:
            room = _WAITING - len(self._waiting)
            self._waiting.extend(shown[:room])
            self.dropped += max(0, len(shown) - room)

    def keep(self, envelope: Envelope) -> None:
        """Put what somebody has ordered here onto the archive's disk, if there is one; waits for it.

        The archive's companion will hear it, too, and pass over what is there. It also tries again where the disk
        fails, and tells of it: an alert does not wait for a disk to be mended.
        """
        if self.archive is not None:
            with suppress(RecordingError):
                self.archive.store([envelope])

    def catch_up(self) -> bool:
        """Take what waits into the picture; whether anything is new."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        envelopes = [*waiting, *self._more()]
        for envelope in envelopes:
            if isinstance(envelope.message, Track):
                self.tracks[envelope.message.soldier] = envelope.message
            elif isinstance(envelope.message, RoomMap):
                self.rooms[envelope.message.soldier] = envelope.message
        return self.picture.advance(envelopes)

    def figures(self) -> tuple[dict[str, int], dict[str, float]]:
        """Counters and gauges for the hub's health."""
        counters = {
            "page_dropped": self.dropped,
            "page_refused": self.refused,
            "page_audit_faults": self.audit.faults,
        }
        return counters, {"page_clients": float(self.clients)}
