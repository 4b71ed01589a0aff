"""A camera beside the feet: it joins, holds their heading, stands in for them, and never makes things worse."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bootprint.bus import Envelope
from bootprint.messages import CameraMotion, Position, upper_triangle
from fusion.camera_chain import CameraChain, CameraStep, is_plausible
from fusion.config import FusionConfig
from fusion.engine import FusionCore
from fusion.models import camera as model
from fusion.tilt import Tilt
from support.camera_walks import WalkingCamera
from support.foot_walks import (
    EAST,
    NS,
    ORIGIN,
    RIGHT,
    T0,
    WHO,
    SimulatedFoot,
    SimulatedWalk,
    in_time_order,
    rectangle,
    straight,
)

DUAL = FusionConfig(gnss_sources=(), start=EAST)
SINGLE = FusionConfig(feet=("left_foot",), gnss_sources=(), start=EAST)
DRIFT = math.radians(1.0) / 60.0
LEFT = SimulatedFoot("left_foot", mounting_rad=1.0, sideways_m=0.12, drift_rad_s=DRIFT)
ASKEW = Rotation.from_euler("ZYX", [0.3, 0.15, -0.08])
small = st.floats(-0.4, 0.4)


def played(config: FusionConfig, *streams: list[Envelope]) -> tuple[list[Position], FusionCore]:
    core = FusionCore(config, WHO, ORIGIN)
    out = [message for item in in_time_order(*streams) for message in core.handle(item)]
    messages = [item.message for item in (*out, *core.close())]
    return [message for message in messages if isinstance(message, Position)], core


def end_error_m(walk: SimulatedWalk, out: list[Position]) -> float:
    east, north, _ = walk.path(1.4 * walk.walk_s)
    return math.hypot(out[-1].east_m - east, out[-1].north_m - north)


def test_a_camera_holds_the_heading_of_a_drifting_foot() -> None:
    """Two minutes at a degree a minute: 168 m lead some 3 m astray without a camera."""
    walk = SimulatedWalk(straight(0.0), 120.0)
    alone, _ = played(SINGLE, walk.messages(LEFT))
    both, core = played(SINGLE, walk.messages(LEFT), WalkingCamera(ASKEW).messages(walk))
    assert core.counters["cameras_joined"] == 1
    assert end_error_m(walk, alone) > 2.0
    assert end_error_m(walk, both) < 0.65 * end_error_m(walk, alone)


def test_a_camera_carries_the_position_when_the_feet_fall_silent() -> None:
    walk = SimulatedWalk(rectangle(20.0, 8.0), 60.0)
    until = T0 + 30 * NS
    feet = [one for foot in (LEFT, RIGHT) for one in walk.messages(foot) if one.message.time_ns < until]
    out, core = played(DUAL, feet, WalkingCamera(ASKEW).messages(walk))
    modes = {position.mode: position.time_ns for position in out}
    assert modes["camera"] > modes["boots"]
    assert "coasting" not in modes
    assert out[-1].sources == ("camera",)
    assert core.counters["camera_gaps"] == 0
    assert end_error_m(walk, out) < 1.2
    moving = [position for position in out if position.mode == "camera" and position.time_ns < T0 + 58 * NS]
    assert np.median([position.speed_m_s for position in moving]) == pytest.approx(1.4, abs=0.1)
    assert abs(out[-1].up_m) < 1.0  # a camera tilted by nine degrees would have climbed 6 m


def test_without_any_feet_the_camera_begins_the_walk() -> None:
    walk = SimulatedWalk(rectangle(20.0, 8.0), 40.0)
    out, core = played(DUAL, WalkingCamera().messages(walk))
    assert core.counters["placed"] == 1
    assert out[-1].mode == "camera"
    assert end_error_m(walk, out) < 1.5


def test_after_the_dark_the_camera_finds_its_place_beside_the_feet_again() -> None:
    walk = SimulatedWalk(straight(0.4), 80.0)
    feet = [walk.messages(RIGHT)]
    out, core = played(
        msgspec.structs.replace(SINGLE, feet=("right_foot",)),
        *feet,
        WalkingCamera(ASKEW, blind_s=(30.0, 38.0)).messages(walk),
    )
    without, _ = played(msgspec.structs.replace(SINGLE, feet=("right_foot",)), *feet)
    assert core.counters["camera_gaps"] == 1
    assert core.counters["cameras_joined"] == 2
    assert end_error_m(walk, out) < end_error_m(walk, without) + 0.3


def test_a_camera_that_is_wrong_about_lengths_is_left_out_rather_than_followed() -> None:
    """Half as long again: the tracks do not look like one walk, so it never joins."""
    walk = SimulatedWalk(rectangle(20.0, 8.0), 60.0)
    out, core = played(
        DUAL, walk.messages(LEFT), walk.messages(RIGHT), WalkingCamera(scale=1.5).messages(walk)
    )
    without, _ = played(DUAL, walk.messages(LEFT), walk.messages(RIGHT))
    assert core.counters["cameras_joined"] <= 3
    assert end_error_m(walk, out) < end_error_m(walk, without) + 0.3


def test_a_second_camera_is_counted_and_left_out() -> None:
    walk = SimulatedWalk(straight(0.0), 20.0)
    first, second = (WalkingCamera(place=place).messages(walk) for place in ("camera", "rear"))
    _, core = played(DUAL, walk.messages(LEFT), walk.messages(RIGHT), first, second)
    assert core.counters["second_cameras"] == len(second)


def test_late_and_repeated_motions_do_no_harm() -> None:
    walk = SimulatedWalk(rectangle(20.0, 8.0), 40.0)
    told = WalkingCamera(ASKEW).messages(walk)
    core = FusionCore(SINGLE, WHO, ORIGIN)
    for number, item in enumerate(in_time_order(walk.messages(RIGHT), told, told[::7])):
        list(core.handle(item))
        if number % 50 == 0:
            list(core.handle(told[number // 50]))
    assert core.counters["late_camera_motion"] > 0
    assert core.counters["cameras_joined"] <= 1


# --- the parts -------------------------------------------------------------------------------------------


def motion(start_s: float, end_s: float, forward_m: float, turn_rad: float = 0.0) -> CameraMotion:
    return CameraMotion(
        time_ns=round(end_s * NS),
        start_time_ns=round(start_s * NS),
        translation_m=(forward_m, 0.0, 0.0),
        rotation_rad=(0.0, 0.0, turn_rad),
        covariance=upper_triangle(1e-4 * np.eye(6)),
    )


def test_motions_of_one_start_replace_each_other_and_a_new_start_finishes_them() -> None:
    chain = CameraChain()
    assert chain.take(motion(0.0, 0.1, 0.1)) is None
    assert chain.take(motion(0.0, 0.2, 0.25, math.pi / 2)) is None
    step = chain.take(motion(0.2, 0.3, 0.1))
    assert step is not None
    assert (step.start_ns, step.time_ns, step.gap_s) == (0, NS // 5, 0.0)
    assert step.displacement_m == pytest.approx((0.25, 0.0, 0.0))
    assert step.turn_rad == pytest.approx(math.pi / 2)
    np.testing.assert_allclose(chain.attitude @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)


def test_a_gap_is_told_and_what_is_out_of_order_is_left_out() -> None:
    chain = CameraChain()
    chain.take(motion(0.0, 0.5, 0.1))
    assert chain.take(motion(0.1, 0.3, 9.0)) is None
    assert chain.take(motion(0.0, 0.4, 9.0)) is None
    chain.take(motion(2.0, 2.5, 0.1))
    step = chain.take(motion(2.5, 2.6, 0.1))
    assert step is not None
    assert step.gap_s == pytest.approx(1.5)


def test_an_inertial_unit_levels_the_chain_without_turning_it() -> None:
    """Up is 0.3 rad behind the body's own up, for it is pitched so: forward leads down by as much."""
    true = Rotation.from_euler("ZYX", [0.0, 0.3, 0.0])
    up = true.inv().apply([0.0, 0.0, 1.0])
    chain = CameraChain()
    chain.take(msgspec.structs.replace(motion(0.0, 0.5, 1.0), up=tuple(map(float, up))))
    step = chain.pending()
    assert step is not None
    assert step.displacement_m == pytest.approx((math.cos(0.3), 0.0, -math.sin(0.3)))
    np.testing.assert_allclose(chain.attitude, true.as_matrix(), atol=1e-9)


