"""Two feet: what a passing tells, errors that steps share, and a foot that goes wrong and comes back."""

import math
from collections import Counter
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.messages import FootStep, Position, upper_triangle
from fusion.boots import Boots
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.models import dual_foot
from fusion.models.dual_foot import Passing
from fusion.models.shared_errors import shares_of
from fusion.state import Array, Layout
from support.foot_walks import (
    EAST,
    LEFT,
    NS,
    RIGHT,
    T0,
    WHO,
    SimulatedWalk,
    in_time_order,
    rectangle,
)

LAYOUT = Layout.of(("left_foot", "right_foot"))
ONE, OTHER = LAYOUT.blocks
small = st.floats(-2.0, 2.0)


@given(
    numbers=st.lists(small, min_size=LAYOUT.size, max_size=LAYOUT.size),
    step=st.tuples(st.floats(0.5, 2.0), small, small),
    turn=small,
    side=st.sampled_from([-1.0, 0.0, 1.0]),
)
@settings(max_examples=30)
def test_passing_jacobian_matches_finite_differences(
    numbers: list[float], step: tuple[float, float, float], turn: float, side: float
) -> None:
    state, passing = np.array(numbers), Passing(ONE, OTHER, step, turn)

    def at(x: Array) -> Array:
        return dual_foot.abreast(x, passing, side, LAYOUT.width)

    columns = [(at(state + 1e-6 * unit) - at(state - 1e-6 * unit)) / 2e-6 for unit in np.eye(LAYOUT.size)]
    jacobian = dual_foot.abreast_jacobian(state, passing, side, LAYOUT.width)
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=-1), atol=1e-5)


def test_feet_on_two_circles_pass_each_other_at_their_width() -> None:
    """The left foot stands on a circle of 3 m; the right one goes along one of 3.2 m around the same centre."""
    turn, width = 0.4, 0.2
    ends = [3.2 * np.array([math.cos(angle), math.sin(angle), 0.0]) for angle in (-turn / 2, turn / 2)]
    state = np.zeros(LAYOUT.size)
    state[ONE.position], state[OTHER.position] = (3.0, 0.0, 0.0), ends[1]
    state[OTHER.yaw] = turn / 2  # the step's frame turns with it, and its start looks to the east at no turn
    chord = ends[1] - ends[0]
    yaw = state[OTHER.yaw] - turn
    step = (
        float(math.cos(yaw) * chord[0] + math.sin(yaw) * chord[1]),
        float(-math.sin(yaw) * chord[0] + math.cos(yaw) * chord[1]),
        0.0,
    )
    state[LAYOUT.width] = width
    passing = Passing(ONE, OTHER, step, turn)
    np.testing.assert_allclose(dual_foot.abreast(state, passing, 1.0, LAYOUT.width), 0.0, atol=2e-3)


def common_step(told: tuple[float, float, float] = (2.0, 1.0, 0.5)) -> FootStep:
    covariance = np.diag([0.01, 0.01, 0.01, 0.01])
    return FootStep(
        time_ns=T0 + 2 * NS,
        sequence=0,
        start_time_ns=T0,
        displacement_m=told,
        heading_change_rad=0.1,
        covariance=upper_triangle(covariance),
        common_scale_sigma=0.02,
        common_slope_sigma=0.01,
        common_turn_sigma_rad_s=0.001,
    )


def test_shared_errors_act_as_the_message_says_and_leave_the_rest_of_the_covariance() -> None:
    shares = shares_of(common_step())
    assert shares is not None
    moved, turned = shares.corrected(common_step(), np.array([1.0, -1.0, 2.0]))
    assert moved == pytest.approx((2.04, 1.02, 0.51 - 0.01 * math.sqrt(5.0)))
    assert turned == pytest.approx(0.1 + 2 * 0.001 * 2.0)
    own = shares.own(0.01 * np.eye(4))
    assert own is not None
    assert own[0, 0] == pytest.approx(0.01 - (0.02 * 2.0) ** 2)
    assert own[3, 3] == pytest.approx(0.01 - 0.002**2)
    assert shares.own(1e-6 * np.eye(4)) is None  # names more as shared than it holds


