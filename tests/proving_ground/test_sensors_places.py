"""Plan geometry and random processes: against what can be counted by hand."""

import numpy as np
import pytest

from proving_ground.sensors import Area, Walls
from proving_ground.sensors.places import distance_to
from proving_ground.sensors.randomness import RandomField, gauss_markov

L_SHAPE = Area(np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]], dtype=float), (0.0, 3.0))


def test_an_area_holds_what_is_inside_its_sides_and_heights() -> None:
    places = np.array([[0.5, 2.5, 1.0], [3.5, 0.5, 1.0], [3.5, 2.5, 1.0], [0.5, 0.5, 3.5], [-0.1, 0.5, 1.0]])
    np.testing.assert_array_equal(L_SHAPE.holds(places), [True, True, False, False, False])
    backwards = Area(L_SHAPE.corners_m[::-1], L_SHAPE.heights_m)
    np.testing.assert_array_equal(backwards.holds(places), L_SHAPE.holds(places))


def test_depth_is_measured_from_the_nearest_side() -> None:
    places = np.array([[0.25, 2.0, 1.0], [2.0, 0.6, 1.0], [2.0, 2.0, 1.0]])
    np.testing.assert_allclose(L_SHAPE.depth_m(places), [0.25, 0.4, 0.0])


def test_a_disc_is_round_enough() -> None:
    disc = Area.disc((10.0, 0.0), 5.0)
    turn = np.linspace(0.0, 6.0, 50)
    ring = np.column_stack([10.0 + np.cos(turn), np.sin(turn), 0.0 * turn])
    assert disc.holds(ring).all()
    np.testing.assert_allclose(disc.depth_m(np.array([[10.0, 0.0, 0.0]])), 5.0, atol=0.05)


def test_distance_ends_at_the_ends_of_a_wall() -> None:
    segment = np.array([[[0.0, 0.0], [4.0, 0.0]]])
    places = np.array([[2.0, 3.0], [7.0, 4.0], [-3.0, 0.0]])
    np.testing.assert_allclose(distance_to(segment, places), [3.0, 5.0, 3.0])
    assert np.isinf(distance_to(np.zeros((0, 2, 2)), places)).all()


def test_walls_between_are_counted_with_their_heights() -> None:
    walls = Walls(
        np.array([[[1.0, -5.0], [1.0, 5.0]], [[2.0, -5.0], [2.0, 5.0]], [[0.0, 6.0], [9.0, 6.0]]]),
        np.array([[0.0, 3.0], [0.0, 1.0], [0.0, 3.0]]),
    )
    start = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 2.0], [0.0, 0.0, 2.0], [0.0, 0.0, 2.0]])
    end = np.array([[5.0, 0.0, 0.5], [5.0, 0.0, 2.0], [0.5, 0.0, 2.0], [0.0, 5.0, 2.0]])
    np.testing.assert_array_equal(walls.between(start, end), [2, 1, 0, 0])
    np.testing.assert_array_equal(walls.between(end, start), [2, 1, 0, 0])
    assert Walls().between(start, end).sum() == 0


def test_near_walls_are_those_in_reach_and_hardly_others() -> None:
    walls = Walls(
        np.array([[[10.0 * k, -1.0], [10.0 * k, 1.0]] for k in range(10)]), np.tile([0.0, 3.0], (10, 1))
    )
    np.testing.assert_array_equal(walls.near(np.array([[0.0, 0.0, 1.0]]), 25.0), [0, 1, 2])
    np.testing.assert_array_equal(
        walls.near(np.array([[0.0, 0.0, 1.0], [20.0, 0.0, 1.0]]), 25.0), [0, 1, 2, 3, 4]
    )
    assert len(Walls().near(np.zeros((1, 3)), 25.0)) == 0


def test_gauss_markov_keeps_its_size_and_forgets_at_its_rate() -> None:
    columns = gauss_markov(4000, 0.5, 2.0, 10.0, np.random.default_rng(1), columns=20)
    assert columns[0].std() == pytest.approx(2.0, rel=0.4)
    assert columns.std() == pytest.approx(2.0, rel=0.1)
    later = np.mean(columns[20:] * columns[:-20]) / 4.0
    assert later == pytest.approx(np.exp(-1.0), abs=0.1)


def test_a_random_field_is_fixed_to_its_places() -> None:
    field = RandomField.drawn([2.0, 2.0], 3, seed=5)
    points = np.random.default_rng(1).uniform(-500.0, 500.0, (4000, 2))
    values = field.at(points)
    np.testing.assert_allclose(values[17:18], field.at(points[17:18]), atol=1e-12)
    np.testing.assert_allclose(values.std(axis=0), 1.0, rtol=0.1)
    assert np.abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.25
    alike = np.mean(values * field.at(points + np.array([2.0, 0.0])), axis=0)
    np.testing.assert_allclose(alike, np.exp(-0.5), atol=0.15)
