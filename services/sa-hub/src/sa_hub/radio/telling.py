"""The frame that says what was chosen: reports in full, or entries against what was told of each before."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio import quantise as q
from sa_hub.radio.content import Entry, Report, Reports, Update
from sa_hub.radio.details import details_code, facing_to_tell, level_to_tell, quality_to_tell
from sa_hub.radio.grid import Grid
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, turn_deg
from sa_hub.radio.history import History
from sa_hub.radio.offers import Offer
from sa_hub.radio.outlook import Outlook
from sa_hub.radio.picture import BoolArray
from sa_hub.radio.squad import partition
from sa_hub.radio.wares import Candidates

FRESH_NS: Final = 2 * NS_PER_S
"""A report that is younger is told as of the frame's time, moved on; an older one with its age."""
_FASTEST_ON_FOOT: Final = 9
_CHANGED_BITS: Final = 3
"""Which details have changed, told of who has any."""
_QUALITY_BITS: Final = 10
_LEVEL_BITS: Final = 2
_FLOOR_BITS: Final = 7
_HEIGHT_BITS: Final = 8
_FACING_BITS: Final = 5
_LEVEL_REPEATS: Final = 2
"""Entries in which a new level or facing is told at least; who misses them all has the old one until the next in
full."""
_HEIGHT_REACH_M: Final = 50.0
"""Of low bits that mean ±128 m, since a receiver may have stayed with an older height."""


