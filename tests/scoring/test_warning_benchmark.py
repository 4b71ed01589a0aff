"""`bootprint benchmark warnings`: truth by hand, delays by hand, and one play with real hubs."""

import math

import numpy as np
import pytest

from proving_ground.radio_trials.warning_play import Radio, play_warnings, swings, true_dangers
from proving_ground.radio_trials.warnings import DelayRow, delays, rows_of


def test_truth_is_geometry() -> None:
    # Us at the origin facing north; one 10 m north, one 40 m east, one 10 m north and 3 m above.
    place = np.array([[0.0, 0, 0], [0, 10, 0], [40, 0, 0], [0, 10, 3]])[:, None, :]
    dangers = true_dangers(place, np.zeros((4, 1)))
    assert dangers["near"][0, 0].tolist() == [False, True, False, False]
    assert dangers["in_aim"][0, 0].tolist() == [False, True, False, False]
    east = true_dangers(place, np.full((4, 1), math.pi / 2.0))
    assert east["in_aim"][0, 0].tolist() == [False, False, True, False]


def test_weapons_turn_no_faster_than_a_radian_a_second() -> None:
    found = swings(5, 500, seed=2)
    assert np.abs(np.diff(found)).max() <= 0.2 + 1e-9
    assert np.ptp(found) > 3.0
    np.testing.assert_array_equal(found, swings(5, 500, seed=2))


def spells(steps: int, *spans: tuple[int, int]) -> np.ndarray:
    """One pair's truth or warning, (T, 1, 2)."""
    found = np.zeros((steps, 1, 2), dtype=bool)
    for begin, end in spans:
        found[begin:end, 0, 1] = True
    return found


def test_delays_count_from_the_begin_of_dangers_that_last() -> None:
    true = spells(1000, (100, 200), (400, 450), (500, 510), (600, 640), (900, 1000))
    warned = spells(1000, (100, 200), (410, 450), (590, 640))
    # The first begins before the hubs know of all, the third lasts two seconds, the last is never warned of.
    assert list(delays(true, warned)) == [2.0, 0.0, math.inf]


def test_a_play_with_real_hubs_gives_a_row_for_each_reason() -> None:
    steps = 5 * 75
    still = np.zeros((3, steps, 3))
    still[1, :, 0] = np.linspace(60.0, -60.0, steps)  # walks through between the other two, 1.6 m/s
    still[2, :, 1] = 40.0
    near, aim = rows_of("by hand", play_warnings(still, Radio(1200), seed=1))
    assert isinstance(near, DelayRow)
    assert (near.reason, aim.reason) == ("near", "in_aim")
    assert near.true_pct == pytest.approx(100.0 * 2 * 30.0 / 120.0 / 6, abs=1.0)
    assert near.missed == aim.missed == 0
    assert near.warned_needlessly_pct < 10.0
