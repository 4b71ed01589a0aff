"""Scores against values worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proving_ground.evaluation.alignment import Track, fit_rigid, stances, true_strides
from proving_ground.evaluation.scoring import heading_drift, score_track
from sensor_gateway.recordings.run import Truth

RATE_HZ = 100.0


def loop(duration_s: float = 60.0, radius_m: float = 8.0) -> np.ndarray:
    """A walk of uneven bends, (n, 3) at 100 Hz."""
    t = np.arange(0.0, duration_s, 1.0 / RATE_HZ)
    x = radius_m * np.sin(2 * np.pi * t / duration_s)
    y = 0.7 * radius_m * np.sin(4 * np.pi * t / duration_s + 0.5)
    return np.column_stack([x, y, 0.1 * np.sin(t)])


def times(position_m: np.ndarray) -> np.ndarray:
    return np.arange(len(position_m)) / RATE_HZ


def moved(position_m: np.ndarray, yaw_rad: float, offset: tuple[float, float]) -> np.ndarray:
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    plane = position_m[:, :2] @ np.array([[c, s], [-s, c]]) + offset
    return np.column_stack([plane, position_m[:, 2]])


@pytest.mark.parametrize("align", ["best-fit", "start"])
def test_a_turned_and_shifted_copy_has_no_error(align) -> None:  # type: ignore[no-untyped-def]
    position = loop()
    truth = Truth(times(position), moved(position, 2.2, (40.0, -7.0)))
    score = score_track(Track(times(position), position), truth, align).score
    assert score.distance_m == pytest.approx(
        np.linalg.norm(np.diff(position[:, :2], axis=0), axis=1).sum(), rel=1e-3
    )
    for error in (score.rmse_m, score.p95_m, score.final_m, score.final_pct, score.height_final_m):
        assert error == pytest.approx(0.0, abs=1e-9)
    assert score.distance_error_pct == pytest.approx(0.0, abs=1e-9)
    assert score.heading_drift_deg_per_min == pytest.approx(0.0, abs=1e-9)
    assert (score.nees, score.inside_95_pct) == (None, None)


def test_mirrored_truth_is_no_match() -> None:
    position = loop()
    score = score_track(
        Track(times(position), position), Truth(times(position), position * [1.0, -1.0, 1.0])
    ).score
    assert score.rmse_m is not None
    assert score.rmse_m > 2.0


@given(
    yaw=st.floats(-3.1, 3.1),
    east=st.floats(-100.0, 100.0),
    weights=st.lists(st.floats(0.1, 5.0), min_size=6, max_size=6),
)
def test_the_fit_undoes_any_rigid_motion(yaw: float, east: float, weights: list[float]) -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 2.0], [-1.0, 4.0], [5.0, -2.0], [2.0, 2.0]])
    target = moved(np.column_stack([points, np.zeros(6)]), yaw, (east, 3.0))[:, :2]
    fit = fit_rigid(points, target, np.array(weights))
    assert math.remainder(fit.yaw_rad - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(fit.apply(points), target, atol=1e-9)


def test_the_fit_minimises_the_weighted_error() -> None:
    rng = np.random.default_rng(5)
    source, target, weights = rng.normal(size=(20, 2)), rng.normal(size=(20, 2)), rng.uniform(0.1, 2.0, 20)

    def cost(yaw: float, offset: np.ndarray) -> float:
        c, s = math.cos(yaw), math.sin(yaw)
        return float(weights @ ((source @ np.array([[c, s], [-s, c]]) + offset - target) ** 2).sum(axis=1))

    fit = fit_rigid(source, target, weights)
    best = cost(fit.yaw_rad, fit.offset_m)
    for yaw, east, north in rng.normal(scale=0.05, size=(50, 3)):
        assert cost(fit.yaw_rad + yaw, fit.offset_m + np.array([east, north])) >= best
    for yaw in np.linspace(0, 2 * np.pi, 50):  # nor is another direction better
        turned = source @ np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        assert cost(yaw, np.average(target - turned, axis=0, weights=weights)) >= best - 1e-9


def test_figures_of_a_straight_walk_by_hand() -> None:
    """Truth: 0, 10, 20, 30, 40 m along x. The estimate is 10 % too long. Fitted, its errors are −2 −1 0 1 2 m."""
    t = np.arange(0.0, 50.0, 10.0)
    truth = Truth(t, np.column_stack([t, np.zeros(5), np.zeros(5)]))
    track = Track(t, np.column_stack([np.zeros(5), 1.1 * t, 0.02 * t]))
    score = score_track(track, truth).score
    assert score.distance_m == pytest.approx(40.0)
    assert score.rmse_m == pytest.approx(math.sqrt(10.0 / 5.0))
    assert score.p95_m == pytest.approx(2.0)
    assert score.final_m == pytest.approx(2.0)
    assert score.final_pct == pytest.approx(5.0)
    assert score.distance_error_pct == pytest.approx(10.0)
    assert score.height_final_m == pytest.approx(0.8)
    assert score_track(
        Track(t, track.position_m * [1, 0.9 / 1.1, 1]), truth
    ).score.distance_error_pct == pytest.approx(-10)


def test_start_alignment_uses_the_first_five_metres_only() -> None:
    """Truth goes 5 m along x, then 20 m along y; the estimate turns the other way. Only the first leg is fitted."""
    legs = np.array(
        [[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [5, 0]] + [[5, y] for y in range(1, 21)], dtype=float
    )
    t = np.arange(len(legs)).astype(float)
    truth = Truth(t, np.column_stack([legs, np.full(len(legs), np.nan)]))
    track = Track(t, np.column_stack([legs * [1.0, -1.0], np.zeros(len(legs))]))
    start, best = (score_track(track, truth, align).score for align in ("start", "best-fit"))
    assert start.final_m == pytest.approx(40.0)
    assert start.final_pct == pytest.approx(160.0)
    assert best.final_m is not None
    assert best.final_m < 10.0
    assert start.height_final_m is None  # the truth has no heights


@pytest.mark.parametrize("drift", [-6.0, 0.5, 30.0])
def test_a_constant_turn_rate_error_is_the_heading_drift(drift: float) -> None:
    truth_m = loop(120.0, radius_m=30.0)
    t = times(truth_m)
    angle = np.deg2rad(drift) * t / 60.0
    step = np.diff(truth_m[:, :2], axis=0)
    c, s = np.cos(angle[:-1]), np.sin(angle[:-1])
    turned = np.column_stack([c * step[:, 0] - s * step[:, 1], s * step[:, 0] + c * step[:, 1]])
    track_m = np.column_stack([np.vstack([[0.0, 0.0], np.cumsum(turned, axis=0)]), np.zeros(len(t))])
    score = score_track(Track(t, track_m), Truth(t, truth_m)).score
    assert score.heading_drift_deg_per_min == pytest.approx(drift, rel=0.01)


def test_one_wrong_direction_does_not_move_the_heading_drift() -> None:
    t = np.arange(0.0, 40.0)
    truth_m = np.column_stack([1.5 * t, np.zeros((40, 2))])
    track_m = truth_m.copy()
    track_m[20:, 1] += 10.0  # a jump sideways: one chord is wrong by 80 degrees
    score = score_track(Track(t, track_m), Truth(t, truth_m)).score
    assert score.heading_drift_deg_per_min == pytest.approx(0.0, abs=1e-6)


def test_a_closed_loop_knows_only_its_closing() -> None:
    t = np.array([0.0, 10.0, 20.0])
    track = Track(t, np.array([[0, 0, 0], [5.0, 5.0, 0], [0.3, 0.4, -0.2]]))
    score = score_track(track, Truth(t[[0, 2]], np.zeros((2, 3)))).score
    assert score.final_m == pytest.approx(0.5)
    assert score.height_final_m == pytest.approx(0.2)
    assert (score.rmse_m, score.distance_m, score.final_pct) == (None, None, None)


def test_no_truth_no_figures() -> None:
    track = Track(np.array([0.0, 1.0]), np.zeros((2, 3)))
    assert score_track(track, None).score.rmse_m is None
    late = Truth(np.array([100.0, 110.0]), np.ones((2, 3)) * [[0], [1]])
    assert score_track(track, late).score.rmse_m is None


def stepping_foot(strides: int, stride_m: float = 1.4) -> Truth:
    """A foot that rests 0.6 s and swings 0.4 s (minimum jerk), with a millimetre of tremble."""
    t = np.arange(0.0, strides + 0.6, 0.01)
    swing = np.clip((t % 1.0 - 0.6) / 0.4, 0.0, 1.0)
    x = stride_m * (np.floor(t) + 10 * swing**3 - 15 * swing**4 + 6 * swing**5)
    tremble = np.random.default_rng(1).normal(scale=2e-4, size=(len(t), 3))
    return Truth(t, np.column_stack([x, 0 * t, 0 * t]) + tremble, at_stances=True)


def test_strides_of_a_dense_truth_are_counted() -> None:
    assert true_strides(stepping_foot(17)) == 17
    assert true_strides(Truth(np.arange(5.0), np.zeros((5, 3)), strides=4)) == 4
    assert true_strides(Truth(np.arange(5.0), np.zeros((5, 3)))) is None


def test_truth_at_another_point_of_the_foot_is_compared_at_stances() -> None:
    """The marker swings ahead of the sensor, but both stand still together: no error but the tremble."""
    truth = stepping_foot(12)
    lead = 0.2 * np.sin(np.pi * np.clip((truth.time_s % 1.0 - 0.6) / 0.4, 0.0, 1.0))
    sensor = truth.position_m - np.column_stack([lead, 0 * lead, 0 * lead])
    score = score_track(Track(truth.time_s, sensor), truth).score
    assert score.rmse_m is not None
    assert score.rmse_m < 0.002
    assert score.distance_m == pytest.approx(12 * 1.4, abs=0.02)
    middles = stances(truth).time_s
    assert len(middles) == 13
    assert ((middles % 1.0 > 0.1) & (middles % 1.0 < 0.6)).all()


def test_too_few_directions_have_no_drift() -> None:
    t = np.arange(3.0)
    track = Track(t, np.column_stack([2 * t, t, t]))
    scored = score_track(track, Truth(t, track.position_m))
    assert scored.compared is not None
    assert heading_drift(scored.compared) is None
