"""Compass deviations of a place, learned on one walk and taken off on the next (METHODS B5)."""

import math

import pytest

from pdr_engine.body.azimuth.compass import Reading
from pdr_engine.body.azimuth.heading import Heading
from pdr_engine.body.azimuth.repeated import Repeated

BENT_RAD = 0.3
WAY = Heading(math.pi / 2.0, 0.05)
CLEAN = Reading(WAY.azimuth_rad, 0.1, lasting_variance=1.0)
BENT = Reading(WAY.azimuth_rad + BENT_RAD, 0.1, lasting_variance=1.0)


def go_east(repeated: Repeated, steps: int = 60) -> list[Reading]:
    """0.7 m a step to the east past iron between 20 and 30 m; the readings as they are corrected."""
    seen = []
    for step in range(steps):
        reading = BENT if 20.0 <= 0.7 * step < 30.0 else CLEAN
        seen.append(repeated.corrected(reading))
        repeated.learn(reading, WAY)
        repeated.walk(0.7, WAY.azimuth_rad)
    return seen


def test_the_next_walk_is_spared_what_the_first_has_seen() -> None:
    first = Repeated()
    first.fix(0.0, 0.0, 2.0)
    assert go_east(first)[35] == BENT  # what is learned on a walk serves the next
    again = Repeated(first.cells())
    again.fix(0.0, 0.0, 2.0)
    corrected = go_east(again)[35]
    assert corrected.azimuth_rad == pytest.approx(WAY.azimuth_rad, abs=0.15)
    assert corrected.lasting_variance < BENT.lasting_variance


def test_without_a_good_fix_nobody_knows_the_place() -> None:
    lost = Repeated()
    lost.fix(0.0, 0.0, 50.0)
    go_east(lost)
    assert lost.cells() == []


def test_a_place_fades_with_the_way_since_the_fix() -> None:
    walker = Repeated()
    walker.fix(0.0, 0.0, 2.0)
    go_east(walker, 1100)
    assert (
        pytest.approx(len(walker.cells()), abs=2) == 14.0 / 0.02 / 4.0
    )  # 14 m of doubt, 2 % of the way, cells of 4 m
