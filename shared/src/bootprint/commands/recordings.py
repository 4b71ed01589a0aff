"""`bootprint record`, `replay` and `info`: recordings of the bus as MCAP files."""

import math
import queue
import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from bootprint.commands.options import Config, Duration, Json, Router, bus_way, parse_speed, write_json
from bootprint.errors import ConfigError, RecordingError
from bootprint.recording import Recorder, Recording
from bootprint.salvage import Salvage
from bootprint.stopping import Stop
from bootprint.topics import BY_SUBJECT, TOPICS, VERSION, check_part, parse_key
from bootprint.zenoh_bus import ZenohBus

_FLUSH_S = 1.0
_POLL_S = 0.1
_NS_PER_S = 1_000_000_000
_SENSORS = frozenset(topic.subject for topic in TOPICS if topic.publisher == "sensor-gateway")

_Inbox = queue.SimpleQueue[tuple[str, bytes, int]]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(record)
    app.command()(replay)
    app.command()(info)


def record(
    out: Annotated[Path, typer.Argument(help="The MCAP file to write.", metavar="OUT.mcap")],
    config: Config = None,
    router: Router = None,
    realm: Annotated[str, typer.Option(help="Record this realm only.")] = "*",
    selector: Annotated[
        str | None, typer.Option(help="Record the keys that match, e.g. 'bp/@v1/alpha/a3/**'.")
    ] = None,
    duration: Duration = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
) -> None:
    """Record the bus into an MCAP file until Ctrl-C.

    Every second what has been heard is on the disk, and a recording that was cut off is still readable.
    Positions, tracks and observations also appear on Foxglove's map.

    Example: bootprint record walk.mcap --duration 60
    """
    with Stop(duration) as stop:
        bus = bus_way(config, router).open(should_stop=stop.is_set)
        try:
            with Recorder(out, overwrite=overwrite) as recorder:
                stop.restart()
                _record(bus, selector or f"{_realm_part(realm)}/{VERSION}/**", recorder, stop)
        finally:
            bus.close()
    typer.echo(f"{out}: {recorder.messages} messages, {out.stat().st_size} bytes")


def _realm_part(realm: str) -> str:
    """A realm's id, or ``*`` for all; ConfigError if it cannot be one."""
    try:
        return realm if realm == "*" else check_part("--realm", realm)
    except ValueError as error:
        raise ConfigError(str(error)) from error


def _record(bus: ZenohBus, selector: str, recorder: Recorder, stop: Stop) -> None:
    # The bus's thread only queues: a slow disk must not make it lose messages.
    inbox: _Inbox = queue.SimpleQueue()
    bus.subscribe_raw(selector, lambda key, payload: inbox.put((key, payload, time.time_ns())))
    flushed = time.monotonic()
    with Console(stderr=True).status("recording") as status:
        while not stop.wait(_POLL_S):
            _drain(inbox, recorder)
            if time.monotonic() - flushed >= _FLUSH_S:
                recorder.flush()
                flushed = time.monotonic()
                status.update(f"recording: {recorder.messages} messages; Ctrl-C ends it")
    bus.close()
    _drain(inbox, recorder)


def _drain(inbox: _Inbox, recorder: Recorder) -> None:
    while not inbox.empty():
        key, payload, received_ns = inbox.get()
        recorder.write_payload(key, payload, received_ns)


def replay(
    file: Annotated[Path, typer.Argument(help="The recording to replay.", metavar="FILE.mcap")],
    speed: Annotated[str, typer.Option(help="Times as fast as it was recorded, or 'max'.")] = "1",
    config: Config = None,
    router: Router = None,
    subject: Annotated[list[str] | None, typer.Option(help="Only this subject; may be repeated.")] = None,
    sensors: Annotated[bool, typer.Option("--sensors", help="Only what sensors said.")] = False,
    salvage: Annotated[
        bool, typer.Option("--salvage", help="Replay what is intact of a damaged file.")
    ] = False,
    duration: Duration = None,
) -> None:
    """Publish a recording on the bus, under the keys and with the times it was recorded with.

    With --sensors the services compute everything else anew.

    Example: bootprint replay walk.mcap --speed 10 --sensors
    """
    factor = parse_speed(speed)
    subjects = _subjects(subject or [], sensors)
    recording = Recording(file, salvage=salvage)
    with Stop(duration) as stop:
        bus = bus_way(config, router).open(lossless=factor == math.inf, should_stop=stop.is_set)
        try:
            stop.restart()
            count = _replay(recording, bus, subjects, factor, stop)
        finally:
            bus.close()
    skipped = sum(recording.report.invalid.values())
    typer.echo(
        f"{file}: {count} messages published" + (f", {skipped} invalid ones skipped" if skipped else "")
    )


