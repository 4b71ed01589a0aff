"""Stairs that pressure tells of: believed at first, doubted after gusts, believed again once they are a flight."""

import pytest

from pdr_engine.body.altitude.stairways import Stairways


def climb(stairways: Stairways, steps: int, rise_m: float) -> list[float]:
    """On the level at height zero, then so many steps on stairs; what each is believed."""
    stairways.step(False, 0.0)
    return [stairways.step(True, rise_m * (k + 1)) for k in range(steps)]


def test_gusts_make_stairs_doubtful_and_flights_mend_that() -> None:
    """Prior 4 : 1; each gust keeps nine tenths and adds one: after five it is 2.36 : 4.69."""
    stairways = Stairways()
    assert climb(stairways, 3, 0.17) == [0.8, 0.8, 0.8]
    for _ in range(4):
        climb(stairways, 5, 0.2)
    assert climb(stairways, 1, 0.17) == [pytest.approx(0.335, abs=0.001)]
    believed = [climb(stairways, 12, 0.17)[0] for _ in range(6)]
    assert believed[-1] > 0.5


def test_a_flight_is_believed_whatever_was_before() -> None:
    stairways = Stairways()
    for _ in range(20):
        climb(stairways, 5, -0.2)
    found = climb(stairways, 12, -0.17)  # 1.5 m are passed with the ninth
    assert max(found[:8]) < 0.2
    assert found[9:] == [1.0, 1.0, 1.0]


def test_without_a_height_there_is_nothing_to_tell_by() -> None:
    stairways = Stairways()
    stairways.step(True, None)
    assert stairways.step(True, None) == 0.8
