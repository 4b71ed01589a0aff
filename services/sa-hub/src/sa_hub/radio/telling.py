"""The frame that says what was chosen: reports in full, or entries against what was told of each before."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bootprint.clock import NS_PER_S
from sa_hub.radio import quantise as q
from sa_hub.radio.content import Entry, Report, Reports, Update
from sa_hub.radio.details import details_code, level_to_tell, quality_to_tell
from sa_hub.radio.grid import Grid
from sa_hub.radio.ground import METRES_PER_DEG, FloatArray, cosines, moved_deg
from sa_hub.radio.history import History
from sa_hub.radio.offers import Offer
from sa_hub.radio.picture import BoolArray
from sa_hub.radio.squad import partition
from sa_hub.radio.wares import Candidates, brief_s

FRESH_NS: Final = 2 * NS_PER_S
"""A report that is younger is told as of the frame's time, moved on; an older one with its age."""
_AIM_S: Final = 1.0
_AIM_CELL_M: Final = 2.4
_FASTEST_ON_FOOT: Final = 9
_QUALITY_BITS: Final = 10
_LEVEL_BITS: Final = 3
_FLOOR_BITS: Final = 7
_HEIGHT_BITS: Final = 8
_LEVEL_REPEATS: Final = 2
"""Entries in which a new level is told at least; who misses them all has the old one until told in full again."""
_HEIGHT_REACH_M: Final = 50.0
"""Of low bits that mean ±128 m, since a receiver may have stayed with an older height."""


@dataclass(frozen=True)
class Telling:
    """All that could be told at one moment. ``velocity`` (n, 2) m/s and ``resolution`` as they would be told."""

    who: Candidates
    velocity: FloatArray
    resolution: int
    now_ns: int
    history: History
    grid: Grid

    def aimed(self) -> tuple[FloatArray, FloatArray]:
        """(n,) latitude and longitude to tell.

        Who moves at a velocity that is not worth telling is told where the next second takes him, on coarse cells.
        """
        who = self.who
        aim_s = _AIM_S * min(q.cell_m(self.resolution) / _AIM_CELL_M, 1.0)
        age_s = who.now_s - who.time_s
        ahead_s = brief_s(age_s + aim_s) - brief_s(age_s)
        east_m, north_m = ahead_s * (who.velocity - self.velocity).T
        longitude = who.longitude + east_m / (METRES_PER_DEG * cosines(who.latitude))
        latitude = np.clip(who.latitude + north_m / METRES_PER_DEG, -90.0, 90.0)
        return latitude, (longitude + 180.0) % 360.0 - 180.0

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
        """(n, DEPTH, 2) whether quality and level are to be told to who may have missed so many entries."""
        told = self.history.told
        pairs = zip(self.who.slots.tolist(), self.who.reports, strict=True)
        codes = [details_code(report, told.get(slot)) for slot, report in pairs]
        differ = self.history.details_differ(self.who.slots, np.array(codes, dtype=np.int64))
        differ[:, _LEVEL_REPEATS:, 1] = differ[:, _LEVEL_REPEATS - 1, 1, None]
        return differ

    def changes_bits(self) -> FloatArray:
        """(n, DEPTH) what telling the changes takes, by how much may be missed."""
        widths = [
            (
                _QUALITY_BITS,
                _LEVEL_BITS
                + _FLOOR_BITS * (each.floor is not None)
                + _HEIGHT_BITS * (each.height_m is not None),
            )
            for each in self.who.reports
        ]
        bits: FloatArray = (self.changes() * np.array(widths, dtype=np.float64)[:, None, :]).sum(axis=2)
        return bits

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

    def in_full(self, offer: Offer) -> Reports:
        """As many of the chosen as fit beside the first against one anchor."""
        picked = [
            replace(
                _as_of(self.who.reports[index], self.now_ns),
                east_m_s=float(self.velocity[index, 0]),
                north_m_s=float(self.velocity[index, 1]),
            )
            for index in offer.picked.tolist()
        ]
        return Reports(tuple(partition(picked, self.resolution)[0]), tick=q.tick_of(self.now_ns))

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
        )


def _varied(entry: Entry, how: tuple[bool, bool]) -> Entry:
    """The entry with more bits of its place, or without velocity, as the frame's offer has it."""
    far, steady = how
    return replace(entry, far=far, steady=steady, velocity=None if steady else entry.velocity)


def _as_of(report: Report, now_ns: int) -> Report:
    """A fresh report moved on to now; an older one as it is."""
    if abs(now_ns - report.time_ns) > FRESH_NS:
        return report
    velocity = report.east_m_s, report.north_m_s
    latitude, longitude = moved_deg(
        report.latitude_deg, report.longitude_deg, velocity, now_ns - report.time_ns
    )
    return replace(report, time_ns=now_ns, latitude_deg=latitude, longitude_deg=longitude)


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
