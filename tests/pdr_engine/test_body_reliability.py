"""Reliability: the source's tables, and sources that contradict each other."""

import math

import pytest

from pdr_engine.body.track.cross_check import CrossCheck
from pdr_engine.body.track.reliability import (
    ExternalReliability,
    agreed,
    altimetry_redundancy_pct,
    azimuth_redundancy_pct,
    planimetry_redundancy_pct,
    unnoticed_rad,
)


@pytest.mark.parametrize(
    ("disturbed", "since_s", "gnss", "expected"),
    [
        (True, 1e6, False, 0.0),
        (True, 5.0, False, 25.0),
        (False, 1e6, False, 50.0),
        (False, 5.0, False, 75.0),
        (False, 5.0, True, 100.0),
        (True, 1e6, True, 25.0),
        (False, 75.0, False, 62.5),  # half-way from recent (30 s) to long ago (120 s)
    ],
)
def test_azimuth_by_table_2(disturbed: bool, since_s: float, gnss: bool, expected: float) -> None:
    assert azimuth_redundancy_pct(disturbed, since_s, gnss) == pytest.approx(expected)


def test_position_by_table_3() -> None:
    """Dead reckoning with a calibrated step model and valid compass: 50 %; barometer at a known point: 50 %."""
    assert planimetry_redundancy_pct(False, 0.0, 50.0) == pytest.approx(50.0)
    assert planimetry_redundancy_pct(False, 0.0, 0.0) == 0.0
    assert planimetry_redundancy_pct(False, None, 75.0) == 0.0
    assert planimetry_redundancy_pct(True, 2500.0, 75.0) == pytest.approx(75.0)
    assert altimetry_redundancy_pct(False, 0.0) == pytest.approx(50.0)
    assert altimetry_redundancy_pct(False, 900.0) == pytest.approx(25.0)
    assert altimetry_redundancy_pct(False, 1e6) == 0.0
    assert altimetry_redundancy_pct(True, None) == pytest.approx(50.0)


def test_external_reliability_grows_with_the_way_until_a_fix() -> None:
    """1 km at full redundancy, 2° unnoticed: 1000·2·sin 1° = 34.9 m; without any, 10°: 174.3 m."""
    assert math.degrees(unnoticed_rad(100.0)) == pytest.approx(2.0)
    checked, unchecked = ExternalReliability(), ExternalReliability()
    for _ in range(1000):
        checked.step(1.0, 100.0)
        unchecked.step(1.0, 0.0)
    assert checked.planimetry_m == pytest.approx(34.905, abs=0.01)
    assert unchecked.planimetry_m == pytest.approx(174.31, abs=0.01)
    checked.fix(4.0)
    assert checked.planimetry_m == 4.0


def test_three_azimuths_outvote_the_one_that_errs() -> None:
    sources = {
        "compass": (math.radians(60.0), 0.05),
        "gyro": (math.radians(2.0), 0.05),
        "gnss": (-0.035, 0.1),
    }
    found = agreed(sources, circle=True)
    assert found is not None
    assert found.rejected == ("compass",)
    # Weights 400 and 100: (4·2° − 2.005°)/5
    assert math.degrees(found.value) == pytest.approx(1.2, abs=0.01)
    assert found.sigma == pytest.approx(1.0 / math.sqrt(500.0))


def test_azimuths_agree_across_north() -> None:
    found = agreed({"compass": (3.10, 0.1), "gyro": (-3.10, 0.1)}, circle=True)
    assert found is not None
    assert abs(math.remainder(found.value - math.pi, math.tau)) < 1e-9


def test_two_that_contradict_both_stay_and_make_unsure() -> None:
    found = agreed({"barometer": (10.0, 1.0), "gnss": (20.0, 1.0)})
    assert found is not None
    assert found.rejected == ()
    assert found.value == pytest.approx(15.0)
    assert found.sigma == pytest.approx(10.0 / math.sqrt(2.0) / math.sqrt(2.0))
    assert agreed({}) is None
    single = agreed({"gnss": (20.0, 3.0)})
    assert single is not None
    assert (single.value, single.sigma) == (20.0, 3.0)


def test_a_compass_that_gyro_and_satellites_contradict_is_rejected_and_counted() -> None:
    check = CrossCheck()
    assert check.step((0.3, 0.1), (0.32, 0.1), (0.28, 0.1)) == ()
    # A quarter turn: the satellites' stretch lies before it, and the gyro carries it on.
    assert check.step((0.3 + 1.57, 0.1), (0.32 + 1.57, 0.1), (0.28, 0.1)) == ()
    assert check.step((1.0, 0.1), (0.32 + 1.57, 0.1), (0.28, 0.1)) == ("compass",)
    assert check.rejected == {"compass": 1, "gyro": 0, "gnss": 0}
    assert check.step((1.0, 0.1), (0.32 + 1.57, 0.1), None) == ()  # of two nobody knows who errs
