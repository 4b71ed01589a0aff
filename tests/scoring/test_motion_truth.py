"""Labels from truth alone: what a foot's path shows of how it was moved, without any inertial sensor."""

import itertools

import numpy as np
import pytest

from pdr_engine.foot import FootStepEstimate
from proving_ground.evaluation.foot.motion_truth import CRAWLED, labelled
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Truth
from support.foot_streams import Stream, navigate
from support.recorded import recorded_data

INTERVAL_S = 0.005


def captured(strides: list[tuple[float, float, float, float]]) -> tuple[Truth, list[FootStepEstimate]]:
    """A path of strides (length m, climb m, swing s, stance s), and steps that end with its stances."""
    time_s = np.arange(0.0, 1.0 + sum(swing + stance for *_, swing, stance in strides), INTERVAL_S)
    position, ends, begin_s = np.zeros((len(time_s), 3)), [0.5], 0.5
    for length, climb, swing, stance in strides:
        u = np.clip((time_s - begin_s) / swing, 0.0, 1.0)
        smooth = 3 * u**2 - 2 * u**3
        position += np.outer(smooth, [length, 0.0, climb])
        position[:, 2] += 0.1 * np.sin(np.pi * u) ** 2
        begin_s += swing + stance
        ends.append(begin_s)
    return Truth(time_s, position), [step(a, b, 0.3) for a, b in itertools.pairwise(ends)]


def step(start_s: float, end_s: float, stance_s: float) -> FootStepEstimate:
    return FootStepEstimate(
        start_time_ns=round(start_s * 1e9),
        time_ns=round(end_s * 1e9),
        displacement_m=np.zeros(3),
        heading_change_rad=0.0,
        covariance=np.eye(4),
        motion="unknown",
        direction=None,
        clearance_m=0.0,
        swing_s=0.5,
        stance_s=stance_s,
        stance_quality=50.0,
        landing_nis=0.0,
        quality_pct=50.0,
        common_scale_sigma=0.0,
        common_slope_sigma=0.0,
        common_turn_sigma_rad_s=0.0,
        realigned=False,
    )


def test_labels_by_motion_capture() -> None:
    walk, run, stair = (1.3, 0.0, 0.6, 0.5), (1.5, 0.0, 0.6, 0.15), (0.6, 0.3, 0.6, 0.5)
    shift = (0.05, 0.0, 0.3, 0.5)
    truth, steps = captured([walk, walk, run, run, run, walk, stair, shift, walk])
    true = [label for label, _ in labelled("a walk", truth, steps)]
    assert true == ["walking", "walking", "running", "running", "running", "walking", "stairs", "walking"]


def test_every_stride_of_a_crawled_trial_is_crawled() -> None:
    truth, steps = captured([(0.4, 0.0, 0.5, 0.5)] * 3)
    assert labelled(CRAWLED[0], truth, steps) == [("crawling", "unknown")] * 3


def test_labels_by_survey_leave_open_what_may_be_either() -> None:
    truth = Truth(
        np.array([1.0, 2.0, 3.0, 4.0]), np.array([[0.0, 0, 0], [1.2, 0, 0], [3.2, 0, 0], [5.9, 0, 0]])
    )
    steps = [step(1.05, 2.05, 0.3), step(2.05, 3.05, 0.1), step(3.05, 4.05, 0.1), step(4.05, 5.05, 0.1)]
    assert [label for label, _ in labelled("surveyed", truth, steps)] == ["walking", "running"]


@pytest.mark.recorded
@pytest.mark.parametrize(
    ("name", "least_pct"),
    [
        ("pyshoe-vicon/2017-11-22-11-28-39.mat", 97),  # shuffling
        ("pyshoe-vicon/2018-02-09-11-29-43.mat", 97),  # side steps
        ("pyshoe-vicon/2017-11-27-11-22-22.mat", 95),  # running
        ("pyshoe-vicon/2018-02-09-11-16-53.mat", 85),  # the ladder
        ("pyshoe-vicon/2018-02-22-10-08-52.mat", 90),  # crawling
        ("pyshoe-vicon/2018-02-22-10-10-29.mat", 65),  # crawling, 7 of 10 strides
        ("foot-gcp/SensorConnectData_43_LLIO.mat", 95),  # walking and running
    ],
)
def test_recorded_strides_are_told_as_what_they_were(name: str, least_pct: float) -> None:
    (run,) = load_runs([recorded_data() / name])
    ((place, imu),) = run.imus.items()
    stream = Stream(np.round(imu.time_s * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s)
    labels = labelled(run.name, run.truth[place], navigate(stream).steps)
    assert len(labels) >= 10
    assert 100.0 * np.mean([true == told for true, told in labels]) >= least_pct


@pytest.mark.recorded
@pytest.mark.parametrize(("way", "sign"), [("up", 1.0), ("down", -1.0)])
def test_flights_of_stairs_are_told_and_which_way(way: str, sign: float) -> None:
    """Two flights: at least six strides on each of them, and level ones before, between and behind."""
    (run,) = load_runs([recorded_data() / f"gaitmap-example/imu_sample_healthy_stair_{way}.csv"])
    for imu in run.imus.values():
        stream = Stream(np.round(imu.time_s * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s)
        strides = [step for step in navigate(stream).steps if step.length_m > 0.15]
        stairs = [step for step in strides if step.motion == "stairs"]
        assert len(stairs) >= 12
        assert all(sign * step.displacement_m[2] > 0.0 for step in stairs)
        assert [step.motion for step in (strides[0], strides[-1])] == ["walking", "walking"]


@pytest.mark.recorded
@pytest.mark.parametrize(
    "name",
    [
        "pyshoe-vicon/2017-11-22-11-22-03.mat",
        "pyshoe-vicon/2017-11-22-11-35-59.mat",
        "foot-gcp/SensorConnectData_37_LLIO.mat",
    ],
)
def test_who_walks_ahead_goes_forward_also_round_corners(name: str) -> None:
    """Nobody steps aside in these; the first two turn with every stride."""
    (run,) = load_runs([recorded_data() / name])
    ((_, imu),) = run.imus.items()
    stream = Stream(np.round(imu.time_s * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s)
    told = [step.direction for step in navigate(stream).steps if step.length_m > 0.15]
    assert set(told) <= {"forward", None}
    assert told.count("forward") > 0.85 * len(told)
