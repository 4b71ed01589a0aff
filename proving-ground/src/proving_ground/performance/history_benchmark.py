"""`bootprint benchmark history`: hours of a company in the archive: how large, how soon stored, found and exported.

Soldiers turn at random and are reported about as often as a 5 m threshold lets them be; the post's health and links
tell once a second. What is stored is what a hub publishes, in batches as its companion stores them.
"""

import random
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from bootprint.bus import Envelope
from bootprint.clock import NS_PER_S
from bootprint.commands.options import Json
from bootprint.geodesy import moved_place
from bootprint.messages import Alert, Health, LinkReport, Track
from bootprint.topics import Identity
from proving_ground.performance.limits import Limit, conclude, limits_table

if TYPE_CHECKING:
    from sa_hub.history.archive import Archive

Clock = Callable[[], float]
BEGIN_NS: Final = 1_760_000_000 * NS_PER_S
_POST: Final = Identity("bp", "hq", "cp")
_PLACE: Final = (59.35, 18.07)
_BATCH: Final = 500
_ALERT_EVERY_S: Final = 600
_QUERIES: Final = 30
_SPEED_M_S: Final = 1.3
_MINUTE_NS: Final = 60 * NS_PER_S


@dataclass(frozen=True, slots=True)
class HistoryFigures:
    """What was measured: of storing the wall clock's time, the disk's with it; of the rest the processor's.

    A query's is the median of many, in milliseconds. Of an archive on a server all times are the wall clock's.
    """

    messages: int
    store_per_s: float
    file_mb: float
    bytes_per_message: float
    open_ms: float
    span_ms: float
    picture_ms: float
    picture_worst_ms: float
    minute_ms: float
    soldier_ms: float
    export_s: dict[str, float]
    export_mb: dict[str, float]
    export_worst_s: float


LIMITS: Final = (
    Limit("store_per_s", "messages stored", 4000.0, "/s", at_least=True),
    Limit("bytes_per_message", "bytes a message in the file", 450.0, "B"),
    Limit("span_ms", "first and last time", 50.0, "ms"),
    Limit("picture_ms", "everybody at a time", 50.0, "ms"),
    Limit("minute_ms", "a minute of everybody's tracks", 200.0, "ms"),
    Limit("soldier_ms", "one soldier's tracks, all hours", 500.0, "ms"),
    Limit("export_worst_s", "the slowest format's export of everything", 60.0, "s"),
)


def spoken(soldiers: int, hours: float, every_s: float, seed: int = 1) -> Iterator[Envelope]:
    """What a post's hub says in so many hours, in order of time."""
    chance = random.Random(seed)
    places = [_PLACE for _ in range(soldiers)]
    share = 1.0 / every_s
    for second in range(round(hours * 3600)):
        time_ns = BEGIN_NS + second * NS_PER_S
        for number in range(soldiers):
            if second == 0 or chance.random() < share:
                east, north = chance.gauss(0.0, _SPEED_M_S), chance.gauss(0.0, _SPEED_M_S)
                places[number] = moved_place(places[number], east * every_s, north * every_s)
                yield _track(number, time_ns + chance.randrange(NS_PER_S), places[number], east, north)
        yield Envelope(_POST.address("health", "sa-hub"), _health(time_ns, second))
        yield Envelope(_POST.address("link", "company"), _link(time_ns, second))
        if second % _ALERT_EVERY_S == 0:
            soldier = f"a{chance.randrange(soldiers)}"
            alert = Alert(time_ns=time_ns, soldier=soldier, kind="contact", text="two men, north of the yard")
            yield Envelope(_POST.address("alert", soldier), alert)


def _track(number: int, time_ns: int, place: tuple[float, float], east: float, north: float) -> Envelope:
    track = Track(
        time_ns=time_ns,
        soldier=f"a{number}",
        number=number,
        state="fresh",
        latitude_deg=place[0],
        longitude_deg=place[1],
        height_m=50.0 + number / 7.0,
        accuracy_m=2.0 + number / 9.0,
        east_velocity_m_s=east,
        north_velocity_m_s=north,
        callsign=f"Alpha {number}",
        received_ns=time_ns + NS_PER_S // 3,
        via="company",
        hops=1,
        held_m=3.3,
        held_s=41.7,
    )
    return Envelope(_POST.address("track", track.soldier), track)


def _health(time_ns: int, sequence: int) -> Health:
    counters = {f"radio_cause_{cause}": sequence + cause for cause in range(20)}
    gauges = {f"gauge_{gauge}": sequence / 7.0 for gauge in range(8)}
    return Health(
        time_ns=time_ns, sequence=sequence, service="sa-hub", state="ok", counters=counters, gauges=gauges
    )


def _link(time_ns: int, sequence: int) -> LinkReport:
    return LinkReport(
        time_ns=time_ns,
        sequence=sequence,
        link="company",
        budget_bits_per_s=1200.0,
        bits_per_s=300.0,
        frames_sent=sequence,
        frames_received=sequence,
        frames_rejected=0,
        frames_lost=0,
        bytes_sent=40 * sequence,
        bytes_received=40 * sequence,
    )