@dataclass(frozen=True)
class Telling:
    """All that could be told at one moment. ``resolution`` as it would be told.

    ``faces`` (n,): whose facing is told: of who stands, where bits are cheap.
    """

    outlook: Outlook
    faces: BoolArray
    resolution: int
    now_ns: int
    history: History
    grid: Grid

    @property
    def who(self) -> Candidates:
        """Who could be told."""
        return self.outlook.who

    @property
    def velocity(self) -> FloatArray:
        """(n, 2) m/s as it would be told."""
        return self.outlook.told

    def aimed(self) -> tuple[FloatArray, FloatArray]:
        """(n,) latitude and longitude to tell."""
        who = self.who
        east_m, north_m = self.outlook.aims_m.T
        longitude = who.longitude + east_m / (METRES_PER_DEG * cosines(who.latitude))
        latitude = np.clip(who.latitude + north_m / METRES_PER_DEG, -90.0, 90.0)
        return latitude, turn_deg(longitude)

    def out_of_reach(self) -> BoolArray:
        """(n,) whether the height cannot be told by its low bits: not known before, or far from it."""
        told = self.history.told
        pairs = zip(self.who.slots.tolist(), self.who.reports, strict=True)
        return np.array(
            [
                slot in told and not _height_in_reach(each.height_m, told[slot].height_m)
                for slot, each in pairs
            ],
            dtype=np.bool_,
        )

    def changes(self) -> BoolArray:
        """(n, DEPTH, DETAILS) whether each detail is to be told to who may have missed so many entries."""
        told = self.history.told
        pairs = zip(self.who.slots.tolist(), self.who.reports, strict=True)
        codes = [details_code(report, told.get(slot)) for slot, report in pairs]
        differ = self.history.details_differ(self.who.slots, np.array(codes, dtype=np.int64))
        differ[:, :, 2] &= self.faces[:, None]
        differ[:, _LEVEL_REPEATS:, 1:] = differ[:, _LEVEL_REPEATS - 1, None, 1:]
        return differ

    def changes_bits(self) -> FloatArray:
        """(n, DEPTH) what telling the changes takes, by how much may be missed."""
        widths = [
            (
                _QUALITY_BITS,
                _LEVEL_BITS
                + _FLOOR_BITS * (each.floor is not None)
                + _HEIGHT_BITS * (each.height_m is not None),
                _FACING_BITS,
            )
            for each in self.who.reports
        ]
        changes = self.changes()
        bits: FloatArray = (changes * np.array(widths, dtype=np.float64)[:, None, :]).sum(axis=2)
        return bits + _CHANGED_BITS * changes.any(axis=2)

    def urgent(self) -> BoolArray:
        """(n,) whether floor or condition is other than last told."""
        told = self.history.told
        pairs = zip(self.who.slots.tolist(), self.who.reports, strict=True)
        return np.array(
            [
                slot in told and (told[slot].floor, told[slot].condition) != (each.floor, each.condition)
                for slot, each in pairs
            ],
            dtype=np.bool_,
        )

    def turned(self) -> BoolArray:
        """(n,) who faces otherwise than last told, and may be told so."""
        return self.changes()[:, 0, 2] if self.faces.any() else self.faces

    def in_full(self, offer: Offer) -> Reports:
        """As many of the chosen as fit beside the first against one anchor."""
        latitude, longitude = self.aimed()
        picked = [
            self._report(index, (float(latitude[index]), float(longitude[index])))
            for index in offer.picked.tolist()
        ]
        return Reports(tuple(partition(picked, self.resolution)[0]), tick=q.tick_of(self.now_ns))

    def _report(self, index: int, place_deg: tuple[float, float]) -> Report:
        """Told in full: a fresh report as of now, an older one as it is."""
        report = self.who.reports[index]
        if abs(self.now_ns - report.time_ns) <= FRESH_NS:
            latitude_deg, longitude_deg = place_deg
            report = replace(
                report, time_ns=self.now_ns, latitude_deg=latitude_deg, longitude_deg=longitude_deg
            )
        return replace(
            report,
            east_m_s=float(self.velocity[index, 0]),
            north_m_s=float(self.velocity[index, 1]),
            facing_deg=report.facing_deg if self.faces[index] else None,
        )

    def update(self, offer: Offer, misses: int) -> Update:
        """The chosen, for whoever missed no more than ``misses``."""
        picked = sorted(offer.picked.tolist(), key=lambda index: self.who.reports[index].number)
        latitude, longitude = self.aimed()
        changes = self.changes()[:, misses]
        entries = tuple(
            _varied(
                self._entry(index, (float(latitude[index]), float(longitude[index])), changes[index]), how
            )
            for index, how in zip(picked, offer.how(picked), strict=True)
        )
        tick = q.tick_of(self.now_ns)
        return Update(tick, self.resolution, offer.reach_bits, misses, entries, varied=offer.varied)

    def _entry(self, index: int, place_deg: tuple[float, float], changed: BoolArray) -> Entry:
        report, told = self.who.reports[index], self.history.told.get(int(self.who.slots[index]))
        codes = q.velocity_codes(float(self.velocity[index, 0]), float(self.velocity[index, 1]))
        return Entry(
            number=report.number,
            row=self.grid.row(place_deg[0], self.resolution),
            column=self.grid.column(place_deg[1], self.resolution),
            velocity=None if codes is None else (codes[0], _on_foot(codes[1])),
            age_ticks=_age_ticks(report, self.now_ns),
            quality=quality_to_tell(report, told) if changed[0] else None,
            level=level_to_tell(report, told) if changed[1] else None,
            facing=facing_to_tell(report, told) if changed[2] else None,
        )


def _varied(entry: Entry, how: tuple[bool, bool]) -> Entry:
    """The entry with more bits of its place, or without velocity, as the frame's offer has it."""
    far, steady = how
    return replace(entry, far=far, steady=steady, velocity=None if steady else entry.velocity)


def _age_ticks(report: Report, now_ns: int) -> int:
    """What is told of a report's age: nothing while it is fresh."""
    age_ns = now_ns - report.time_ns
    return 0 if age_ns <= FRESH_NS else min(-(-age_ns // q.TICK_NS), q.LONGEST_AGE_TICKS)


def _height_in_reach(height_m: float | None, told_m: float | None) -> bool:
    return height_m is None or (told_m is not None and abs(height_m - told_m) <= _HEIGHT_REACH_M)


def _on_foot(speed: int) -> int:
    """The nearest speed of people on foot; what is faster stays."""
    if speed > _FASTEST_ON_FOOT:
        return speed
    return min(q.PACES, key=lambda code: abs(q.SPEEDS_M_S[code] - q.SPEEDS_M_S[speed]))
