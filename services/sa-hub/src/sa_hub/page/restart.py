"""What the page begins with: after a restart nobody is missing, and no alert is shown that somebody had seen.

Last known places, alerts and observations of the last hours are the archive's; who saw an alert is in the audit.
"""

import re
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.errors import RecordingError
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

RECALLED_NS: Final = 6 * 3600 * NS_PER_S
_MOST_EVENTS: Final = 500
_MOST_CHANGES: Final = 5000
_SEEN: Final = re.compile(r"/alerts/([^/]+)/acknowledgement$")


def recall(desk: Desk) -> None:
    """Lay onto the desk what it would show had it been there all the time, as far as there is an archive."""
    if desk.archive is None:
        return
    with suppress(RecordingError):  # the archive's own companion tries again, and tells of it
        desk.tell(_known(desk.archive, desk.post.now_ns()))
    desk.catch_up()
    for alert, who in _acknowledged(desk.audit):
        desk.picture.acknowledge(alert, who)


def _known(archive: "Archive", now_ns: int) -> list[Envelope]:
    since_ns = now_ns - RECALLED_NS
    found = [each for each in archive.picture_at(now_ns) if each.message.time_ns >= since_ns]
    for subject in ("alert", "observation"):
        found += deque(archive.messages(subject, since_ns, now_ns + 1), maxlen=_MOST_EVENTS)
    return found


def _acknowledged(audit: Audit) -> Iterator[tuple[str, str]]:
    """Alerts by id and who had seen them, the first one first."""
    for row in reversed(audit.newest(_MOST_CHANGES)):
        seen = _SEEN.search(str(row.get("change")))
        if seen and row.get("outcome") == 200:
            yield seen[1], str(row.get("who"))
