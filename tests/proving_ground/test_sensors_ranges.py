"""Ranges: their sizes in the open, through walls and floors, out of reach, and their order."""

from dataclasses import replace

import numpy as np
import pytest

from proving_ground.sensors import RANGE_CLASSES, Mounting, Peer, RangeQuality, Ranging, Walls, measure_ranges
from sensor_gateway.recordings.run import RangeSeries
from support.moving import Straight

SOLDIERS = RANGE_CLASSES["soldiers"]
EXACT = replace(SOLDIERS, sigma_m=0.0, loss_share=0.0, outlier_share=0.0, offset_m=0.0, wall_bias_m=0.0)
AHEAD = Peer("b2", Straight((6.0, 8.0, 0.0)))
WALL = Walls(np.array([[[3.0, -50.0], [3.0, 50.0]]]), np.array([[0.0, 3.0]]))


def ranges(quality: RangeQuality, ranging: Ranging, duration_s: float = 10.0, seed: int = 1) -> RangeSeries:
    rng = np.random.default_rng(seed)
    mounting = Mounting(np.array([0.0, 0.0, 1.0]))
    return measure_ranges(Straight(), duration_s, mounting, quality, ranging, rng)


def test_the_distance_is_between_the_radios() -> None:
    """From (0, 0, 1) to (6, 8, 1): 10 m; to (6, 8, 0): √101 m."""
    level = Peer("b2", AHEAD.motion, Mounting(np.array([0.0, 0.0, 1.0])))
    series = ranges(EXACT, Ranging((level, AHEAD)))
    np.testing.assert_allclose(series.distance_m[:2], [10.0, 101**0.5])


def test_peers_take_turns_in_order_of_time() -> None:
    series = ranges(replace(EXACT, rate_hz=2.0), Ranging((AHEAD, Peer("c3", Straight((1.0, 0.0, 0.0))))), 2.0)
    np.testing.assert_allclose(series.time_s, np.arange(8) * 0.25)
    assert series.peer == ("b2", "c3") * 4


def test_noise_and_the_pair_s_offset_have_their_sizes() -> None:
    offsets = []
    for seed in range(60):
        errors = (
            ranges(replace(EXACT, sigma_m=0.1, offset_m=0.05), Ranging((AHEAD,)), 60.0, seed).distance_m
            - 101**0.5
        )
        assert errors.std() == pytest.approx(0.1, rel=0.4)
        offsets.append(errors.mean())
    assert np.std(offsets) == pytest.approx(np.hypot(0.05, 0.1 / 60**0.5), rel=0.25)


def test_through_a_wall_ranges_are_too_long_and_say_nothing_of_it() -> None:
    through = ranges(replace(EXACT, wall_bias_m=0.3, sigma_m=0.1), Ranging((AHEAD,), walls=WALL), 3000.0)
    errors = through.distance_m - 101**0.5
    assert errors.mean() == pytest.approx(0.3, rel=0.1)
    assert np.median(errors) < errors.mean()  # exponential: mostly small
    np.testing.assert_array_equal(through.sigma_m, 0.1)
    over = Ranging((Peer("d4", Straight((6.0, 8.0, 5.5))),), walls=WALL)  # 3.25 m high where the wall stands
    np.testing.assert_allclose(ranges(replace(EXACT, wall_bias_m=0.3), over).distance_m, (100 + 20.25) ** 0.5)


def test_floors_are_walls_that_lie_down() -> None:
    upstairs = Peer("d4", Straight((0.0, 0.0, 4.0)))
    one, none = (
        ranges(replace(EXACT, wall_bias_m=0.5), Ranging((upstairs,), slabs_m=slabs), 500.0).distance_m
        for slabs in ((3.0,), (9.0,))
    )
    assert one.mean() - 3.0 == pytest.approx(0.5, rel=0.2)
    np.testing.assert_allclose(none, 3.0)


def test_reach_ends_and_walls_shorten_it() -> None:
    far = Peer("e5", Straight((50.0, 0.0, 1.0)))
    assert len(ranges(EXACT, Ranging((far,))).distance_m) == 10
    assert len(ranges(EXACT, Ranging((far,), walls=WALL)).distance_m) == 0  # 50 + 12 m is beyond 60 m
    empty = ranges(EXACT, Ranging(()))
    assert (len(empty.time_s), empty.peer) == (0, ())


def test_some_are_lost_and_some_are_wrong() -> None:
    series = ranges(
        replace(EXACT, loss_share=0.2, outlier_share=0.05, outlier_m=5.0), Ranging((AHEAD,)), 4000.0
    )
    assert len(series.time_s) == pytest.approx(3200, rel=0.03)
    wrong = series.distance_m - 101**0.5 > 0.01
    assert wrong.mean() == pytest.approx(0.05, rel=0.25)
    assert (series.distance_m - 101**0.5)[wrong].mean() == pytest.approx(5.0, rel=0.25)
