"""What is told of each foot step: its shape, its kind, its direction, its quality, and how wrong it may be."""

import dataclasses
from typing import get_args

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.messages import Direction, MotionClass
from pdr_engine.foot import FootSettings, FootStepEstimate
from pdr_engine.foot.memory import DIRECTIONS, MOTIONS, STEP, fresh_state
from pdr_engine.foot.strides import clearance
from pdr_engine.foot.uncertainty import widen
from support.foot_streams import Stream, navigate
from support.striding_foot import Stride, striding

WALK = [Stride()] * 5
AHEAD = Rotation.identity()


def strides(stream: Stream, mounting: Rotation = AHEAD) -> list[FootStepEstimate]:
    """The steps that are no standing."""
    return [step for step in navigate(stream.mounted(mounting)).steps if step.motion != "standing"]


def test_the_kernel_and_the_messages_know_the_same_classes() -> None:
    assert get_args(MotionClass) == MOTIONS
    assert set(get_args(Direction)) | {None} == set(DIRECTIONS)


def test_length_clearance_and_times_of_strides_made_to_measure() -> None:
    """Below 10 % of its way's ends the foot is hardly moving: the swing seems shorter, the stance longer."""
    made = [Stride((1.3, 0.0, 0.0), lift_m=0.10), Stride((0.9, 0.0, 0.0), lift_m=0.16), Stride()]
    for step, stride in zip(strides(striding(made)), made, strict=True):
        assert step.horizontal_length_m == pytest.approx(stride.way_m[0], abs=0.02)
        assert step.length_m == pytest.approx(stride.way_m[0], abs=0.02)
        assert step.clearance_m == pytest.approx(stride.lift_m, abs=0.015)
        assert step.swing_s == pytest.approx(stride.swing_s, abs=0.12)
        assert step.stance_s == pytest.approx(stride.stance_s, abs=0.15)


def test_length_in_space_and_across_the_ground_differ_on_stairs() -> None:
    step = strides(striding([*WALK, Stride((0.56, 0.0, 0.34))]))[-1]
    assert step.horizontal_length_m == pytest.approx(0.56, abs=0.02)
    assert step.length_m == pytest.approx(np.hypot(0.56, 0.34), abs=0.02)


@pytest.mark.parametrize("climb_m", [0.0, 0.3, -0.3])
def test_a_drift_that_the_landing_corrects_does_not_raise_the_swing(climb_m: float) -> None:
    """A parabola over the line between the stances, with a drift of 40 cm on it that the update takes away."""
    state = fresh_state(FootSettings())
    count, first, lift_m = 100, 7, 0.13
    u = np.arange(1, count + 1) / count
    rows = np.arange(first, first + count)
    state["flight"][0, rows, 0] = 1.2 * u
    state["flight"][0, rows, 2] = climb_m * u + lift_m * 4 * u * (1 - u) + 0.4 * u
    state["correction"][0] = [0.0, 0.0, -0.4]
    state["swing"], state["lifted"], state["landed"] = first, first, first + count - 1
    state["position"][0] = [1.2, 0.0, climb_m]
    assert clearance(state[0]) == pytest.approx(lift_m, abs=1e-9)


@pytest.mark.parametrize(
    ("heights_m", "climb_m", "above_m"), [([0.1, 0.35, 0.31], 0.3, 0.05), ([0.04, -0.2, -0.28], -0.3, 0.04)]
)
def test_where_the_line_is_vertical_clearance_counts_from_the_higher_stance(
    heights_m: list[float], climb_m: float, above_m: float
) -> None:
    state = fresh_state(FootSettings())
    state["flight"][0, 1:4, 2] = heights_m
    state["swing"], state["lifted"], state["landed"] = 1, 1, 3
    state["position"][0] = [0.01, 0.0, climb_m]
    assert clearance(state[0]) == pytest.approx(above_m)


def test_stairs_go_up_and_down_by_the_sign_and_a_ramp_is_walked() -> None:
    stairs = [Stride((0.56, 0.0, 0.34))] * 3 + [Stride((0.6, 0.0, -0.17))] * 3
    told = strides(striding([*WALK, *stairs, *[Stride((1.2, 0.0, 0.12))] * 3]))
    assert [step.motion for step in told] == ["walking"] * 5 + ["stairs"] * 6 + ["walking"] * 3
    assert [np.sign(step.displacement_m[2]) for step in told[5:11]] == [1, 1, 1, -1, -1, -1]


def test_a_ladder_is_climbed_as_stairs_are() -> None:
    rungs = [Stride((0.0, 0.0, up), lift_m=0.02, heel_rad=0.2, swing_s=0.8) for up in (0.3, 0.3, -0.3)]
    assert [step.motion for step in strides(striding(rungs))] == ["stairs"] * 3


def test_running_is_told_by_its_flight_and_its_impact_or_by_speed() -> None:
    jog = Stride((1.1, 0.0, 0.0), lift_m=0.16, heel_rad=1.1, swing_s=0.46, stance_s=0.09)
    sprint = Stride((2.2, 0.0, 0.0), lift_m=0.2, heel_rad=1.1, swing_s=0.6, stance_s=0.14)
    told = strides(striding([*WALK, *[jog] * 4, *[sprint] * 3]))
    assert [step.motion for step in told[:5]] == ["walking"] * 5
    assert [step.motion for step in told[5:-1]] == ["running"] * 6  # the last one stops


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_who_gets_down_and_crawls_is_told_and_so_is_getting_up(seed: int) -> None:
    """Toes on the ground, heel up, whichever way the sensor is mounted."""
    down = Stride((0.2, 0.0, 0.0), lift_m=0.05, heel_rad=0.0, lean_rad=1.7, swing_s=1.0)
    drag = Stride((0.45, 0.1, 0.0), lift_m=0.03, heel_rad=0.1, lean_rad=1.7, swing_s=0.6)
    mounting = Rotation.random(rng=np.random.default_rng(seed))
    told = strides(striding([*WALK, down, *[drag] * 5, *WALK]), mounting)
    assert [step.motion for step in told[6:11]] == ["crawling"] * 5
    assert [step.motion for step in (*told[:5], *told[-4:])] == ["walking"] * 9


