"""Probabilities of danger: against an independent distribution, by drawing, in cases that speak for themselves."""

import math

import numpy as np
import pytest
from scipy.stats import ncx2, norm

from sa_hub.awareness.danger import Corridor, Place, in_circle, in_corridor


@pytest.mark.parametrize("sigma_m", [0.1, 1.0, 4.0, 15.0, 80.0])
@pytest.mark.parametrize("distance_m", [0.0, 5.0, 14.0, 15.0, 16.0, 30.0, 100.0])
def test_a_circle_holds_what_the_non_central_chi_square_says(distance_m: float, sigma_m: float) -> None:
    place = Place(0.6 * distance_m, -0.8 * distance_m, sigma_m)
    expected = ncx2.cdf((15.0 / sigma_m) ** 2, 2, (distance_m / sigma_m) ** 2)
    assert in_circle(place, 15.0) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("east_m", "north_m"), [(20.0, 100.0), (0.0, 100.0), (-3.0, 20.0), (5.0, 290.0)])
def test_a_corridor_holds_the_share_of_drawn_places_and_angles(east_m: float, north_m: float) -> None:
    rng = np.random.default_rng(3)
    turn = rng.normal(0.1, 0.05, 200_000)
    east, north = rng.normal(east_m, 4.0, turn.size), rng.normal(north_m, 4.0, turn.size)
    along = east * np.sin(turn) + north * np.cos(turn)
    across = east * np.cos(turn) - north * np.sin(turn)
    inside = np.mean((np.abs(across) < 5.0) & (along > 0.0) & (along < 300.0))
    corridor = Corridor(0.1, 0.05, range_m=300.0, half_width_m=5.0)
    assert in_corridor(Place(east_m, north_m, 4.0), corridor) == pytest.approx(inside, abs=0.01)


def test_azimuths_are_clockwise_from_north_and_nobody_is_in_line_behind_us() -> None:
    east = Corridor(math.pi / 2.0, 0.01, range_m=300.0, half_width_m=5.0)
    assert in_corridor(Place(50.0, 0.0, 0.5), east) > 0.99
    assert in_corridor(Place(-50.0, 0.0, 0.5), east) < 1e-9
    assert in_corridor(Place(0.0, 50.0, 0.5), east) < 1e-9
    assert in_corridor(Place(310.0, 0.0, 0.5), east) < 1e-9


@pytest.mark.parametrize(("same_floor", "probability"), [(True, 1.0), (False, 0.0), (None, 1.0)])
def test_floors_decide_where_both_are_known(same_floor: bool | None, probability: float) -> None:
    corridor = Corridor(0.0, 0.001, range_m=300.0, half_width_m=5.0)
    place = Place(0.0, 10.0, 0.1, up_m=1.5, same_floor=same_floor)
    assert in_circle(place, 15.0) == pytest.approx(probability, abs=1e-6)
    assert in_corridor(place, corridor) == pytest.approx(probability, abs=1e-6)


def test_heights_count_where_floors_are_unknown() -> None:
    above = [in_circle(Place(0.0, 5.0, 0.1, up_m=up), 15.0) for up in (0.0, 2.0, 4.0, 8.0)]
    # 2 m is a man's height; two sigmas (2 m each) beyond it 4.55 % of errors lie, three 0.27 %.
    expected = [1.0, 1.0, 2.0 * norm.sf(1.0), 2.0 * norm.sf(3.0)]
    assert above == pytest.approx(expected, rel=1e-3)


def test_a_weapon_that_points_up_endangers_who_is_there() -> None:
    level = Corridor(0.0, 0.01, 300.0, 5.0, elevation_rad=0.0, elevation_sigma_rad=0.01)
    upward = Corridor(0.0, 0.01, 300.0, 5.0, elevation_rad=math.atan(0.2), elevation_sigma_rad=0.01)
    on_the_hill = Place(0.0, 100.0, 0.5, up_m=20.0)
    assert in_corridor(on_the_hill, level) < 1e-6
    assert in_corridor(on_the_hill, upward) > 0.99
    # Nobody measures the elevation: whoever is not far above or below may be meant.
    unknown = Corridor(0.0, 0.01, 300.0, 5.0)
    assert 0.3 < in_corridor(on_the_hill, unknown) < 0.7
    assert in_corridor(Place(0.0, 20.0, 0.5, up_m=20.0), unknown) < 1e-3
