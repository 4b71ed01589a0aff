"""Receivers that are dragged away are found out and undone; honest ones are not accused (METHODS D9)."""

import math

import numpy as np
import pytest

from bootprint.clock import NS_PER_S
from fusion.trust import Receiver
from proving_ground.evaluation.spoofing import Trial, play


@pytest.mark.parametrize("seed", [3, 11])
def test_a_slow_drag_is_noticed_and_undone(seed: int) -> None:
    outcome = play(Trial(seed, duration_s=300.0, drag_m_s=0.5, from_s=180.0))
    assert outcome.false_alarms == 0
    assert outcome.detected_after_s < 35.0
    assert outcome.worst_after_m < 15.0  # the spoofer pulls by 60 m in this time
    assert outcome.error_m[-1] < 10.0


def test_an_honest_receiver_is_believed_to_the_end() -> None:
    outcome = play(Trial(5, duration_s=300.0, drag_m_s=0.0, from_s=math.inf))
    assert outcome.alarms_s == ()
    assert outcome.inside.mean() > 0.9


def test_scatter_is_about_a_line_so_that_a_drag_is_none() -> None:
    """Fixes on a line have no scatter however steep it is; ±1 m beside it alternately has one metre."""
    steady, shaky = Receiver(), Receiver()
    for second in range(20):
        miss = np.array([0.5 * second, -0.2 * second])
        beside = np.array([1.0, 1.0]) * (1.0 if second % 2 else -1.0)
        still = steady.scatter_m(miss, second * NS_PER_S, 30.0)
        shaken = shaky.scatter_m(miss + beside, second * NS_PER_S, 30.0)
    assert still == pytest.approx(0.0, abs=1e-9)
    assert shaken == pytest.approx(1.0, abs=0.1)


def test_one_outlier_is_no_stray_and_a_lasting_one_is() -> None:
    receiver = Receiver()
    found = [receiver.strays(second == 2, second * NS_PER_S, 4.0) for second in range(6)]
    assert not any(found)
    assert any(receiver.strays(True, second * NS_PER_S, 4.0) for second in range(6, 12))


def test_agreement_has_to_last_and_a_break_begins_anew() -> None:
    receiver = Receiver()
    agreeing = [True] * 8 + [False] + [True] * 12
    found = [receiver.agrees(one, second * NS_PER_S, 10.0) for second, one in enumerate(agreeing, start=1)]
    assert found.index(True) == 8 + 1 + 10
