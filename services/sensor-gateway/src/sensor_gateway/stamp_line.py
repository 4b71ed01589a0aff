"""Which stamps of a source come in order. Pure.

What is not later than all before is dropped; but where nothing else comes any more, the newest stamp was wrong or
the clock has been set back, and the source must not stay deaf until that time comes again.
"""

from typing import Literal

Order = Literal["advances", "set_back", "duplicate", "back"]

# Nearer than this is disorder; so many in a row, rising, from further back are a clock that was set back.
_DISORDER_NS = 1_000_000_000
_PATIENCE = 5


class StampLine:
    """The newest stamp of one source."""

    def __init__(self) -> None:
        self.newest_ns: int | None = None
        self._back_ns = 0
        self._backs = 0

    def take(self, utc_ns: int) -> Order:
        """What this stamp is to those before it; "advances" and "set_back" make it the newest."""
        newest_ns = self.newest_ns
        if newest_ns is None or utc_ns > newest_ns:
            self._go_to(utc_ns)
            return "advances"
        if utc_ns == newest_ns:
            return "duplicate"
        self._count_back(newest_ns - utc_ns, utc_ns)
        if self._backs < _PATIENCE:
            return "back"
        self._go_to(utc_ns)
        return "set_back"

    def _count_back(self, behind_ns: int, utc_ns: int) -> None:
        if behind_ns <= _DISORDER_NS:
            self._backs = 0
        elif self._backs == 0 or utc_ns > self._back_ns:
            self._backs, self._back_ns = self._backs + 1, utc_ns
        else:
            self._backs, self._back_ns = 1, utc_ns

    def _go_to(self, utc_ns: int) -> None:
        self.newest_ns = utc_ns
        self._backs = 0