def test_who_crawls_from_the_start_is_told_by_how_the_foot_comes_to_rest() -> None:
    leans = [0.25, -0.1, 0.3, 0.0, 0.25, -0.05, 0.3]
    drag = [Stride((0.45, 0.0, 0.0), lift_m=0.03, heel_rad=0.1, lean_rad=lean) for lean in leans]
    assert [step.motion for step in strides(striding(drag))][-4:] == ["crawling"] * 4
    shuffle = [dataclasses.replace(stride, lean_rad=0.0) for stride in drag]
    assert {step.motion for step in strides(striding(shuffle))} == {"walking"}


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_direction_is_against_the_toes_however_the_sensor_is_mounted(seed: int) -> None:
    aside, back = Stride((0.0, 0.5, 0.0), heel_rad=0.4), Stride((-0.9, 0.0, 0.0), heel_rad=0.8)
    right = Stride((0.0, -0.5, 0.0), heel_rad=0.4)
    mounting = Rotation.random(rng=np.random.default_rng(seed))
    told = strides(striding([*WALK, aside, aside, back, back, right, Stride()]), mounting)
    expected = ["forward"] * 4 + ["left"] * 2 + ["backward"] * 2 + ["right", "forward"]
    assert [step.direction for step in told[1:]] == expected


def test_who_has_only_gone_backward_goes_backward() -> None:
    """The heel rises higher than the toes whichever way a foot goes: no majority is needed."""
    told = strides(striding([Stride((-1.0, 0.0, 0.0))] * 4))
    assert [step.direction for step in told[1:]] == ["backward"] * 3


def test_direction_is_unknown_while_the_foot_has_hardly_tilted() -> None:
    told = strides(striding([Stride((0.5, 0.0, 0.0), lift_m=0.05, heel_rad=0.3)] * 4))
    assert {step.direction for step in told} == {None}


def row_of(motion: MotionClass, nis: float, way_m: tuple[float, float, float]) -> np.ndarray:
    row = np.zeros(1, STEP)
    row["motion"], row["nis"], row["displacement_m"][0] = MOTIONS.index(motion), nis, way_m
    row["time_ns"], row["doubt"] = 2_000_000_000, 0.25
    row["covariance"][0] = np.diag([0.02, 0.03, 0.02, 0.005]) ** 2
    row["covariance"][0, 0, 1] = row["covariance"][0, 1, 0] = 1e-4
    return row


def test_the_covariance_holds_what_steps_share() -> None:
    """Taken out again, what is left is the filter's own, as it was correlated, times a factor."""
    way_m = (1.0, 0.5, 0.3)
    before, row = row_of("walking", 3.0, way_m)["covariance"][0], row_of("walking", 3.0, way_m)
    widen(row[0])
    scale, slope, turn = (
        float(row[name][0]) for name in ("common_scale", "common_slope", "common_turn_rad_s")
    )
    shared = np.zeros((4, 4))
    shared[:3, :3] = scale**2 * np.outer(way_m, way_m)
    shared[2, 2] += slope**2 * (1.0 + 0.25)
    shared[3, 3] = (2.0 * turn) ** 2
    own = row["covariance"][0] - shared
    assert own[0, 1] / np.sqrt(own[0, 0] * own[1, 1]) == pytest.approx(1e-4 / 6e-4)
    assert own[0, 0] / before[0, 0] == pytest.approx(own[3, 3] / before[3, 3])
    assert np.linalg.eigvalsh(own).min() > 0.0


def test_a_landing_that_surprises_widens_the_step_and_lowers_its_quality() -> None:
    """Student's t with ν = 1: variances grow as 1 + NIS; 3 is what a Gaussian innovation has on average."""
    calm, hard = (row_of("walking", nis, (0.0, 0.0, 0.0)) for nis in (3.0, 15.0))
    widen(calm[0])
    widen(hard[0])
    np.testing.assert_allclose(hard["covariance"][0, 0, 0], 4.0 * calm["covariance"][0, 0, 0])
    assert calm["quality_pct"][0] == pytest.approx(75.0)
    assert hard["quality_pct"][0] == pytest.approx(75.0 / 4.0)


def test_crawling_is_doubted_more_than_walking() -> None:
    deviations = []
    for motion in ("walking", "running", "crawling"):
        row = row_of(motion, 1.0, (1.0, 0.0, 0.0))
        widen(row[0])
        deviations.append(float(row["covariance"][0, 0, 0]))
    assert deviations == sorted(deviations)
    assert deviations[2] > 2.0 * deviations[0]


def test_all_that_is_told_is_the_same_in_batches_of_any_size() -> None:
    stream = striding([*WALK, Stride((0.0, 0.5, 0.0), heel_rad=0.4), Stride((0.56, 0.0, 0.34))])
    whole = navigate(stream).steps
    cut = navigate(stream, list(range(7, len(stream.time_ns), 7))).steps
    for one, other in zip(whole, cut, strict=True):
        for field in dataclasses.fields(FootStepEstimate):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), field.name)
