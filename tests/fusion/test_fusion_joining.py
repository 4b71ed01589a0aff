"""How a foot joins another: once both tracks show how its frame lies, in a corridor as in a small room."""

import math

import numpy as np
import pytest

from fusion.config import FusionConfig
from fusion.joining import Joining, relative_noise
from fusion.transform import RigidTransform

CONFIG = FusionConfig()


def pairs(points: list[complex], yaw: float, noise_m: float = 0.0) -> Joining:
    """A foot whose own track is the other's turned back by ``yaw`` about (5, 2), with noise."""
    rng = np.random.default_rng(4)
    joining = Joining(together=True)
    for point in points:
        own = (point - (5 + 2j)) * complex(math.cos(yaw), -math.sin(yaw))
        own += complex(*rng.normal(size=2)) * noise_m
        joining.add((own.real, own.imag, 0.0), (point.real, point.imag, 0.5))
    return joining


def test_a_straight_walk_shows_it_after_a_few_steps() -> None:
    for count in range(1, 4):
        assert pairs([1.4j * k for k in range(count)], 2.0).fit(CONFIG) is None
    move = pairs([1.4j * k for k in range(5)], 2.0).fit(CONFIG)
    assert move is not None
    assert move.yaw_rad == pytest.approx(2.0)
    np.testing.assert_allclose(move.point((0.0, 0.0, 0.0)), [5.0, 2.0, 0.5], atol=1e-9)


def test_going_round_a_small_room_shows_it_as_well() -> None:
    room = [complex(1.2 * math.cos(0.7 * k), 1.2 * math.sin(0.7 * k)) for k in range(14)]
    move = pairs(room, -1.0, noise_m=0.1).fit(CONFIG)
    assert move is not None
    assert move.yaw_rad == pytest.approx(-1.0, abs=0.1)


def test_tracks_that_are_not_of_one_walk_do_not_join() -> None:
    joining = Joining(together=True)
    for k in range(12):
        joining.add((1.4 * k, 0.0, 0.0), (0.7 * k, 0.0, 0.0))  # one foot goes twice as far
    assert joining.fit(CONFIG) is None


def test_relocation_moves_the_other_foots_track() -> None:
    joining = pairs([1.4j * k for k in range(6)], 2.0)
    joining.relocate(RigidTransform((0.0, 0.0, 0.0), (10.0, 20.0, 0.0), math.pi / 2, np.zeros((4, 4))))
    move = joining.fit(CONFIG)
    assert move is not None
    assert move.yaw_rad == pytest.approx(2.0 + math.pi / 2 - 2 * math.pi)
    np.testing.assert_allclose(move.point((0.0, 0.0, 0.0)), [8.0, 25.0, 0.5], atol=1e-9)


def test_noise_against_the_other_foot_has_the_yaws_lever() -> None:
    move = RigidTransform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, np.diag([0.09, 0.09, 0.09, 0.01]))
    noise = relative_noise(move, np.array([3.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(np.diag(noise), [0.09, 0.18, 0.09, 0.01])
    assert noise[1, 3] == pytest.approx(0.03)