def test_a_step_without_all_shared_errors_shares_none() -> None:
    assert shares_of(msgspec.structs.replace(common_step(), common_slope_sigma=None)) is None


Wrong = tuple[float, float, float | None]  # a step's length by, its turn more by rad, its quality


def damaged(stream: list[Envelope], begin_s: float, end_s: float, wrong: Wrong) -> list[Envelope]:
    """Steps between these times are so many times as long, turn more, and are of poor quality."""
    return [replace(one, message=_worse(one.message, begin_s, end_s, wrong)) for one in stream]


def _worse(message: object, begin_s: float, end_s: float, wrong: Wrong) -> FootStep:
    factor, turn_rad, quality_pct = wrong
    assert isinstance(message, FootStep)
    if not begin_s <= (message.time_ns - T0) / NS < end_s:
        return message
    forward, left, up = message.displacement_m
    return msgspec.structs.replace(
        message,
        displacement_m=(factor * forward, factor * left, up),
        heading_change_rad=message.heading_change_rad + turn_rad,
        quality_pct=quality_pct,
    )


def played(*streams: list[Envelope]) -> tuple[list[Position], FusionCore]:
    core = FusionCore(
        FusionConfig(gnss_sources=(), start=EAST), WHO, Origin(latitude_deg=58.4, longitude_deg=15.6)
    )
    out = [said for one in in_time_order(*streams) for said in core.handle(one)]
    said = [one.message for one in (*out, *core.close())]
    return [message for message in said if isinstance(message, Position)], core


@pytest.mark.parametrize("wrong", [(0.3, 0.0, 10.0), (1.0, 1.5, 10.0), (0.3, 0.0, None), (2.5, 0.0, None)])
def test_a_foot_that_diverges_is_dropped_visibly_and_taken_back(wrong: Wrong) -> None:
    walk = SimulatedWalk(rectangle(20, 8), 120.0, poses=False)
    right = damaged(walk.messages(RIGHT), 30.0, 60.0, wrong)
    out, core = played(walk.messages(LEFT), right)
    assert core.counters["feet_diverged"] >= 1
    by_time = {round((position.time_ns - T0) / NS, 1): position for position in out}
    assert by_time[50.0].rejected == ("right_foot",)
    assert by_time[50.0].sources == ("left_foot",)
    assert by_time[110.0].rejected == ()
    assert by_time[110.0].sources == ("left_foot", "right_foot")
    for time_s in (50.0, 110.0):
        truth = walk.body(LEFT, RIGHT, time_s=time_s)
        assert math.hypot(by_time[time_s].east_m - truth[0], by_time[time_s].north_m - truth[1]) < 1.5


def test_healthy_feet_are_never_doubted() -> None:
    walk = SimulatedWalk(rectangle(20, 8), 120.0, poses=False)
    sigmas = (0.02, 0.02, 0.01, 0.005)
    out, core = played(
        walk.messages(replace(LEFT, sigmas=sigmas)), walk.messages(replace(RIGHT, sigmas=sigmas))
    )
    assert core.counters["feet_diverged"] == 0
    assert not any(position.rejected for position in out)


def test_the_walking_width_is_learned_by_walking_in_more_than_one_direction() -> None:
    boots = Boots(FusionConfig(), Counter())
    walk = SimulatedWalk(rectangle(20, 8), 240.0, poses=False)
    wide = [replace(foot, sideways_m=foot.sideways_m * 1.7) for foot in (LEFT, RIGHT)]
    for one in in_time_order(*(walk.messages(foot) for foot in wide)):
        assert isinstance(one.message, FootStep)
        boots.step(one.address.source, one.message)
    assert boots.filter.state[boots.filter.layout.width] == pytest.approx(0.408, abs=0.04)
