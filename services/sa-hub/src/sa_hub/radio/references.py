"""What each sender told of whom: what its updates are resolved against, and when they cannot be.

An update tells places modulo a lattice, so it means something only to who knows roughly where the soldier is. A
sender vouches, frame by frame, that prediction from any of its newest ``misses + 1`` entries of a soldier leads to
less than half the modulus from the truth. A receiver counts the sender's frames that it missed since its own last
entry of that soldier; if they are no more, its entry is one of those, and the place it finds is the right one. If
they are more, the entry is left out and counted: rather nothing than something wrong.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Final

from sa_hub.radio import quantise as q
from sa_hub.radio.content import CONDITIONS, Entry, Facing, Level, Quality, Report, Reports, Update
from sa_hub.radio.grid import Grid
from sa_hub.radio.ground import METRES_PER_DEG, cosine, moved_deg, turn_deg
from sa_hub.radio.replay import Heard
from sa_hub.radio.update_codec import HEIGHT_MODULUS, TIME_MODULUS

_CLOCK_SAMPLES: Final = 8
_STAYS_M: Final = 4.0
"""Who was told so near to where he was before may still face as he did."""


@dataclass(slots=True)
class _Reference:
    """A soldier's newest entry: the sender's counter then, frames heard until then, entries refused since."""

    report: Report
    counter: int
    heard: int
    refused: int = 0


@dataclass(slots=True)
class _Station:
    """One sender: which of its frames came in order, how many in all, and what they told."""

    in_order: Heard
    heard: int = 1
    told: dict[int, _Reference] = field(default_factory=dict)
    behind_ns: list[int] = field(default_factory=list)

    def missed_since(self, reference: _Reference, counter: int) -> int:
        """At most so many entries of a soldier came between the reference and this frame."""
        late = counter < self.in_order.highest
        in_order = 1 if late else self.heard - reference.heard
        return counter - reference.counter - in_order + reference.refused


class References:
    """All senders of one net. ``unresolved`` counts the entries that could not be resolved."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._stations: dict[int, _Station] = {}
        self.unresolved = 0

    def clear(self) -> None:
        """The clock was set back: what was told is of another time."""
        self._stations.clear()

    def heard(self, sender: int, epoch: int, counter: int) -> None:
        """A frame of this sender was opened, whatever it says; each frame once, before what it tells is taken."""
        station = self._stations.get(sender)
        if station is None or epoch > station.in_order.epoch:
            self._stations[sender] = _Station(Heard(epoch, counter))
        elif epoch == station.in_order.epoch and counter > station.in_order.highest:
            # One that comes late counts as missed: too many rather than too few.
            station.in_order.accept(epoch, counter)
            station.heard += 1

    def in_order(self, sender: int) -> Heard | None:
        """Which of a sender's frames came in order, so that its updates could build on them."""
        station = self._stations.get(sender)
        return None if station is None else station.in_order

    def told(self, sender: int, epoch: int, counter: int, content: Reports, now_ns: int) -> None:
        """The sender has told these in full."""
        station = self._stations[sender]
        if epoch != station.in_order.epoch:
            return
        if content.tick is not None:
            _note_clock(station, now_ns - content.tick * q.TICK_NS)
        for report in content.reports:
            self._refer(station, counter, report)

    def resolve(
        self, sender: int, epoch: int, counter: int, update: Update, now_ns: int
    ) -> tuple[Report, ...]:
        """The reports that an update means to us; entries that mean nothing are counted and left out."""
        station = self._stations[sender]
        if epoch != station.in_order.epoch:
            self.unresolved += len(update.entries)
            return ()
        tick = _nearest_tick(update, now_ns - min(station.behind_ns, default=0))
        found: list[Report] = []
        for entry in update.entries:
            report = self._resolved(station, counter, update, entry, tick)
            if report is None:
                self.unresolved += 1
                continue
            self._refer(station, counter, report)
            found.append(report)
        if found:
            _note_clock(station, now_ns - tick * q.TICK_NS)
        return tuple(found)

    def _resolved(
        self, station: _Station, counter: int, update: Update, entry: Entry, tick: int
    ) -> Report | None:
        reference = station.told.get(entry.number)
        if reference is None or counter < reference.counter:
            return None
        if station.missed_since(reference, counter) > update.misses:
            reference.refused += 1
            return None
        return resolved(self._grid, reference.report, update, entry, tick)

    def _refer(self, station: _Station, counter: int, report: Report) -> None:
        known = station.told.get(report.number)
        if known is None or counter >= known.counter:
            station.told[report.number] = _Reference(report, counter, station.heard)


