"""The filter against the textbook's other form, its gate, and the two ways in which feet share errors."""

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.stats import chi2

from bootprint.messages import FootStep, upper_triangle
from fusion.chi_square import chi_square_quantile
from fusion.config import FeetConfig
from fusion.filter import Measurement, StateFilter, invert_spd
from fusion.models import dual_foot
from fusion.models.dual_foot import Passing
from fusion.models.shared_errors import prior
from fusion.state import Array, Layout
from fusion.transform import RigidTransform

LAYOUT = Layout.of(("left_foot", "right_foot"))
LEFT, RIGHT = LAYOUT.blocks


def spd(size: int, seed: int) -> Array:
    root = np.random.default_rng(seed).normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def started(seed: int = 1) -> StateFilter:
    """A filter with some state and a full covariance."""
    state_filter = StateFilter(LAYOUT, prior(LAYOUT, FeetConfig()))
    covariance = spd(8, seed)
    for block in LAYOUT.blocks:
        state_filter.widen(block, 0.5, 0.01)
    state_filter.widen_together(covariance[:3, :3], 0.02)
    return state_filter


def step(displacement: tuple[float, float, float], turn: float = 0.0) -> FootStep:
    return FootStep(
        time_ns=10**9,
        start_time_ns=0,
        displacement_m=displacement,
        heading_change_rad=turn,
        covariance=upper_triangle(np.zeros((4, 4))),
    )


def measured(residual: float, noise: float, **options: float | Array | None) -> Measurement:
    jacobian = np.zeros((3, LAYOUT.size))
    jacobian[:, LEFT.position] = np.eye(3)
    return Measurement("test", np.full(3, residual), jacobian, noise * np.eye(3), **options)  # type: ignore[arg-type]


def test_inverse_is_the_inverse() -> None:
    matrix = spd(3, 5)
    np.testing.assert_allclose(invert_spd(matrix) @ matrix, np.eye(3), atol=1e-12)
    with pytest.raises(np.linalg.LinAlgError):
        invert_spd(np.diag([1.0, -1.0]))


def test_quantile_is_that_of_the_tables() -> None:
    assert chi_square_quantile(0.95, 2) == pytest.approx(5.991, abs=1e-3)
    assert chi_square_quantile(0.999, 3) == pytest.approx(16.266, abs=1e-3)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 7, 50, 97])
@pytest.mark.parametrize("probability", [1e-6, 0.05, 0.5, 0.95, 0.999, 1.0 - 1e-9])
def test_quantile_is_scipy_s(probability: float, degrees: int) -> None:
    expected = chi2.isf(1.0 - probability, degrees)
    assert chi_square_quantile(probability, degrees) == pytest.approx(expected, rel=1e-9)


def test_a_fusion_is_small() -> None:
    """Every soldier's computer runs one: no scipy in it, which would double it."""
    code = "import sys, fusion.main; sys.exit(any(name.startswith('scipy') for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_update_agrees_with_the_information_form() -> None:
    state_filter = started()
    before, told = state_filter.covariance.copy(), state_filter.state.copy()
    measurement = measured(0.3, 0.2)
    state_filter.update(measurement)
    information = np.linalg.inv(before) + measurement.jacobian.T @ measurement.jacobian / 0.2
    posterior = np.linalg.inv(information)
    np.testing.assert_allclose(state_filter.covariance, posterior, atol=1e-9)
    np.testing.assert_allclose(
        state_filter.state - told, posterior @ measurement.jacobian.T @ measurement.residual / 0.2, atol=1e-9
    )


def test_gate_refuses_what_is_too_far_and_says_so() -> None:
    state_filter = started()
    before = state_filter.state.copy(), state_filter.covariance.copy()
    innovation = state_filter.update(measured(50.0, 0.2, gate_probability=0.999))
    assert not innovation.accepted
    assert innovation.normalised_squared > 16.3
    np.testing.assert_array_equal(state_filter.state, before[0])
    np.testing.assert_array_equal(state_filter.covariance, before[1])


def test_gate_looks_at_the_size_of_one_error_not_at_the_inflated_noise() -> None:
    generous = measured(20.0, 1000.0, gate_probability=0.999)
    strict = measured(20.0, 1000.0, gate_noise=np.eye(3), gate_probability=0.999)
    assert started().update(generous).accepted
    assert not started().update(strict).accepted


