"""Honest covariances score 95 % inside and a NEES of 2; dishonest ones do not. By simulation."""

from dataclasses import replace

import numpy as np
import pytest

from proving_ground.evaluation.alignment import Track, fit_rigid
from proving_ground.evaluation.consistency import Consistency, StepChain, consistency
from proving_ground.evaluation.scoring import score_track
from sensor_gateway.recordings.run import Truth

STRIDES, STRIDE_S = 80, 1.0
SIGMA = np.array([0.03, 0.02, 0.004])  # forward m, left m, heading rad, of each step


def walk(rng: np.random.Generator, *, turns: bool = True) -> tuple[StepChain, np.ndarray]:
    """A true walk as stance positions (n + 1, 2), and a chain of steps with errors as large as it says."""
    turn = rng.normal(scale=0.3, size=STRIDES) if turns else np.zeros(STRIDES)
    exact = StepChain(
        time_s=STRIDE_S * np.arange(STRIDES + 1.0),
        displacement_m=np.tile([1.4, 0.0], (STRIDES, 1)),
        heading_change_rad=turn,
        covariance=np.tile(np.diag(SIGMA**2), (STRIDES, 1, 1)),
    )
    error = rng.normal(size=(STRIDES, 3)) * SIGMA
    noisy = replace(
        exact,
        displacement_m=exact.displacement_m + error[:, :2],
        heading_change_rad=turn + error[:, 2],
    )
    c, s = np.cos(1.0), np.sin(1.0)  # the truth's frame is turned and elsewhere
    return noisy, exact.position_m @ np.array([[c, s], [-s, c]]) + [100.0, -50.0]


def truth_of(chain: StepChain, position_m: np.ndarray) -> Truth:
    return Truth(chain.time_s, np.column_stack([position_m, np.zeros(len(position_m))]))


def figures(
    fitted_until_s: float, scale: float = 1.0, runs: int = 120, *, turns: bool = True
) -> tuple[float, float]:
    """Mean NEES and share inside over many walks whose covariances are ``scale`` times the honest ones."""
    rng = np.random.default_rng(7)
    found = []
    for _ in range(runs):
        chain, truth_m = walk(rng, turns=turns)
        claimed = replace(chain, covariance=chain.covariance * scale)
        found.append(consistency(claimed, truth_of(chain, truth_m), fitted_until_s))
    assert all(result is not None for result in found)
    return (
        float(np.mean([result.nees for result in found if result])),
        float(np.mean([result.inside_95_pct for result in found if result])),
    )


@pytest.mark.parametrize("turns", [True, False])
@pytest.mark.parametrize("fitted_until_s", [STRIDES * STRIDE_S, 4.0])
def test_honest_covariance_is_95_pct_inside(fitted_until_s: float, turns: bool) -> None:
    """Also when only the start is fitted, and the heading error at the windows' starts is large."""
    nees, inside = figures(fitted_until_s, turns=turns)
    assert nees == pytest.approx(2.0, abs=0.25)
    assert inside == pytest.approx(95.0, abs=1.5)


@pytest.mark.parametrize(("scale", "nees", "low", "high"), [(0.25, 8.0, 40.0, 70.0), (4.0, 0.5, 99.5, 100.0)])
def test_boasting_and_timid_covariances_are_seen(scale: float, nees: float, low: float, high: float) -> None:
    found_nees, inside = figures(STRIDES * STRIDE_S, scale, runs=40)
    assert found_nees == pytest.approx(nees, rel=0.2)
    assert low <= inside <= high


def test_heading_error_at_the_window_start_counts() -> None:
    """All uncertainty in one early turn, and only the start fitted: later ellipses are lever times that angle."""
    chain, truth_m = walk(np.random.default_rng(1), turns=False)
    sigma = 1e-3
    covariance = np.tile(np.diag([1e-8, 1e-8, 1e-12]), (STRIDES, 1, 1))
    covariance[10, 2, 2] = sigma**2
    one_sigma_off = replace(
        chain,
        displacement_m=np.tile([1.4, 0.0], (STRIDES, 1)),
        heading_change_rad=np.where(np.arange(STRIDES) == 10, sigma, 0.0),
        covariance=covariance,
    )
    result = consistency(one_sigma_off, truth_of(chain, truth_m), fitted_until_s=6.0)
    assert result is not None
    # Of 71 windows two end before the turn has moved anything; in all others the error is one sigma one way.
    assert result.windows == 71
    assert result.nees == pytest.approx(69 / 71, rel=0.03)


def test_sparse_truth_is_matched_to_the_stance_that_ended_near_it() -> None:
    chain, truth_m = walk(np.random.default_rng(3))
    every_third = Truth(chain.time_s[::3] + 0.1, np.column_stack([truth_m[::3], np.zeros(27)]))
    far_off = Truth(chain.time_s[::3] + 0.5, every_third.position_m)
    result = consistency(chain, every_third, 1e9)
    assert result is not None
    assert result.windows == 23  # 27 stances, the last four start no window of ten seconds
    assert result.nees < 8.0
    assert consistency(chain, far_off, 1e9) is None