def measure(url: str, soldiers: int, hours: float, every_s: float) -> HistoryFigures:
    """Store, open anew, ask, export; ``url`` is of an archive that holds nothing yet."""
    from sa_hub.history.archive import Archive

    with closing(Archive(url)) as archive:
        messages, store_s = _store(archive, spoken(soldiers, hours, every_s))
    clock = time.process_time if url.startswith("sqlite") else time.perf_counter
    begun = clock()
    with closing(Archive(url, create=False)) as archive:
        open_ms = 1e3 * (clock() - begun)
        span = archive.span_ns() or (0, 1)
        chance = random.Random(2)
        times = [chance.randrange(*span) for _ in range(_QUERIES)]
        pictures = [_ms(partial(archive.picture_at, at), clock) for at in times]
        minutes = [_ms(partial(_all, archive, at, at + _MINUTE_NS), clock) for at in times]
        ways = [_ms(partial(_all, archive, span[0], span[1] + 1, each), clock) for each in archive.soldiers()]
        export_s, export_mb = _exports(archive, span, clock)
        return HistoryFigures(
            messages=messages,
            store_per_s=messages / store_s,
            file_mb=_size_bytes(url) / 1e6,
            bytes_per_message=_size_bytes(url) / messages,
            open_ms=open_ms,
            span_ms=_ms(archive.span_ns, clock),
            picture_ms=statistics.median(pictures),
            picture_worst_ms=max(pictures),
            minute_ms=statistics.median(minutes),
            soldier_ms=statistics.median(ways),
            export_s=export_s,
            export_mb=export_mb,
            export_worst_s=max(export_s.values()),
        )


def _all(archive: "Archive", begin_ns: int, end_ns: int, soldier: str | None = None) -> list[Envelope]:
    return list(archive.messages("track", begin_ns, end_ns, soldier))


def _store(archive: "Archive", envelopes: Iterator[Envelope]) -> tuple[int, float]:
    """How many messages there were, and the seconds spent in storing them."""
    messages, seconds = 0, 0.0
    while batch := list(islice(envelopes, _BATCH)):
        seconds += _ms(partial(archive.store, batch), time.perf_counter) / 1e3
        messages += len(batch)
    return messages, seconds


def _exports(
    archive: "Archive", span: tuple[int, int], clock: Clock
) -> tuple[dict[str, float], dict[str, float]]:
    """Seconds and megabytes of exporting everything, by format."""
    from sa_hub.exports.exporting import FORMATS, export
    from sa_hub.exports.source import Source

    seconds, megabytes = {}, {}
    source = Source(archive, span[0], span[1] + 1)
    with tempfile.TemporaryDirectory() as folder:
        for format_ in FORMATS:
            path = Path(folder, f"all.{format_}")
            seconds[format_] = _ms(partial(export, source, path, format_), clock) / 1e3
            megabytes[format_] = path.stat().st_size / 1e6
    return seconds, megabytes


def _ms(work: Callable[[], object], clock: Clock) -> float:
    begun = clock()
    work()
    return 1e3 * (clock() - begun)


def _size_bytes(url: str) -> int:
    """Of a SQLite file, closed or open, or of the tables and indices on a server."""
    if url.startswith("sqlite"):
        path = Path(url.removeprefix("sqlite:///"))
        return sum(each.stat().st_size for each in path.parent.glob(f"{path.name}*"))
    from sqlalchemy import create_engine, text

    sizes = " + ".join(f"pg_total_relation_size('{table}')" for table in ("archive", "address", "message"))
    engine = create_engine(url)
    with engine.connect() as connection:
        size = int(connection.execute(text(f"SELECT {sizes}")).scalar_one())
    engine.dispose()
    return size


def history(
    soldiers: Annotated[int, typer.Option(help="Soldiers.", min=1)] = 40,
    hours: Annotated[float, typer.Option(help="Hours of event time.", min=0.01)] = 8.0,
    every: Annotated[float, typer.Option(help="Seconds between a soldier's reports.", min=1.0)] = 5.0,
    url: Annotated[
        str | None, typer.Option(help="An empty archive on a server, instead of SQLite in a scratch folder.")
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if a limit is missed.")] = False,
    json: Json = None,
) -> None:
    """Store, seek and export hours of a company, as fast as it goes.

    Example: bootprint benchmark history --check
    """
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(url or f"sqlite:///{folder}/history.db", soldiers, hours, every)
    keeps_limits = all(limit.holds(figures) for limit in LIMITS)
    conclude(asdict(figures), partial(_show, figures), keeps_limits=keeps_limits, json=json, check=check)


def _show(figures: HistoryFigures) -> None:
    from rich.console import Console

    console = Console()
    console.print(limits_table(figures, LIMITS, f"{figures.messages} messages, {figures.file_mb:.0f} MB"))
    for format_, seconds in figures.export_s.items():
        console.print(f"{format_:>8}: {figures.export_mb[format_]:7.1f} MB in {seconds:5.1f} s")