def _subjects(subjects: list[str], sensors: bool) -> frozenset[str]:
    unknown = set(subjects) - BY_SUBJECT.keys()
    if unknown:
        raise ConfigError(f"--subject {min(unknown)!r} is unknown; known: {', '.join(BY_SUBJECT)}")
    chosen = frozenset(subjects) | (_SENSORS if sensors else frozenset())
    return chosen or frozenset(BY_SUBJECT)


def _replay(recording: Recording, bus: ZenohBus, subjects: frozenset[str], factor: float, stop: Stop) -> int:
    started, first_ns, count = time.monotonic(), None, 0
    for log_time_ns, envelope in recording.envelopes():
        if envelope.address.subject not in subjects:
            continue
        first_ns = log_time_ns if first_ns is None else first_ns
        due = started + (log_time_ns - first_ns) / _NS_PER_S / factor
        if stop.wait(due - time.monotonic()):
            break
        bus.publish(envelope)
        count += 1
    return count


def info(
    file: Annotated[Path, typer.Argument(help="The recording.", metavar="FILE.mcap")],
    json: Json = None,
    salvage: Annotated[
        Path | None,
        typer.Option(help="Write everything that is intact to this new file.", metavar="OUT.mcap"),
    ] = None,
) -> None:
    """Tell what a recording holds, and what is wrong with it.

    A damaged recording ends with exit code 2, unless its intact messages are salvaged into a new one.

    Example: bootprint info broken.mcap --salvage mended.mcap
    """
    recording = Recording(file, salvage=True)
    for _ in recording.envelopes():
        pass  # every message is decoded, so that invalid ones are counted
    if json:
        write_json(_summary(recording.report), json)
    else:
        _print_report(recording.report)
    if salvage:
        with Recorder(salvage) as recorder:
            recording.copy_to(recorder)
    elif recording.report.faults:
        raise RecordingError(f"{recording.report.sentence()}; salvage them with --salvage OUT.mcap")


def _summary(report: Salvage) -> dict[str, Any]:
    return {
        "file": report.path.name,
        "messages": report.messages,
        "duration_s": (report.last_ns - report.first_ns) / _NS_PER_S,
        "derived": report.derived,
        "unknown": report.unknown,
        "invalid": sum(report.invalid.values()),
        "lost": report.lost,
        "truncated_at": report.truncated_at,
        "faults": [{"offset": fault.offset, "what": fault.what} for fault in report.faults],
        "topics": _topic_rows(report),
    }


def _topic_rows(report: Salvage) -> list[dict[str, Any]]:
    return [
        {
            "key": key,
            "type": parse_key(key).topic.message.__name__,
            "messages": count.messages,
            "first_s": count.first_ns / _NS_PER_S,
            "duration_s": (count.last_ns - count.first_ns) / _NS_PER_S,
            "invalid": report.invalid[key],
        }
        for key, count in sorted(report.topics.items())
    ]


def _print_report(report: Salvage) -> None:
    table = Table("key", "type")
    table.columns[0].overflow = "fold"
    for heading in ("messages", "duration s", "rate Hz", "invalid"):
        table.add_column(heading, justify="right")
    for row in _topic_rows(report):
        rate = (row["messages"] - 1) / row["duration_s"] if row["duration_s"] > 0 else None
        table.add_row(
            row["key"],
            row["type"],
            str(row["messages"]),
            f"{row['duration_s']:.1f}",
            "" if rate is None else f"{rate:.1f}",
            str(row["invalid"] or ""),
        )
    console = Console()
    console.print(table)
    console.print(
        f"{report.sentence()}; {report.derived} copies for other tools, {report.unknown} of unknown kind",
        soft_wrap=True,
        markup=False,
    )
