"""`bootprint history info`, `export` and `import`: what an archive holds, out of it, and into it."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from bootprint.commands.options import Json, write_json
from bootprint.errors import ConfigError

if TYPE_CHECKING:
    from rich.progress import Progress

    from bootprint.bus import Envelope
    from sa_hub.history.archive import Archive

_TIME_FORMATS: Final = ["%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H:%M"]
_BATCH: Final = 5000

Where = Annotated[
    str, typer.Argument(help="The archive: a file, or a url of SQLite or PostgreSQL.", metavar="ARCHIVE")
]
Begin = Annotated[
    datetime | None, typer.Option("--begin", formats=_TIME_FORMATS, help="From this time on, UTC.")
]
End = Annotated[datetime | None, typer.Option("--end", formats=_TIME_FORMATS, help="Before this time, UTC.")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    history = typer.Typer(help="What a command post has kept: look, export, import.", no_args_is_help=True)
    history.command("info")(info)
    history.command("export")(export)
    history.command("import")(import_)
    app.add_typer(history, name="history")


def url_of(where: str) -> str:
    """A file's name as the url of a SQLite archive; a url as it is."""
    return where if "://" in where else f"sqlite:///{Path(where).absolute()}"


def info(archive: Where, json: Json = None) -> None:
    """Tell what an archive holds: span, soldiers, messages of each subject.

    Example: bootprint history info state/history.db
    """
    from sa_hub.exports.source import utc

    with _opened(archive, create=False) as opened:
        summary = _summary(opened)
    if json is not None:
        write_json(summary, json)
        return
    span = (
        "empty" if summary["begin_ns"] is None else f"{utc(summary['begin_ns'])} to {utc(summary['end_ns'])}"
    )
    typer.echo(f"{archive}: {span}; soldiers: {', '.join(summary['soldiers']) or 'none'}")
    for subject, count in summary["messages"].items():
        typer.echo(f"{count:>10}  {subject}")


def _summary(archive: "Archive") -> dict[str, Any]:
    from bootprint.topics import BY_SUBJECT

    span = archive.span_ns()
    counts = {subject: archive.count(subject, -(2**63), 2**63 - 1) for subject in BY_SUBJECT}
    return {
        "begin_ns": span and span[0],
        "end_ns": span and span[1],
        "soldiers": archive.soldiers(),
        "messages": {subject: count for subject, count in counts.items() if count},
    }


def export(
    archive: Where,
    out: Annotated[Path, typer.Argument(help="The file to write.", metavar="OUT")],
    format_: Annotated[
        str | None,
        typer.Option("--format", help="gpx, kml, geojson, csv or mcap; by OUT's ending by default."),
    ] = None,
    begin: Begin = None,
    end: End = None,
    soldier: Annotated[list[str] | None, typer.Option(help="Only this soldier; may be repeated.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
) -> None:
    """Write an archive's tracks, observations and alerts in a format that other programs read.

    Example: bootprint history export state/history.db patrol.gpx --soldier a1
    """
    from sa_hub.exports.exporting import export as write
    from sa_hub.exports.exporting import format_of
    from sa_hub.exports.source import Source

    chosen = format_of(out, format_)
    with _opened(archive, create=False) as opened, _progress() as progress:
        begin_ns, end_ns = _span(opened, begin, end, archive)
        _check_soldiers(opened, soldier or [], archive)
        total = sum(opened.count(subject, begin_ns, end_ns) for subject in ("track", "alert", "observation"))
        task = progress.add_task(f"exporting {out.name}", total=total)
        source = Source(opened, begin_ns, end_ns, tuple(soldier or ()), lambda: progress.advance(task))
        write(source, out, chosen, overwrite=overwrite)
        progress.update(task, completed=total)
    typer.echo(f"{out}: {out.stat().st_size} bytes")


def _span(archive: "Archive", begin: datetime | None, end: datetime | None, where: str) -> tuple[int, int]:
    """The asked-for span within what there is; ConfigError if there is nothing in it."""
    from sa_hub.exports.source import seconds_ns, utc

    known = archive.span_ns()
    if known is None:
        raise ConfigError(f"{where}: is empty, there is nothing to export")
    begin_ns = known[0] if begin is None else seconds_ns(begin)
    end_ns = known[1] + 1 if end is None else seconds_ns(end)
    if not max(begin_ns, known[0]) < min(end_ns, known[1] + 1):
        raise ConfigError(f"{where}: nothing in that span; there is {utc(known[0])} to {utc(known[1])}")
    return begin_ns, end_ns


def _check_soldiers(archive: "Archive", soldiers: list[str], where: str) -> None:
    known = archive.soldiers()
    for soldier in soldiers:
        if soldier not in known:
            raise ConfigError(f"{where}: --soldier {soldier!r} has no tracks; known: {', '.join(known)}")


def import_(
    recording: Annotated[Path, typer.Argument(help="The recording to read.", metavar="FILE.mcap")],
    archive: Where,
    hub: Annotated[
        str | None, typer.Option(help="Only the picture of this soldier's hub; for recordings of several.")
    ] = None,
    salvage: Annotated[
        bool, typer.Option("--salvage", help="Read what is intact of a damaged file.")
    ] = False,
) -> None:
    """Take a recording's tracks, alerts, observations and so on into an archive; what is there already stays.

    Example: bootprint history import exercise.mcap review.db --hub cp
    """
    from bootprint.recording import Recording

    source = Recording(recording, salvage=salvage)
    with _opened(archive, create=True) as opened, _progress() as progress:
        task = progress.add_task(f"importing {recording.name}", total=source.report.messages)
        kept = 0
        for batch in _batches(_kept(source.envelopes(), hub, lambda: progress.advance(task))):
            opened.store(batch)
            kept += len(batch)
    typer.echo(f"{archive}: {kept} of {source.report.messages} messages taken in")


def _kept(envelopes: Iterable[tuple[int, "Envelope"]], hub: str | None, advance: Any) -> Iterator["Envelope"]:
    from sa_hub.history.settings import DEFAULT_SUBJECTS

    for _, envelope in envelopes:
        advance()
        if envelope.address.subject in DEFAULT_SUBJECTS and hub in (None, envelope.address.soldier):
            yield envelope


def _batches(envelopes: Iterator["Envelope"]) -> Iterator[list["Envelope"]]:
    while batch := list(islice(envelopes, _BATCH)):
        yield batch


@contextmanager
def _opened(where: str, *, create: bool) -> Iterator["Archive"]:
    from sa_hub.history.archive import Archive

    with closing(Archive(url_of(where), create=create)) as archive:
        yield archive


@contextmanager
def _progress() -> Iterator["Progress"]:
    """A bar on the terminal; none where there is no terminal."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
        yield progress
