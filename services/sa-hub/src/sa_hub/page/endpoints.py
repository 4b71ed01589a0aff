"""The table of the page's interface: what can be asked, by whom, with which body, and what comes back.

Routes, access and the OpenAPI description all derive from `ENDPOINTS`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

import msgspec

from sa_hub.page import answers, past
from sa_hub.page.answers import Acknowledged, AuditRow, Fixed, PictureView, PostView
from sa_hub.page.asking import Ask
from sa_hub.page.desk import Desk
from sa_hub.page.geojson import FeatureCollection, Trails
from sa_hub.page.operations import NewAlert, NewFix, NewObservation, NewSighting, NewStatus
from sa_hub.page.past import EventRange, ExportRange, History, Moment, Range
from sa_hub.page.settings import Role
from sa_hub.page.views import AlertView, ObservationView, SoldierView, StatusView

ROOT: Final = "/api/v1"
Handler = Callable[[Desk, Ask], Any]


@dataclass(frozen=True)
class Endpoint:
    """One line of the interface. ``slow``: waits for the archive, so not in the server's own thread."""

    method: Literal["GET", "POST"]
    path: str
    role: Role
    summary: str
    handler: Handler
    answer: Any
    body: type[msgspec.Struct] | None = None
    query: type[msgspec.Struct] | None = None
    slow: bool = False
    media: str = "application/json"

    @property
    def changes(self) -> bool:
        """Whether it changes anything, so that it is audited and held to the rate of changes."""
        return self.method != "GET"


ENDPOINTS: Final = (
    Endpoint(
        "GET", "/post", "view", "The command post: realm, origin, clock, limits", answers.post, PostView
    ),
    Endpoint("GET", "/roster", "view", "Everybody who may appear", answers.roster, list[SoldierView]),
    Endpoint("GET", "/picture", "view", "Everything that is shown now", answers.picture, PictureView),
    Endpoint(
        "GET", "/soldiers.geojson", "view", "Where everybody is now", answers.soldiers, FeatureCollection
    ),
    Endpoint(
        "GET", "/observations.geojson", "view", "What has been seen", answers.observations, FeatureCollection
    ),
    Endpoint("GET", "/plan.geojson", "view", "The buildings", answers.plan, FeatureCollection),
    Endpoint("GET", "/rooms.geojson", "view", "Rooms walked and seen", answers.rooms, FeatureCollection),
    Endpoint("GET", "/history", "view", "What the archive spans", past.history, History, slow=True),
    Endpoint(
        "GET",
        "/history/picture",
        "view",
        "The picture at a moment of the past",
        past.past_picture,
        PictureView,
        query=Moment,
        slow=True,
    ),
    Endpoint(
        "GET",
        "/history/trails.geojson",
        "view",
        "Who went where in a time",
        past.past_trails,
        Trails,
        query=Range,
        slow=True,
    ),
    Endpoint(
        "GET",
        "/history/events",
        "view",
        "Alerts and observations in a time",
        past.past_events,
        PictureView,
        query=EventRange,
        slow=True,
    ),
    Endpoint(
        "GET",
        "/history/export",
        "view",
        "A time as a file for other programs",
        past.export,
        bytes,
        query=ExportRange,
        slow=True,
        media="application/octet-stream",
    ),
    Endpoint(
        "POST", "/alerts", "operate", "Alert everybody", answers.alert, AlertView, body=NewAlert, slow=True
    ),
    Endpoint(
        "POST",
        "/alerts/{id}/acknowledgement",
        "operate",
        "An alert has been seen here",
        answers.acknowledge,
        Acknowledged,
    ),
    Endpoint(
        "POST",
        "/observations",
        "operate",
        "A thing seen, by its place",
        answers.observe,
        ObservationView,
        body=NewObservation,
        slow=True,
    ),
    Endpoint(
        "POST",
        "/sightings",
        "operate",
        "A thing seen, by bearing and range from a soldier",
        answers.sight,
        ObservationView,
        body=NewSighting,
        slow=True,
    ),
    Endpoint(
        "POST",
        "/status",
        "operate",
        "How the command post is",
        answers.status,
        StatusView,
        body=NewStatus,
        slow=True,
    ),
    Endpoint("POST", "/fixes", "operate", "Where a soldier is", answers.fix, Fixed, body=NewFix),
    Endpoint("GET", "/audit", "admin", "The newest changes", answers.audit, list[AuditRow]),
)
