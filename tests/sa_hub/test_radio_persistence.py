"""What lasts of a velocity, and whether it is told: walks whose turns are known, by hand-derived shares."""

import math

import numpy as np
import pytest

from sa_hub.radio.ground import METRES_PER_DEG
from sa_hub.radio.persistence import LONGEST_S, Persistence, Standard, reached_s

SPEED_M_S = 1.3
SLOT = np.array([0])
DEAR = Standard(near_m=5.0, ahead_s=8.0, bits=26.0, velocity_bits=6.0)
CHEAP = Standard(near_m=0.8, ahead_s=1.0, bits=26.0, velocity_bits=6.0)


def walked(leg_s: float, turn_deg: float, standard: Standard, duration_s: int = 200) -> Persistence:
    """One who walks on the equator and turns after every leg, seen five times a second."""
    persistence = Persistence()
    persistence.widen(1)
    place = np.zeros(2)
    for step in range(5 * duration_s):
        azimuth = math.radians(turn_deg * math.floor(step / 5.0 / leg_s))
        velocity = SPEED_M_S * np.array([math.sin(azimuth), math.cos(azimuth)])
        sample = [step / 5.0, place[1] / METRES_PER_DEG, place[0] / METRES_PER_DEG, *velocity]
        persistence.see(SLOT, np.array([sample]), standard)
        place = place + 0.2 * velocity
    return persistence


def test_what_nothing_is_known_of_lasts() -> None:
    persistence = Persistence()
    persistence.widen(1)
    assert persistence.lasting(SLOT).tolist() == [[1.0] * LONGEST_S]
    assert persistence.shares(SLOT, DEAR).tolist() == [1.0]


def test_who_walks_straight_is_told_with_a_velocity() -> None:
    persistence = walked(1e9, 0.0, DEAR)
    assert persistence.lasting(SLOT) == pytest.approx(np.ones((1, LONGEST_S)))
    assert persistence.shares(SLOT, DEAR) == pytest.approx([1.0])


def test_of_legs_that_end_less_lasts_the_longer() -> None:
    # With t s of a leg left, the way along it in h s is min(h, t), and none after a right angle: on the average
    # h - h²/(2·10). Prediction is damped, so it reaches 60·(1 - e^(-h/60)) s.
    lasting = walked(10.0, 90.0, DEAR).lasting(SLOT)[0]
    for lag_s in (1, 4, 8):
        reached = 60.0 * (1.0 - math.exp(-lag_s / 60.0))
        assert lasting[lag_s - 1] == pytest.approx((lag_s - lag_s**2 / 20.0) / reached, abs=0.1)


def test_a_velocity_is_told_where_it_saves_reports() -> None:
    # To and fro within 4 s: from 8 s to 8 s nothing of it is true, and from second to second most is.
    assert walked(4.0, 180.0, DEAR).shares(SLOT, DEAR).tolist() == [0.0]
    assert walked(4.0, 180.0, CHEAP).shares(SLOT, CHEAP)[0] > 0.7


def test_who_is_not_seen_for_long_begins_anew_and_what_was_learnt_stays() -> None:
    persistence = walked(4.0, 180.0, DEAR)
    learnt = persistence.lasting(SLOT)
    far = np.array([[1000.0, 1.0, 1.0, SPEED_M_S, 0.0]])
    for leap_s in (0.0, 995.0):  # far ahead, and of a clock set back
        persistence.see(SLOT, far - [[leap_s, 0.0, 0.0, 0.0, 0.0]], DEAR)
        assert persistence._kept[SLOT].tolist() == [1]
    np.testing.assert_array_equal(persistence.lasting(SLOT), learnt)


def test_how_far_a_velocity_reaches_lies_between_whole_seconds() -> None:
    lasting = np.linspace(1.0, 0.25, LONGEST_S)[None]
    damped = 60.0 * (1.0 - math.exp(-2.5 / 60.0))
    assert reached_s(lasting, np.array([2.5])) == pytest.approx([(1.0 - 0.05 * 1.5) * damped])
    # Before the report's stamp as at its moment, and what lasts longest goes on.
    assert reached_s(lasting, np.array([-2.0])) == pytest.approx([-2.0])
    assert reached_s(lasting, np.array([60.0])) == pytest.approx([0.25 * 60.0 * (1.0 - math.exp(-1.0))])