def test_step_composes_exactly_and_carries_heading_error_into_position() -> None:
    state_filter = StateFilter(LAYOUT)
    state_filter.widen(LEFT, 0.0, 0.01)
    state_filter.propagate(LEFT, step((2.0, 0.0, 0.0)), np.diag([0.0, 0.0, 0.04, 0.0]))
    np.testing.assert_allclose(state_filter.state[LEFT.all], [2.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(
        np.diag(state_filter.covariance)[LEFT.all], [0.0, 0.04, 0.04, 0.01], atol=1e-12
    )
    assert state_filter.covariance[1, 3] == pytest.approx(0.02)  # 2 m · 0.01 rad²
    np.testing.assert_array_equal(state_filter.state[RIGHT.all], np.zeros(4))


@pytest.mark.parametrize("alike", [False, True])
def test_joined_foot_shares_every_error_of_the_foot_beside_it(alike: bool) -> None:
    """And, under way, errs by its distance from it, 1 m east and 2 m north, times the heading's error of before."""
    state_filter = started()
    before = state_filter.covariance[LEFT.all, LEFT.all].copy()
    noise = np.diag([0.1, 0.1, 0.1, 0.2])
    state_filter.join(RIGHT, LEFT, np.array([1.0, 2.0, 0.0, 0.5]), noise, alike)
    difference, mean = np.hstack([np.eye(4), -np.eye(4)]), 0.5 * np.hstack([np.eye(4), np.eye(4)])
    east, north, _ = state_filter.state[RIGHT.position] - state_filter.state[LEFT.position]
    turned = np.zeros((4, 4))
    if not alike:  # who joins one under way goes round where that one's heading errs
        turned[0, 3], turned[1, 3] = -north, east
    difference[:, :4] += turned
    poses = state_filter.covariance[:8, :8]
    halfway = np.eye(4) + 0.5 * turned
    np.testing.assert_allclose(difference @ poses @ difference.T, noise, atol=1e-12)
    mean_noise = np.zeros((4, 4)) if alike else 0.25 * noise
    np.testing.assert_allclose(mean @ poses @ mean.T, halfway @ before @ halfway.T + mean_noise, atol=1e-12)
    assert np.linalg.eigvalsh(state_filter.covariance)[0] > -1e-12


def test_moving_the_frame_keeps_distances_and_adds_a_common_error() -> None:
    state_filter = StateFilter(LAYOUT)
    state_filter.propagate(LEFT, step((3.0, 4.0, 0.0)), np.zeros((4, 4)))
    move = RigidTransform((3.0, 4.0, 0.0), (100.0, 50.0, 7.0), np.pi / 2, np.diag([4.0, 4.0, 1.0, 0.01]))
    state_filter.transform(move)
    np.testing.assert_allclose(state_filter.state[LEFT.position], [100.0, 50.0, 7.0], atol=1e-12)
    np.testing.assert_allclose(state_filter.state[RIGHT.position], [104.0, 47.0, 7.0], atol=1e-12)
    variances = np.diag(state_filter.covariance)
    np.testing.assert_allclose(variances[LEFT.all], [4.0, 4.0, 1.0, 0.01], atol=1e-12)
    # 5 m from the target: the yaw's error adds (3 m)² east and (4 m)² north of 0.01 rad²
    np.testing.assert_allclose(variances[RIGHT.all], [4.09, 4.16, 1.0, 0.01], atol=1e-12)
    assert state_filter.covariance[LEFT.start, RIGHT.start] == pytest.approx(4.0)


def test_a_turn_towards_who_was_sighted_takes_their_own_error_aside_back() -> None:
    """A foot whose heading is known to 0.2 rad goes 3 m; then it is told that it went due east, give or take 0.01.

    Its heading and its place aside erred by the same angle, so both are as good as what it was told.
    """
    covariance = np.zeros((LAYOUT.size, LAYOUT.size))
    covariance[LEFT.yaw, LEFT.yaw] = 0.2**2
    state_filter = StateFilter(LAYOUT, (np.zeros(LAYOUT.size), covariance))
    state_filter.propagate(LEFT, step((3.0, 0.0, 0.0)), np.zeros((4, 4)))
    here, told = (3.0, 0.0, 0.0), np.diag([0.0, 0.0, 0.0, 0.01**2])
    state_filter.transform(RigidTransform((0.0, 0.0, 0.0), (7.0, 8.0, 0.0), 0.0, told, sighted=here), LEFT)
    np.testing.assert_allclose(state_filter.state[LEFT.all], [10.0, 8.0, 0.0, 0.0], atol=1e-12)
    variances = np.diag(state_filter.covariance)[LEFT.all]
    np.testing.assert_allclose(variances, [0.0, (3.0 * 0.01) ** 2, 0.0, 0.01**2], atol=1e-12)


@pytest.mark.parametrize("relative", [True, False])
def test_feet_that_hold_each_other_do_not_learn_where_north_is(relative: bool) -> None:
    """Two feet whose heading is known to 20 degrees pass each other three hundred times.

    Nothing of that tells what turns both. Told that the measurements are relative, the filter knows; else the
    corrections, each linearised elsewhere, add up to a heading that it believes in.
    """
    rng, size = np.random.default_rng(9), LAYOUT.size
    common, own, sigmas = math.radians(20.0), 0.05, np.array([0.02, 0.02, 0.02, 0.05])
    covariance = np.zeros((size, size))
    for one in LAYOUT.blocks:
        for other in LAYOUT.blocks:
            covariance[one.yaw, other.yaw] = common**2 + (own**2 if one is other else 0.0)
    state = np.zeros(size)
    state[LAYOUT.width], state[LEFT.start + 1], state[RIGHT.start] = 0.2, 0.2, 0.7
    walked = StateFilter(LAYOUT, (state, covariance))
    for number in range(300):
        stepped, standing, side = (RIGHT, LEFT, 1.0) if number % 2 else (LEFT, RIGHT, -1.0)
        forward, left, up, turn = sigmas * rng.normal(size=4) + (1.4, 0.0, 0.0, 0.0)
        walked.propagate(stepped, step((forward, left, up), turn), np.diag(sigmas**2))
        passing = Passing(standing, stepped, (forward, left, up), turn)
        residual = 0.05 * rng.normal(size=3) - dual_foot.abreast(walked.state, passing, side, LAYOUT.width)
        jacobian = dual_foot.abreast_jacobian(walked.state, passing, side, LAYOUT.width)
        noise = 0.05**2 * np.eye(3)
        walked.update(Measurement("dual_foot", residual, jacobian, noise, relative=relative))
    mean = np.zeros(size)
    mean[[LEFT.yaw, RIGHT.yaw]] = 0.5
    assert (math.sqrt(float(mean @ walked.covariance @ mean)) > common) == relative
