"""The prediction that senders and receivers share."""

import math

import pytest

from bootprint.prediction import DAMPING_S, moved_m


def test_a_fresh_report_moves_on_with_its_velocity() -> None:
    east, north = moved_m(1.0, -2.0, 0.1)
    assert east == pytest.approx(0.1, rel=1e-2)
    assert north == pytest.approx(-0.2, rel=1e-2)


def test_after_one_time_constant_63_percent_of_the_way_is_gone() -> None:
    assert moved_m(1.5, 0.0, DAMPING_S)[0] == pytest.approx(1.5 * DAMPING_S * (1.0 - 1.0 / math.e))


def test_it_comes_to_rest_and_never_runs_back() -> None:
    reached = [moved_m(1.0, 0.0, elapsed)[0] for elapsed in (0.0, 10.0, 100.0, 1e4, 1e9)]
    assert reached == sorted(reached)
    assert reached[-1] == pytest.approx(DAMPING_S)


def test_before_the_report_it_is_linear() -> None:
    assert moved_m(1.0, 2.0, -3.0) == (-3.0, -6.0)
