"""One anchor for many soldiers: where it lies, each one's offset from it, and who fits beside whom."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sa_hub.radio import quantise as q
from sa_hub.radio.content import Report

MAX_SOLDIERS: Final = 64
OFFSET_LIMIT: Final = (1 << 15) - 1
UP_LIMIT_M: Final = (1 << 7) - 1
SPAN_LIMIT: Final = (1 << 10) - 1
"""Cells that soldiers of one frame lie apart at most: who is farther off would make everyone's offsets wider."""


@dataclass(frozen=True, slots=True)
class Anchor:
    """South-west lower corner of all reports of a frame (lattice row and column, metres), and the newest's tick."""

    tick: int
    resolution: int
    row: int
    column: int
    height: int | None


@dataclass(frozen=True, slots=True)
class Offsets:
    """Cells east and north of the anchor, metres above it (None: height unknown); none is negative."""

    east: int
    north: int
    up: int | None


def anchor_of(reports: Sequence[Report], resolution: int, tick: int | None = None) -> Anchor:
    """The anchor of these reports at a ``tick``, the newest's if None; columns count from the first report's."""
    rows = [q.latitude_index(report.latitude_deg, resolution) for report in reports]
    columns = [q.longitude_index(report.longitude_deg, resolution) for report in reports]
    bits = q.LONGITUDE_BITS - resolution
    west = min(q.wrap(column - columns[0], bits) for column in columns)
    heights = [q.height_index(report.height_m) for report in reports if report.height_m is not None]
    return Anchor(
        tick=max(q.tick_of(report.time_ns) for report in reports) if tick is None else tick,
        resolution=resolution,
        row=min(rows),
        column=q.wrap(columns[0] + west, bits),
        height=min(heights, default=None),
    )


def offsets_of(report: Report, anchor: Anchor) -> Offsets:
    """Where a report lies relative to the anchor of a set it belongs to."""
    column = q.longitude_index(report.longitude_deg, anchor.resolution)
    known = report.height_m is not None and anchor.height is not None
    return Offsets(
        east=(column - anchor.column) % (1 << (q.LONGITUDE_BITS - anchor.resolution)),
        north=q.latitude_index(report.latitude_deg, anchor.resolution) - anchor.row,
        up=q.height_index(report.height_m or 0.0) - (anchor.height or 0) if known else None,
    )


def partition(reports: Sequence[Report], resolution: int) -> list[list[Report]]:
    """Groups that each fit one frame's offsets and ages, in the order given: greedy, the first report leads."""
    groups: list[list[Report]] = []
    for report in reports:
        for group in groups:
            if len(group) < MAX_SOLDIERS and _fits([*group, report], resolution):
                group.append(report)
                break
        else:
            groups.append([report])
    return groups


def _fits(reports: list[Report], resolution: int) -> bool:
    anchor = anchor_of(reports, resolution)
    if anchor.tick - min(q.tick_of(report.time_ns) for report in reports) > q.LONGEST_AGE_TICKS:
        return False
    offsets = [offsets_of(report, anchor) for report in reports]
    return all(
        offset.east <= SPAN_LIMIT and offset.north <= SPAN_LIMIT and (offset.up or 0) <= UP_LIMIT_M
        for offset in offsets
    )
