"""The page's picture: the newest of everything that browsers show, each with the revision that brought it.

A browser says which revision it has and is given what came since, so a slow one misses the values in between and
nothing else; there are no queues for browsers.
"""

from collections import OrderedDict
from collections.abc import Iterable, Iterator
from typing import Final

from msgspec.structs import replace

from bootprint.bus import Envelope
from sa_hub.page.views import AlertView, View, view_of

KINDS: Final = (
    "tracks",
    "foreign",
    "statuses",
    "alerts",
    "observations",
    "links",
    "health",
    "warnings",
    "rooms",
)
_MOST: Final = {"foreign": 500, "alerts": 200, "observations": 500}
Changes = dict[str, dict[str, View]]


class Picture:
    """Views by kind and key. ``revision`` rises by one with each `advance` that had news."""

    def __init__(self) -> None:
        self.revision = 0
        self._views: dict[str, OrderedDict[str, tuple[int, View]]] = {kind: OrderedDict() for kind in KINDS}

    def advance(self, envelopes: Iterable[Envelope]) -> bool:
        """Take messages in as one revision; whether there was anything to show in them."""
        found = [view for envelope in envelopes if (view := view_of(envelope)) is not None]
        if found:
            self.revision += 1
        for kind, key, new in found:
            self._put(kind, key, new)
        return bool(found)

    def acknowledge(self, alert: str, by: str) -> AlertView | None:
        """Somebody has seen an alert; None if there is no such alert. The first one to see it stays."""
        _, known = self._views["alerts"].get(alert, (0, None))
        if not isinstance(known, AlertView):
            return None
        if known.acknowledged_by is not None:
            return known
        seen = replace(known, acknowledged_by=by)
        self.revision += 1
        self._put("alerts", alert, seen)
        return seen

    def all(self, kind: str) -> dict[str, View]:
        """Everything of a kind, the longest unchanged first."""
        return {key: view for key, (_, view) in self._views[kind].items()}

    def get(self, kind: str, key: str) -> View | None:
        """One view, None if there is none."""
        found = self._views[kind].get(key)
        return None if found is None else found[1]

    def since(self, revision: int) -> Changes:
        """What came after a revision; kinds without news are left out."""
        changes = {kind: dict(self._news(kind, revision)) for kind in KINDS}
        return {kind: views for kind, views in changes.items() if views}

    def _put(self, kind: str, key: str, view: View) -> None:
        """The newest change stands last, so that news are found without looking at everything."""
        views = self._views[kind]
        known = views.get(key)
        if isinstance(view, AlertView) and known is not None and isinstance(known[1], AlertView):
            view = replace(view, acknowledged_by=view.acknowledged_by or known[1].acknowledged_by)
        views[key] = (self.revision, view)
        views.move_to_end(key)
        if len(views) > _MOST.get(kind, len(views)):
            views.popitem(last=False)

    def _news(self, kind: str, revision: int) -> Iterator[tuple[str, View]]:
        for key, (since, view) in reversed(self._views[kind].items()):
            if since <= revision:
                return
            yield key, view
