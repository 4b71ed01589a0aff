"""Placing: tracks laid over one another, directions out of the first metres, and how sure they are."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fusion.alignment import Walk, fit_rigid
from fusion.config import AlignConfig, GnssConfig
from fusion.placement import Place, Placement
from fusion.state import Array

S = 1_000_000_000
ALIGN, GNSS = AlignConfig(), GnssConfig()


def turned(points: Array, yaw: float) -> Array:
    """Points (k, 2) turned counter-clockwise, as complex numbers do it."""
    rotated = (points[:, 0] + 1j * points[:, 1]) * np.exp(1j * yaw)
    return np.stack([rotated.real, rotated.imag], axis=1)


@given(
    yaw=st.floats(-3.1, 3.1), east=st.floats(-500, 500), north=st.floats(-500, 500), seed=st.integers(0, 99)
)
@settings(max_examples=50)
def test_fit_finds_any_turn_and_shift(yaw: float, east: float, north: float, seed: int) -> None:
    track = np.random.default_rng(seed).normal(size=(6, 2)) * 10
    fit = fit_rigid(track, turned(track, yaw) + np.array([east, north]), np.eye(6))
    assert math.remainder(fit.yaw_rad - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-8)


def test_fit_knows_how_sure_it_is_under_correlated_errors() -> None:
    """Errors of a first-order Gauss-Markov process: the yaw's error over many draws has the stated variance."""
    rng = np.random.default_rng(3)
    time = np.arange(40.0)
    track = np.stack([1.4 * time, np.zeros(40)], axis=1)
    covariance = 9.0 * np.exp(-np.abs(np.subtract.outer(time, time)) / 20.0) + 0.25 * np.eye(40)
    root = np.linalg.cholesky(covariance)
    fits = [
        fit_rigid(track, turned(track, 0.7) + root @ rng.normal(size=(40, 2)), covariance) for _ in range(400)
    ]
    errors = np.array([fit.yaw_rad - 0.7 for fit in fits])
    assert errors.std() == pytest.approx(math.sqrt(fits[0].covariance[2, 2]), rel=0.12)
    assert np.mean([fit.chi_square for fit in fits]) == pytest.approx(2 * 40 - 3, rel=0.05)


def test_walk_is_surer_the_longer_and_the_straighter_it_was() -> None:
    walk = Walk.begin((1.0, 1.0, 0.0))
    walk.go((1.0, 2.5, 0.0))
    short = walk.sigma_rad(ALIGN)
    walk.go((1.0, 4.0, 0.0))
    assert walk.direction_rad == pytest.approx(math.pi / 2)
    assert short == pytest.approx(0.1)  # 0.15 m over 1.5 m
    assert walk.sigma_rad(ALIGN) == pytest.approx(0.05)
    walk.go((3.0, 4.0, 0.0))  # round a corner: the direction is anybody's guess by some 40 degrees
    assert walk.sigma_rad(ALIGN) > 0.6


def known(
    local: tuple[float, float], enu: tuple[float, float], at_s: float = 0.0, sigma: float = 1.0
) -> Place:
    return Place(round(at_s * S), (*enu, 5.0), sigma, 2.0, (*local, 0.0))


def satellite(
    local: tuple[float, float], enu: tuple[float, float], at_s: float = 0.0, sigma: float = 3.0
) -> Place:
    return Place(round(at_s * S), (*enu, 5.0), sigma, None, (*local, 0.0), "gnss")


def test_nothing_known_is_unplaced_and_one_place_is_a_circle() -> None:
    placement = Placement(ALIGN, GNSS)
    assert placement.nearest((0.0, 0.0, 0.0)) is None
    placement.observe(known((0.0, 0.0), (100.0, 50.0)))
    nearest = placement.nearest((6.0, 8.0, 0.0))
    assert nearest is not None
    assert nearest[0].enu == (100.0, 50.0, 5.0)
    assert nearest[1] == pytest.approx(1.0 + 50.0)  # 10 m anywhere on a circle: 100/2 m² per axis
    assert placement.final is None


