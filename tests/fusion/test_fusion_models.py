"""Every Jacobian against finite differences, and the models against geometry worked out by hand."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.messages import GnssFix, upper_triangle
from fusion.config import FeetConfig, GnssConfig
from fusion.models import body, dual_foot, foot_step, gnss
from fusion.models.dual_foot import Passing
from fusion.state import Array, Layout
from fusion.transform import RigidTransform

LEFT, RIGHT = Layout.of(("left_foot", "right_foot")).blocks
metres = st.floats(-50.0, 50.0)
angles = st.floats(-3.0, 3.0)
vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
states = st.tuples(metres, metres, metres, angles, metres, metres, metres, angles).map(np.array)


def numerical_jacobian(function: Callable[[Array], Array], at: Array, step: float = 1e-6) -> Array:
    """Central differences, (outputs, inputs)."""
    columns = [
        (function(at + step * unit) - function(at - step * unit)) / (2 * step) for unit in np.eye(at.size)
    ]
    return np.stack(columns, axis=-1)


@given(pose=st.tuples(metres, metres, metres, angles).map(np.array), step=vectors, turn=st.floats(-0.1, 0.1))
@settings(max_examples=50)
def test_step_jacobians_match_finite_differences(
    pose: Array, step: tuple[float, float, float], turn: float
) -> None:
    by_pose = numerical_jacobian(lambda p: foot_step.compose(p, step, turn), pose)
    by_step = numerical_jacobian(
        lambda s: foot_step.compose(pose, (s[0], s[1], s[2]), s[3]), np.array([*step, turn])
    )
    np.testing.assert_allclose(foot_step.pose_jacobian(pose, step), by_pose, atol=1e-6)
    np.testing.assert_allclose(foot_step.step_jacobian(pose), by_step, atol=1e-6)


@given(state=states, left=vectors, right=vectors)
@settings(max_examples=50)
def test_body_jacobian_matches_finite_differences(
    state: Array, left: tuple[float, float, float], right: tuple[float, float, float]
) -> None:
    stands = [(LEFT, left), (RIGHT, right)]
    numerical = numerical_jacobian(lambda x: body.position(x, stands), state)
    np.testing.assert_allclose(body.position_jacobian(state, stands), numerical, atol=1e-6)


@given(state=states, step=vectors, turn=angles)
@settings(max_examples=50)
def test_dual_foot_jacobians_match_finite_differences(
    state: Array, step: tuple[float, float, float], turn: float
) -> None:
    passing = Passing(LEFT, RIGHT, step, turn)
    numerical = numerical_jacobian(lambda x: dual_foot.difference(x, passing), state)
    np.testing.assert_allclose(dual_foot.difference_jacobian(state, passing), numerical, atol=1e-6)
    if dual_foot.separation(state, passing) > 0.1:
        numerical = numerical_jacobian(lambda x: np.array([dual_foot.separation(x, passing)]), state)
        np.testing.assert_allclose(dual_foot.separation_jacobian(state, passing), numerical, atol=1e-5)


@given(
    pose=st.tuples(metres, metres, metres, angles).map(np.array), pivot=vectors, target=vectors, yaw=angles
)
@settings(max_examples=50)
def test_transform_jacobians_match_finite_differences(
    pose: Array, pivot: tuple[float, float, float], target: tuple[float, float, float], yaw: float
) -> None:
    def moved_by(error: Array) -> Array:
        shifted = (target[0] + error[0], target[1] + error[1], target[2] + error[2])
        return RigidTransform(pivot, shifted, yaw + error[3], np.eye(4)).pose(pose)

    def smooth(values: Array) -> Array:  # without the jump of the angle at ±π
        return np.array([*values[:3], math.remainder(values[3] - reference, 2 * math.pi)])

    move = RigidTransform(pivot, target, yaw, np.eye(4))
    reference = move.pose(pose)[3]
    local = (float(pose[0]), float(pose[1]), float(pose[2]))
    np.testing.assert_allclose(
        move.pose_jacobian(), numerical_jacobian(lambda p: smooth(move.pose(p)), pose), atol=1e-6
    )
    np.testing.assert_allclose(
        move.error_jacobian(local), numerical_jacobian(lambda e: smooth(moved_by(e)), np.zeros(4)), atol=1e-6
    )


def test_four_quarter_turn_steps_come_back_to_the_start() -> None:
    pose = np.array([3.0, -2.0, 1.0, 0.4])
    for _ in range(4):
        pose = foot_step.compose(pose, (1.5, 0.0, 0.0), math.pi / 2)
    np.testing.assert_allclose(pose, [3.0, -2.0, 1.0, 0.4], atol=1e-12)


def test_a_step_forward_with_yaw_north_goes_north() -> None:
    pose = foot_step.compose(np.array([0.0, 0.0, 0.0, math.pi / 2]), (1.0, 0.25, 0.5), 0.0)
    np.testing.assert_allclose(pose, [-0.25, 1.0, 0.5, math.pi / 2], atol=1e-12)


def test_feet_walking_side_by_side_differ_by_their_width_only() -> None:
    """Stances half a stride apart along the way: the midpoint of a step lies abreast of the other foot."""
    state = np.array([10.0, 0.1, 0.0, 0.3, 10.7, -0.1, 0.0, -1.0])  # left stands at 10.0, right came to 10.7
    turned_into_step = (1.4 * math.cos(1.0), 1.4 * math.sin(1.0), 0.0)  # 1.4 m east, seen with yaw −1
    passing = Passing(LEFT, RIGHT, turned_into_step, 0.0)
    np.testing.assert_allclose(dual_foot.difference(state, passing), [0.0, 0.2, 0.0], atol=1e-12)


def test_covariance_that_is_none_is_refused() -> None:
    good = np.diag([0.01, 0.02, 0.03, 0.001])
    accepted = foot_step.step_covariance(upper_triangle(good))
    assert accepted is not None
    np.testing.assert_array_equal(accepted, good)
    assert foot_step.step_covariance(upper_triangle(np.zeros((4, 4)))) is not None
    assert foot_step.step_covariance(upper_triangle(np.diag([0.01, -0.02, 0.03, 0.001]))) is None
    crossed = good.copy()
    crossed[0, 1] = crossed[1, 0] = 1.0
    assert foot_step.step_covariance(upper_triangle(crossed)) is None


def test_unmodelled_error_grows_with_length_and_time() -> None:
    boots = FeetConfig(scale_sigma=0.1, heading_walk_rad_sqrt_s=0.01)
    added = foot_step.unmodelled((3.0, 4.0, 0.0), 4.0, boots)
    np.testing.assert_allclose(np.diag(added), [0.25, 0.25, 0.25, 4e-4])


def fix(**fields: object) -> GnssFix:
    values = {"time_ns": 0, "fix_kind": "3d", "latitude_deg": 58.0, "longitude_deg": 15.0, **fields}
    return GnssFix(**values)  # type: ignore[arg-type]


def test_accuracy_is_the_receivers_else_hdop_times_uere_never_hdop_as_metres() -> None:
    config = GnssConfig(uere_m=6.0, accuracy_floor_m=1.0)
    assert gnss.horizontal_sigma_m(fix(horizontal_accuracy_m=3.5, hdop=0.8), config) == 3.5
    assert gnss.horizontal_sigma_m(fix(horizontal_accuracy_m=0.02), config) == 1.0
    assert gnss.horizontal_sigma_m(fix(hdop=0.8), config) == pytest.approx(4.8)
    assert gnss.horizontal_sigma_m(fix(), config) is None


@pytest.mark.parametrize("kind", ["none", "dead_reckoning"])
def test_fixes_that_are_no_satellite_positions_are_none(kind: str) -> None:
    assert not gnss.has_position(fix(fix_kind=kind))
    assert not gnss.has_position(fix(latitude_deg=None))
    assert gnss.has_position(fix())


def test_correlated_fixes_carry_the_information_of_few() -> None:
    """The mean of an AR(1) error over a long time has the variance of white noise inflated by 2τ/Δt."""
    tau_s, step_s, count = 30.0, 1.0, 2000
    lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count))) * step_s
    variance_of_mean = float(np.exp(-lags / tau_s).mean())
    walking = gnss.correlation_inflation(step_s, 1.4, GnssConfig(correlation_s=tau_s))
    assert walking / count == pytest.approx(variance_of_mean, rel=0.03)
    assert gnss.correlation_inflation(100.0, 140.0, GnssConfig(correlation_s=tau_s)) == 1.0
    assert gnss.correlation_inflation(math.inf, math.inf, GnssConfig()) == 1.0


def test_fixes_of_who_stands_tell_hardly_anything_new() -> None:
    """Five minutes of standing are worth half a fix, and so are six metres of creeping, however slow."""
    config = GnssConfig(standing_correlation_s=300.0, reflection_m=6.0)
    assert 300.0 / gnss.correlation_inflation(1.0, 0.0, config) == pytest.approx(0.5)
    creeping = [gnss.correlation_inflation(1.0, 0.05, config) for _ in range(120)]
    assert sum(1.0 / one for one in creeping) == pytest.approx(0.5 + 0.5 * 120 / 300)


def test_a_heading_that_is_hardly_known_leaves_the_place_on_an_arc() -> None:
    """A way of 100 m to the east whose heading is good to 20 degrees: mean squares of many draws."""
    layout = Layout.of(("left_foot",))
    block, sigma, way_m = layout.blocks[0], math.radians(20.0), 100.0
    covariance = np.zeros((layout.size, layout.size))
    response = np.zeros(layout.size)
    response[block.start + 1], response[block.yaw] = way_m, 1.0  # north of the place, and the yaw
    covariance += sigma**2 * np.outer(response, response)
    stands: list[body.Stand] = [(block, (0.0, 0.0, 0.0))]
    told = body.position_covariance(np.zeros(layout.size), covariance, stands)
    turns = np.random.default_rng(3).normal(0.0, sigma, 200_000)
    assert told[0, 0] == pytest.approx(np.mean((way_m * (np.cos(turns) - 1.0)) ** 2), rel=0.02)
    assert told[1, 1] == pytest.approx(np.mean((way_m * np.sin(turns)) ** 2), rel=0.02)
    assert not body.position_covariance(np.zeros(layout.size), np.zeros_like(covariance), stands).any()