def resolved(grid: Grid, reference: Report, update: Update, entry: Entry, tick: int) -> Report | None:
    """What an entry says of a soldier last told as ``reference``; None if there is no such place.

    ``tick`` is the frame's time. The place is the one nearest to the prediction with the low bits that were told.
    """
    time_ns = tick * q.TICK_NS
    place = reference.latitude_deg, reference.longitude_deg
    velocity = reference.east_m_s, reference.north_m_s
    latitude_deg, longitude_deg = moved_deg(*place, velocity, time_ns - reference.time_ns)
    reach_bits = update.reach_of(entry)
    mask = (1 << reach_bits) - 1
    row = grid.row_nearest(entry.row & mask, reach_bits, latitude_deg, update.resolution)
    column = grid.column_nearest(entry.column & mask, reach_bits, longitude_deg, update.resolution)
    if not q.is_row(row, update.resolution):
        return None
    return _at(reference, grid.centre_deg(row, column, update.resolution), entry, time_ns, update.resolution)


def _at(
    reference: Report, place_deg: tuple[float, float], entry: Entry, frame_ns: int, resolution: int
) -> Report:
    """The reference with what the entry changes; the place told is that of the frame's time."""
    velocity = q.velocity_of(*entry.velocity) if entry.velocity else (0.0, 0.0)
    if entry.steady:
        velocity = reference.east_m_s, reference.north_m_s
    age_ns = entry.age_ticks * q.TICK_NS
    if age_ns:
        east_m_s, north_m_s = velocity
        place_deg = moved_deg(*place_deg, (-east_m_s, -north_m_s), age_ns)
    report = replace(
        reference,
        time_ns=frame_ns - age_ns,
        latitude_deg=place_deg[0],
        longitude_deg=place_deg[1],
        east_m_s=velocity[0],
        north_m_s=velocity[1],
        cell_m=q.cell_m(resolution),
    )
    report = replace(report, facing_deg=_facing_deg(reference, report, entry.facing))
    return _with_level(_with_quality(report, entry.quality), entry.level)


def _facing_deg(before: Report, now: Report, facing: Facing | None) -> float | None:
    """Where he faces: as told, else as before while he stands where he stood."""
    if facing is not None:
        return None if facing.direction is None else q.direction_deg(facing.direction)
    if before.facing_deg is None or now.east_m_s or now.north_m_s:
        return None
    return before.facing_deg if _apart_m(before, now) < _STAYS_M else None


def _with_quality(report: Report, quality: Quality | None) -> Report:
    if quality is None:
        return report
    return replace(
        report,
        accuracy_m=q.ACCURACIES_M[quality.accuracy],
        mode=q.MODES[quality.mode],
        hops=quality.hops,
        condition=CONDITIONS[quality.condition],
    )


def _apart_m(one: Report, other: Report) -> float:
    north = one.latitude_deg - other.latitude_deg
    east = turn_deg(one.longitude_deg - other.longitude_deg) * cosine(one.latitude_deg)
    return math.hypot(north, east) * METRES_PER_DEG


def _with_level(report: Report, level: Level | None) -> Report:
    if level is None:
        return report
    return replace(report, floor=level.floor, height_m=_nearest_height_m(level.height_m, report.height_m))


def _nearest_height_m(low: int | None, before_m: float | None) -> float | None:
    """The height with these low bits that is nearest to the one told before; unknown if no frame can tell it."""
    if low is None or before_m is None:
        return None
    before, half = round(before_m), HEIGHT_MODULUS // 2
    height_m = float(before + (low - before + half) % HEIGHT_MODULUS - half)
    return height_m if q.height_index(height_m) == height_m else None


def _nearest_tick(update: Update, expected_ns: int) -> int:
    """The frame's time: the nearest to when frames of this sender are expected to have been sent."""
    expected, half = q.tick_of(expected_ns), TIME_MODULUS // 2
    return expected + (update.tick - expected + half) % TIME_MODULUS - half


def _note_clock(station: _Station, behind_ns: int) -> None:
    """How far a frame's newest time was behind our clock: the least of the last ones is the clocks' difference."""
    station.behind_ns = [*station.behind_ns, behind_ns][-_CLOCK_SAMPLES:]
