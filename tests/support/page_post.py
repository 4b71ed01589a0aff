"""A command post's page over real hubs on an in-memory radio, without sockets: what the interface's tests ask."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient

from bootprint.bus import Envelope
from bootprint.config import Member
from bootprint.display import AGES
from bootprint.messages import Fix
from sa_hub.history.archive import Archive
from sa_hub.page.app import build_app
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk
from sa_hub.page.operations import Post
from sa_hub.page.settings import PageSettings
from support.hub_squad import REALM, Air, Walk, hub, link

LOCAL = "http://127.0.0.1:8080"


class PostAir(Air):
    """A soldier's and the command post's hubs on one net; the post's desk hears what its hub says."""

    def __init__(self, folder: Path, archive: Archive | None = None, plan: Path | None = None) -> None:
        net = link("hq")
        super().__init__({"a1": hub("a1", net), "cp": hub("cp", net, role="command_post")})
        self.own: list[Envelope] = []
        self.placed: list[tuple[Fix, Member]] = []
        self.reachable: set[str] = set()
        self._archive = archive
        self.desk = Desk(self._post(), Audit(folder / "audit.jsonl"), archive=archive, plan=plan)

    def _post(self) -> Post:
        return Post(
            realm=REALM,
            member=REALM.member("cp"),
            ages=AGES,
            speed=1.0,
            now_ns=lambda: self.now_ns,
            publish=self._publish,
            place=self._place,
            on_bus=lambda member: member.id in self.reachable,
        )

    def keep(self, receiver: str, envelopes: list[Envelope]) -> None:
        """Note what a hub publishes; the desk and the archive take the post's."""
        super().keep(receiver, envelopes)
        if receiver == "cp":
            self.desk.tell(envelopes)
            if self._archive is not None:
                self._archive.store(envelopes)

    def _publish(self, envelope: Envelope) -> None:
        """What the page publishes reaches the post's own hub, and the desk as every alert does."""
        self.own.append(envelope)
        if envelope.address.soldier == "cp":
            self.say(envelope)
            self.desk.tell([envelope])

    def _place(self, fix: Fix, member: Member) -> None:
        self.placed.append((fix, member))
        self.keep("cp", self.hubs["cp"].place(fix, member))


def walked(air: PostAir, seconds: float = 8.0) -> PostAir:
    """The soldier has walked for so long."""
    air.run(seconds, {"a1": Walk()})
    return air


@contextmanager
def browser(air: PostAir, base_url: str = LOCAL, **settings: Any) -> Iterator[TestClient]:
    """A client of the real application."""
    app = build_app(air.desk, PageSettings(**settings))
    with TestClient(app, base_url=base_url) as client:
        yield client
