"""`bootprint benchmark hub`: what a command post's hub costs, by how many soldiers it keeps in its picture.

Real hubs of a company speak (`hub_company`), the post's hub hears it all, relays it to the net above, and publishes
its picture. Each size runs in a process of its own. Merging alone is measured beside parsing the same number of
reports as XML, in turns, so that both meet the same machine.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from bootprint.commands.options import Json
from bootprint.errors import BootprintError
from proving_ground.performance.cores import one_core
from proving_ground.performance.hub_company import Company, HeardFrame
from proving_ground.performance.hub_work import Work, cot_events, merge, parse_cot
from proving_ground.performance.limits import Limit, conclude, limits_table

SIZES = (12, 40, 120, 500)
MERGED = 500
"""Soldiers whose reports are merged as fast as possible."""


@dataclass(frozen=True, slots=True)
class HubRow:
    """A post's hub with so many soldiers; frames and processor time per second of event time, memory in all."""

    soldiers: int
    frames_heard_per_s: float
    reports_per_s: float
    frames_sent_per_s: float
    cpu_ms_per_s: float
    resident_mb: float


@dataclass(frozen=True, slots=True)
class HubFigures:
    """What was measured: rows by size, and merging on one core, against parsing as many reports as XML.

    ``own_mb_most`` is what the largest picture needs beyond the smallest.
    """

    rows: tuple[HubRow, ...]
    merged_reports: int
    merged_per_s: float
    xml_per_s: float
    times_xml: float
    cpu_ms_per_s_most: float
    own_mb_most: float
    resident_mb_most: float


LIMITS = (
    Limit("merged_per_s", "reports opened, merged and published, one core", 20_000.0, "/s", at_least=True),
    Limit("times_xml", "as many as are parsed from Cursor on Target (XML)", 0.25, "times", at_least=True),
    Limit("cpu_ms_per_s_most", "processor time a second, largest picture", 150.0, "ms"),
    Limit("own_mb_most", "memory that the largest picture takes beyond the smallest", 20.0, "MB"),
    Limit("resident_mb_most", "resident, largest picture", 120.0, "MB"),
)


class _Played(msgspec.Struct, frozen=True):
    """What `fresh_hub` says."""

    cpu_s: float
    heard: int
    sent: int
    reports: int
    resident_mb: float


def measure(sizes: Sequence[int], duration_s: int, turns: int) -> HubFigures:
    """All figures."""
    rows = hub_rows(sizes, duration_s)
    work, xml_s = _merged(duration_s, turns)
    return HubFigures(
        rows=rows,
        merged_reports=work.reports,
        merged_per_s=work.reports / work.cpu_s,
        xml_per_s=work.reports / xml_s,
        times_xml=xml_s / work.cpu_s,
        cpu_ms_per_s_most=max(row.cpu_ms_per_s for row in rows),
        own_mb_most=max(row.resident_mb for row in rows) - min(row.resident_mb for row in rows),
        resident_mb_most=max(row.resident_mb for row in rows),
    )


def hub_rows(sizes: Sequence[int], duration_s: int) -> tuple[HubRow, ...]:
    """A row for each size of a picture, each of a process of its own."""
    return tuple(_row(size, duration_s) for size in sizes)


def _row(soldiers: int, duration_s: int) -> HubRow:
    played = _play_fresh(soldiers, Company(soldiers).frames(duration_s), duration_s)
    return HubRow(
        soldiers=soldiers,
        frames_heard_per_s=played.heard / duration_s,
        reports_per_s=played.reports / duration_s,
        frames_sent_per_s=played.sent / duration_s,
        cpu_ms_per_s=1e3 * played.cpu_s / duration_s,
        resident_mb=played.resident_mb,
    )


def _play_fresh(soldiers: int, frames: Sequence[HeardFrame], duration_s: int) -> _Played:
    """Let a fresh process keep the picture."""
    from proving_ground.performance import fresh_hub

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "frames.msgpack")
        path.write_bytes(msgspec.msgpack.encode([(frame.time_ns, frame.data) for frame in frames]))
        command = [sys.executable, "-m", fresh_hub.__name__, str(path), str(soldiers), str(duration_s)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        return msgspec.json.decode(done.stdout, type=_Played)
    except msgspec.MsgspecError:
        raise BootprintError(f"the hub's process failed: {done.stderr.strip()[-400:]}") from None


def _merged(duration_s: int, turns: int) -> tuple[Work, float]:
    """The fastest merge of a company's frames, and the least time to parse as many reports as XML."""
    company = Company(MERGED)
    frames = company.frames(duration_s)
    with one_core():
        works = [merge(company, frames)]
        events = cot_events(works[0].reports)
        xml_s = [parse_cot(events)]
        for _ in range(turns - 1):
            works.append(merge(company, frames))
            xml_s.append(parse_cot(events))
    return min(works, key=lambda work: work.cpu_s), min(xml_s)


def hub(
    seconds: Annotated[int, typer.Option(help="Seconds of event time.", min=5)] = 30,
    turns: Annotated[int, typer.Option(help="Merging: best of this many turns.", min=1)] = 3,
    check: Annotated[bool, typer.Option("--check", help="Exit 1 if a limit is missed.")] = False,
    json: Json = None,
) -> None:
    """Measure a command post's hub with 12 to 500 soldiers: processor time, memory, reports merged a second.

    Example: bootprint benchmark hub --check
    """
    figures = measure(SIZES, seconds, turns)
    keeps_limits = all(limit.holds(figures) for limit in LIMITS)
    conclude(asdict(figures), partial(show, figures), keeps_limits=keeps_limits, json=json, check=check)


def show(figures: HubFigures) -> None:
    """Rows by size, then the limits."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    headings = ("soldiers", "frames heard/s", "reports/s", "frames sent/s", "CPU ms/s", "resident MB")
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    for row in figures.rows:
        table.add_row(str(row.soldiers), *(f"{value:.1f}" for value in list(asdict(row).values())[1:]))
    console = Console()
    console.print(table)
    console.print()
    console.print(limits_table(figures, LIMITS, "of a command post's hub"))
    console.print(
        f"{figures.merged_reports} reports of {MERGED} soldiers merged; "
        f"{figures.xml_per_s:.0f} a second are parsed as XML.",
        highlight=False,
    )
