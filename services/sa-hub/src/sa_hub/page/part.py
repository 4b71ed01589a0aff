"""The page as a part of the hub's process: built from the computer's configuration, told what the hub tells."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from bootprint.bus import Envelope
from bootprint.config import Member
from bootprint.display import Ages
from bootprint.figures import Figures
from bootprint.messages import Fix
from bootprint.service import Context
from bootprint.topics import VERSION, Identity
from bootprint.zenoh_bus import Inlet
from sa_hub.page.app import STATIC, build_app
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk
from sa_hub.page.operations import Post
from sa_hub.page.restart import recall
from sa_hub.page.server import PageServer
from sa_hub.page.settings import PageSettings, check_page

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

_LISTENERS: Final = ("fusion", "sa-hub")
Place = Callable[[Fix, Member], Iterable[Envelope]]


class Page:
    """The desk and its server; `tell`, `figures` and `close` are called by the hub's thread."""

    def __init__(
        self,
        context: Context,
        settings: PageSettings,
        ages: Ages,
        place: Place,
        archive: "Archive | None" = None,
    ) -> None:
        computer = context.computer
        where = f"{computer.path}: [hub.page]"
        check_page(settings, computer.path.parent, where)
        self._context = context
        self._health: Inlet | None = None
        self.desk = Desk(
            _post(context, ages, place),
            Audit(computer.state_dir / "page" / "audit.jsonl"),
            plan=None if settings.plan is None else computer.relative(settings.plan),
            basemap=None if settings.basemap is None else computer.relative(settings.basemap),
            archive=archive,
            more=self._heard_health,
        )
        self._server = PageServer(build_app(self.desk, settings), settings, computer.path.parent, where)

    @property
    def note(self) -> str:
        """What is wrong with the page, if anything is."""
        return "" if (STATIC / "index.html").is_file() else "the page is not built: make page"

    def start(self) -> None:
        """The bus is open: listen to everybody's health, begin with what was known before a restart, serve."""
        realm = self._context.identity.realm
        self._health = self._context.bus.open_inlet(f"{realm}/{VERSION}/*/*/health/*")
        recall(self.desk)
        self._server.start()
        self._context.log.info("page", address=self._server.address)
        if self.note:
            self._context.log.warning(self.note)

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """What the hub has said or heard."""
        self.desk.tell(envelopes)

    def figures(self) -> Figures:
        """Counters, gauges, and what is wrong."""
        counters, gauges = self.desk.figures()
        return Figures("degraded" if self.note else "ok", counters, gauges, self.note)

    def close(self) -> None:
        """Stop serving."""
        self._server.close()
        if self.desk.archive is not None:
            self.desk.archive.close()

    def _heard_health(self) -> Iterable[Envelope]:
        """In the server's thread, which alone takes from this inlet."""
        return [] if self._health is None else self._health.take()


def _post(context: Context, ages: Ages, place: Place) -> Post:
    computer = context.computer

    def on_bus(member: Member) -> bool:
        identity = Identity(computer.realm.id, member.unit, member.id)
        return any(context.bus.alive(identity.selector("health", service)) for service in _LISTENERS)

    speed = context.options.speed
    return Post(
        realm=computer.realm,
        member=computer.member,
        ages=ages,
        speed=1.0 if speed == "max" else float(speed),
        now_ns=context.clock.now_ns,
        publish=context.publish,
        place=lambda fix, member: context.post(lambda: place(fix, member)),
        on_bus=on_bus,
    )