def test_nobody_runs_at_fifty_metres_a_second() -> None:
    fast = CameraStep(0, NS // 10, (5.0, 0.0, 0.0), 0.0, np.eye(4))
    assert not is_plausible(fast, 12.0)
    assert is_plausible(fast, 60.0)
    assert not is_plausible(CameraStep(0, NS, (0.1, 0.0, 0.0), 0.0, np.diag([np.nan] * 4)), 12.0)


@given(st.tuples(small, small, small), st.tuples(small, small, small), st.tuples(small, small, small))
@settings(max_examples=60)
def test_the_steps_covariance_follows_finite_differences(
    tilt: tuple[float, ...], shift: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    attitude = Rotation.from_rotvec(tilt).as_matrix()
    start = CameraMotion(
        time_ns=1,
        start_time_ns=0,
        translation_m=(shift[0] + 1.0, shift[1], shift[2]),
        rotation_rad=(turn[0], turn[1], turn[2]),
    )

    def step_of(delta: np.ndarray) -> np.ndarray:
        """The step of a motion whose translation and rotation err by ``delta`` in the axes at the start."""
        place = np.array(start.translation_m) + delta[:3]
        turned = (Rotation.from_rotvec(delta[3:]) * Rotation.from_rotvec(turn)).as_rotvec()
        moved = msgspec.structs.replace(
            start, translation_m=tuple(map(float, place)), rotation_rad=tuple(map(float, turned))
        )
        displacement, change = model.level_step(attitude, moved)
        return np.array([*displacement, change])

    step = 1e-6
    slopes = [(step_of(step * axis) - step_of(-step * axis)) / (2.0 * step) for axis in np.eye(6)]
    spread = np.column_stack(slopes)
    stated = np.diag([1.0, 2.0, 3.0, 0.4, 0.5, 0.6])
    found = model.step_covariance(attitude, start, stated)
    np.testing.assert_allclose(found, spread @ stated @ spread.T, rtol=1e-4, atol=1e-5)


@given(st.tuples(small, small, small))
def test_the_turn_matrix_is_scipys(vector: tuple[float, float, float]) -> None:
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(model.turn_matrix(vector), expected, atol=1e-12)


def test_tilt_is_learnt_from_heights_in_two_directions() -> None:
    """A body pitched by 0.1 and rolled by −0.05: level walks seem to climb, until it is known."""
    true = Rotation.from_rotvec([-0.05, 0.1, 0.0])
    chain, tilt = CameraChain(), Tilt(0.2, 0.001, 0.02)
    for number in range(12):
        moved = np.array([2.0, 0.0, 0.0] if number % 2 else [0.0, 2.0, 0.0])
        seen = true.inv().apply(moved)
        chain.tilt(tilt.learn(chain.attitude @ seen, 0.0))
    np.testing.assert_allclose(chain.attitude, true.as_matrix(), atol=0.01)
    assert tilt.sigma_rad < 0.02
