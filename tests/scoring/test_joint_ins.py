"""The 18-state filter of the papers: its algebra, and two feet whose errors are opposite."""

import numpy as np
import pytest

from proving_ground.evaluation.alignment import FloatArray, path_lengths
from proving_ground.evaluation.foot.textbook import GRAVITY_M_S2, TextbookFilter, TextbookSettings
from proving_ground.evaluation.fusion.dual_walks import dual_walk
from proving_ground.evaluation.fusion.joint_ins import JointFilter, joint_tracks
from proving_ground.evaluation.scoring import score_track

SETTINGS = TextbookSettings()
REST = np.array([0.0, 0.0, GRAVITY_M_S2])


def moving(filter_: JointFilter | TextbookFilter, samples: int = 50) -> None:
    rng = np.random.default_rng(3)
    for _ in range(samples):
        accel, gyro = REST + rng.normal(0.0, 2.0, 3), rng.normal(0.0, 1.0, 3)
        if isinstance(filter_, TextbookFilter):
            filter_.predict(accel, gyro, 0.005)
        else:
            filter_.predict(1, accel, gyro, 0.005)


def test_one_foot_in_it_is_the_textbooks_filter() -> None:
    joint, alone = JointFilter([np.eye(3), np.eye(3)], SETTINGS), TextbookFilter(np.eye(3), SETTINGS)
    moving(joint)
    moving(alone)
    joint.zero_velocity(1)
    alone.zero_velocity()
    np.testing.assert_allclose(joint.position[1], alone.position, atol=1e-9)
    np.testing.assert_allclose(joint.P[9:, 9:], alone.P, atol=1e-9)
    np.testing.assert_array_equal(joint.position[0], 0.0)


def test_the_same_position_is_shared_out_by_covariance() -> None:
    joint = JointFilter([np.eye(3), np.eye(3)], SETTINGS)
    joint.position = [np.array([1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])]
    joint.P[0:3, 0:3], joint.P[9:12, 9:12] = 1.0 * np.eye(3), 2.0 * np.eye(3)
    joint.same_position()  # 2 m apart, innovation variance 1 + 2 + 1 m²
    assert joint.position[0][0] == pytest.approx(1.0 - 2.0 * 1.0 / 4.0)
    assert joint.position[1][0] == pytest.approx(-1.0 + 2.0 * 2.0 / 4.0)
    assert joint.P[0, 9] == pytest.approx(1.0 * 2.0 / 4.0)  # from now on they err together
    assert np.linalg.eigvalsh(joint.P)[0] > -1e-9


def test_both_tracks_are_of_one_walk() -> None:
    run = dual_walk([(0.0, 0.0), (0.0, 20.0), (10.0, 20.0)], 210).run
    tracks = joint_tracks(run.imus)
    for place, track in tracks.items():
        assert path_lengths(track.position_m[::100])[-1] == pytest.approx(30.0, rel=0.1)
        assert (score_track(track, run.truth[place]).score.rmse_m or np.inf) < 0.7
    apart: FloatArray = tracks["left_foot"].at(np.array([25.0, 35.0])) - tracks["right_foot"].at(
        np.array([25.0, 35.0])
    )
    assert np.linalg.norm(apart, axis=1).max() < 2.0
