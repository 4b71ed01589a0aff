"""All companions of a hub as its settings want them; what is not wanted is not even imported."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Protocol

from bootprint.bus import Envelope
from bootprint.config import Member
from bootprint.errors import ConfigError
from bootprint.figures import Figures
from bootprint.messages import Fix
from bootprint.service import Context
from sa_hub.companions.worker import Fate, Promise, Sink, Worker
from sa_hub.page.settings import PageSettings
from sa_hub.settings import HubSettings

Announce = Callable[[Envelope], None]
Place = Callable[[Fix, Member], Iterable[Envelope]]


class Companion(Protocol):
    """What runs beside a hub in a thread of its own; all methods are called in the hub's thread and never wait."""

    def start(self) -> None:
        """The bus is open: begin."""

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """What the hub has heard of its own soldier, or says itself."""

    def figures(self) -> Figures:
        """Counters, gauges, and what is wrong."""

    def close(self) -> None:
        """End."""


class Companions:
    """The workers as one: told together, closed together."""

    def __init__(self, workers: Sequence[Companion]) -> None:
        self._workers = workers

    def start(self, context: Context) -> None:
        """Begin to work; health, which comes from the scaffold and not from the hub, is listened to."""
        if self._workers:
            context.bus.subscribe(context.identity.selector("health"), lambda health: self.tell([health]))
        for worker in self._workers:
            worker.start()

    def tell(self, envelopes: Iterable[Envelope]) -> None:
        """What the hub has heard of its own soldier, or says itself; never waits."""
        self.entrust(envelopes)

    def entrust(self, envelopes: Iterable[Envelope]) -> Promise:
        """`tell`, and whether these are kept by those who keep."""
        promises: list[Promise] = []
        for worker in self._workers:
            if isinstance(worker, Worker):
                promises.append(worker.entrust(envelopes))
            else:
                worker.tell(envelopes)
        return partial(_fate_of_all, promises)

    def figures(self) -> Figures:
        """Everyone's counters and gauges, and what is wrong."""
        figures = Figures()
        for each in (worker.figures() for worker in self._workers):
            figures.counters |= each.counters
            figures.gauges |= each.gauges
            figures.note = figures.note or each.note
        figures.state = "degraded" if figures.note else "ok"
        return figures

    def close(self) -> None:
        """Let everyone finish what waits."""
        for worker in self._workers:
            worker.close()


def _fate_of_all(promises: Iterable[Promise]) -> Fate:
    fates = {promise() for promise in promises}
    if "waiting" in fates:
        return "waiting"
    return "unkept" if "unkept" in fates else "kept"


def companions_of(context: Context, settings: HubSettings, announce: Announce, place: Place) -> Companions:
    """The companions that the settings name; ConfigError where one does not fit the hub's role.

    ``announce`` publishes what a companion has heard elsewhere; it is called in that companion's thread.
    ``place`` takes a soldier's place into the hub's picture; it is called in the main loop.
    """
    if settings.role != "command_post":
        for name in ("history", "tak", "mavlink_out", "page"):
            if getattr(settings, name) is not None:
                raise ConfigError(f"{context.computer.path}: [hub.{name}]: only a command_post has one")
    workers: list[Companion] = [Worker(sink) for sink in _sinks(context, settings, announce)]
    if settings.page is not None and settings.page.enabled:
        workers.append(_page(context, settings, settings.page, place))
    workers += _rooms(context, settings, announce)
    return Companions(workers)


def _rooms(context: Context, settings: HubSettings, announce: Announce) -> list[Companion]:
    if all(link.kind != "zenoh" for link in settings.links):
        return []
    from sa_hub.rooms.companion import room_links

    shared = room_links(context, settings.links, settings.group_key, announce)
    return [] if shared is None else [shared]


def _page(context: Context, settings: HubSettings, page: PageSettings, place: Place) -> Companion:
    from sa_hub.page.part import Page

    archive = None if settings.history is None else settings.history.archive(context.computer)
    return Page(context, page, settings.ages, place, archive)


def _sinks(context: Context, settings: HubSettings, announce: Announce) -> Iterable[Sink]:
    computer = context.computer
    where = f"{computer.path}: [hub"
    ages = settings.ages
    if settings.history is not None:
        from sa_hub.history.sink import HistorySink

        yield HistorySink(settings.history.archive(computer), settings.history)
    if settings.tak is not None:
        from sa_hub.tak.sink import TakSink

        yield TakSink(
            context, settings.tak, ages, announce, exercise=settings.exercise, where=f"{where}.tak]"
        )
    if settings.mavlink_out is not None:
        from sa_hub.outputs.mavlink import MavlinkSink

        yield MavlinkSink(settings.mavlink_out, context.clock, ages, f"{where}.mavlink_out]")
    if settings.nmea is not None:
        from sa_hub.outputs.nmea_sink import NmeaSink

        yield NmeaSink(settings.nmea, computer.path.parent, f"{where}.nmea]")