def test_dense_truth_is_read_at_the_stances() -> None:
    chain, truth_m = walk(np.random.default_rng(3))
    t = np.arange(0.0, 80.0, 0.01)
    dense = np.column_stack([np.interp(t, chain.time_s, column) for column in truth_m.T])
    result = consistency(chain, Truth(t, np.column_stack([dense, 0 * t])), 1e9)
    at_stances = consistency(chain, truth_of(chain, truth_m), 1e9)
    assert result is not None
    assert at_stances is not None
    assert result.nees == pytest.approx(at_stances.nees, rel=0.1)


def test_a_short_walk_has_no_windows() -> None:
    chain, truth_m = walk(np.random.default_rng(3))
    short = StepChain(
        chain.time_s[:6], chain.displacement_m[:5], chain.heading_change_rad[:5], chain.covariance[:5]
    )
    assert consistency(short, truth_of(short, truth_m[:6]), 1e9) is None


def test_the_score_carries_the_figures() -> None:
    chain, truth_m = walk(np.random.default_rng(3))
    track = Track(chain.time_s, np.column_stack([chain.position_m, np.zeros(STRIDES + 1)]))
    score = score_track(track, truth_of(chain, truth_m), steps=chain).score
    expected = consistency(chain, truth_of(chain, truth_m), 1e9)
    assert expected is not None
    assert (score.nees, score.inside_95_pct) == (expected.nees, expected.inside_95_pct)
    yaw = fit_rigid(chain.position_m, truth_m).yaw_rad
    assert yaw == pytest.approx(1.0, abs=0.2)


def alike(rng: np.random.Generator) -> tuple[StepChain, Truth]:
    """A walk whose steps err by a scale, a slope and a turn that all of them share, and a little by themselves."""
    scale, slope, turn_rad_s = rng.normal(size=3) * [0.03, 0.02, 0.002]
    own = np.array([0.01, 0.01, 0.002])
    error = rng.normal(size=(STRIDES, 3)) * own
    truth = StepChain(
        time_s=STRIDE_S * np.arange(STRIDES + 1.0),
        displacement_m=np.tile([1.4, 0.0], (STRIDES, 1)),
        heading_change_rad=rng.normal(scale=0.2, size=STRIDES),
        covariance=np.tile(
            np.diag(own**2 + [(0.03 * 1.4) ** 2, 0.0, (0.002 * STRIDE_S) ** 2]), (STRIDES, 1, 1)
        ),
    )
    claimed = replace(
        truth,
        displacement_m=truth.displacement_m * (1.0 + scale) + error[:, :2],
        heading_change_rad=truth.heading_change_rad + turn_rad_s * STRIDE_S + error[:, 2],
        common_scale=0.03,
        common_turn_rad_s=0.002,
        common_slope=0.02,
        climb_m=0.2 * (1.0 + scale) + slope * 1.4 + rng.normal(size=STRIDES) * 0.005,
        climb_variance_m2=np.full(STRIDES, (0.03 * 0.2) ** 2 + (0.02 * 1.4) ** 2 + 0.005**2),
    )
    height = 0.2 * np.arange(STRIDES + 1.0)
    # Densely known, as by motion capture: straight from stance to stance.
    fine_s = np.arange(0.0, STRIDES * STRIDE_S + 1e-9, 0.05)
    columns = (*truth.position_m.T, height)
    return claimed, Truth(fine_s, np.column_stack([np.interp(fine_s, truth.time_s, c) for c in columns]))


def mean_of(found: list[Consistency | None], figure: str) -> float:
    return float(np.mean([getattr(one, figure) for one in found]))


def test_errors_that_steps_share_are_honest_as_shared_and_not_as_noise() -> None:
    rng = np.random.default_rng(11)
    shared, noise = [], []
    for _ in range(90):
        chain, truth = alike(rng)
        shared.append(consistency(chain, truth, STRIDES * STRIDE_S))
        as_noise = replace(chain, common_scale=0.0, common_turn_rad_s=0.0, common_slope=0.0)
        noise.append(consistency(as_noise, truth, STRIDES * STRIDE_S))
    for figure, honest in (("nees", 2.0), ("along_nees", 1.0), ("across_nees", 1.0), ("height_nees", 1.0)):
        assert mean_of(shared, figure) == pytest.approx(honest, rel=0.2), figure
    # A turn that all share bends the run, and most of that the run's fit takes away: across, little is seen of it.
    for figure, honest in (("nees", 2.0), ("along_nees", 1.0), ("height_nees", 1.0)):
        assert mean_of(noise, figure) > 1.5 * honest, figure
    assert mean_of(shared, "height_inside_95_pct") == pytest.approx(95.0, abs=5.0)
    assert mean_of(shared, "inside_95_pct") == pytest.approx(95.0, abs=5.0)


def test_heights_are_unknown_where_the_truth_is_flat() -> None:
    chain, truth_m = walk(np.random.default_rng(0))
    found = consistency(chain, truth_of(chain, truth_m), STRIDES * STRIDE_S)
    assert found is not None
    assert found.height_nees is None
    assert found.height_inside_95_pct is None