def test_hint_is_provisional_after_half_a_metre_and_final_after_three() -> None:
    placement = Placement(ALIGN, GNSS)
    start = known((0.0, 0.0), (100.0, 50.0))
    placement.observe(start)
    placement.point_to(start, math.pi / 2, math.radians(5))
    assert placement.provisional is None
    assert placement.hint is not None
    placement.hint.go((0.0, -1.5, 0.0), ALIGN)
    assert placement.final is None
    first = placement.provisional
    assert first is not None
    np.testing.assert_allclose(first.point((0.0, -1.5, 0.0)), [100.0, 51.5, 5.0], atol=1e-12)
    placement.hint.go((0.0, -3.0, 0.0), ALIGN)
    final = placement.final
    assert final is not None
    assert final.yaw_rad == pytest.approx(math.pi)
    assert math.sqrt(final.covariance[3, 3]) == pytest.approx(math.hypot(math.radians(5), 0.05))


def test_a_walk_that_bends_is_judged_by_its_beginning() -> None:
    """In a small room nobody gets three metres away: the first straight metres count, and no later turn."""
    placement = Placement(ALIGN, GNSS)
    start = known((0.0, 0.0), (100.0, 50.0))
    placement.point_to(start, 0.0, math.radians(5))
    assert placement.hint is not None
    for point in [(0.0, 1.0, 0.0), (0.0, 2.0, 0.0), (-1.0, 2.0, 0.0), (-1.0, 1.0, 0.0), (-1.0, 0.5, 0.0)]:
        assert placement.final is None
        placement.hint.go(point, ALIGN)
    assert placement.final is not None  # 4.5 m of path
    assert placement.final.yaw_rad == pytest.approx(-math.pi / 2)
    assert math.sqrt(placement.final.covariance[3, 3]) == pytest.approx(math.hypot(math.radians(5), 0.075))


@pytest.mark.parametrize(
    ("begins", "way", "sighted"),
    [
        ((0.0, 0.0), [(0.0, 1.0, 0.0), (0.0, 3.0, 0.0)], (0.0, 3.0, 0.0)),
        ((0.0, 0.0), [(0.0, 2.0, 0.0), (-1.0, 2.0, 0.0), (-1.0, 0.4, 0.0)], None),  # an early chord counted
        ((9.0, 0.0), [(9.0, 1.0, 0.0), (9.0, 3.0, 0.0)], None),  # what had erred before nobody knows
    ],
)
def test_who_is_sighted(
    begins: tuple[float, float], way: list[tuple[float, float, float]], sighted: tuple[float, ...] | None
) -> None:
    placement = Placement(ALIGN, GNSS)
    placement.point_to(known(begins, (100.0, 50.0)), 0.0, math.radians(5))
    assert placement.hint is not None
    for point in way:
        placement.hint.go(point, ALIGN)
    assert placement.final is not None
    assert placement.final.sighted == sighted


def test_two_known_points_give_the_heading() -> None:
    placement = Placement(ALIGN, GNSS)
    placement.observe(known((0.0, 0.0), (100.0, 50.0), 0.0))
    assert placement.final is None
    placement.observe(known((30.0, 0.0), (100.0, 80.0), 30.0))
    assert placement.final is not None
    assert placement.final.yaw_rad == pytest.approx(math.pi / 2)
    np.testing.assert_allclose(placement.final.point((10.0, 0.0, 0.0)), [100.0, 60.0, 5.0], atol=1e-9)


def test_satellites_give_a_heading_only_once_the_walk_is_long_against_their_errors() -> None:
    placement = Placement(ALIGN, GNSS)
    found_after = None
    for second in range(60):
        placement.observe(satellite((1.4 * second, 0.0), (0.0, 1.4 * second), second))
        if placement.final is not None:
            found_after = 1.4 * second
            break
    assert found_after is not None
    assert 15.0 < found_after < 60.0
    assert placement.final is not None
    assert placement.final.yaw_rad == pytest.approx(math.pi / 2)
    assert math.sqrt(placement.final.covariance[3, 3]) < math.radians(8)
    assert math.sqrt(placement.final.covariance[2, 2]) == 100.0  # no height is known


def test_a_fix_that_cannot_be_true_is_dropped_from_the_fit() -> None:
    placement = Placement(ALIGN, GNSS)
    for second in range(60):
        wrong = 80.0 if second == 7 else 0.0
        placement.observe(satellite((1.4 * second, 0.0), (wrong, 1.4 * second), second))
        if placement.final is not None:
            break
    assert placement.refused == 1
    assert placement.final is not None
    assert placement.final.yaw_rad == pytest.approx(math.pi / 2, abs=1e-6)


def test_standing_still_gathers_no_places() -> None:
    placement = Placement(ALIGN, GNSS)
    for second in range(20):
        placement.observe(satellite((0.01 * second, 0.0), (0.0, 0.0), second))
    assert len(placement.places) == 1
