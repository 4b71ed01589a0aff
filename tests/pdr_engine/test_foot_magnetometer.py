"""The magnetometer at stand-still: better in a clean field, never worse in a disturbed one, and honest azimuths."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bootprint.bus import Envelope
from bootprint.config import convert
from bootprint.errors import ConfigError
from bootprint.messages import FootStep, ImuBatch
from bootprint.topics import Identity
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.foot import FootNavigator, FootSettings, FootStepEstimate, magnetic
from pdr_engine.foot.memory import AID_STATES, fresh_state
from pdr_engine.foot.parameters import parameters
from pdr_engine.foot.settings import UNCALIBRATED, MagnetometerCalibration
from proving_ground.evaluation.evaluate import evaluate_task, plan
from proving_ground.evaluation.foot.long_walks import (
    EARTH,
    MOUNTING,
    PLACE,
    SURROUNDINGS,
    WITHOUT,
    MagneticWalk,
    compared,
    magnetic_walk,
)
from proving_ground.sensors.magnetics import DeviceIron
from sensor_gateway.recordings import load_runs
from support.foot_streams import START_NS, Stream, navigate, still, walk
from support.recorded import recorded_data

ME = Identity("bp", "alpha", "a1")
FLOOR = SURROUNDINGS[-1]
CALIBRATED = MagnetometerCalibration(offset_ut=(1e-9, 0.0, 0.0))
IRON = DeviceIron(
    np.array([30.0, -20.0, 15.0]), np.array([[1.1, 0.05, 0.0], [0.05, 0.9, 0.0], [0.0, 0.0, 1.0]])
)


@pytest.fixture(scope="module")
def clean() -> MagneticWalk:
    return magnetic_walk(400.0, seed=11)


def outputs(
    walked: MagneticWalk,
    cuts: tuple[int, ...] = (),
    mag: np.ndarray | None = None,
    foot: FootSettings | None = None,
    calibration: MagnetometerCalibration = UNCALIBRATED,
    know_earth: bool = False,
) -> tuple[np.ndarray, list[FootStepEstimate], dict[str, int]]:
    """Rows, steps and counters of a walk whose samples are cut at these indexes."""
    navigator = FootNavigator(foot, calibration)
    if know_earth:
        navigator.know_earth_field(EARTH)
    imu = walked.imu
    mag = imu.mag_ut if mag is None else mag
    assert mag is not None
    time_ns = START_NS + np.round(imu.time_s * 1e9).astype(np.int64)
    made = [
        navigator.process(time_ns[a:b], imu.accel_m_s2[a:b], imu.gyro_rad_s[a:b], mag[a:b])
        for a, b in itertools.pairwise([0, *sorted(cuts), len(time_ns)])
    ]
    made.append(navigator.finish())
    rows = np.concatenate([part.rows for part in made])
    return rows, [step for part in made for step in part.steps], navigator.counters()


def final_heading_error_deg(walked: MagneticWalk, rows: np.ndarray) -> float:
    """The yaw's error at the end of the walk, from the walk's start."""
    change = rows["yaw_rad"][-1] - rows["yaw_rad"][0] - (walked.yaw_rad[-1] - walked.yaw_rad[0])
    return abs(math.degrees(math.remainder(change, 2.0 * math.pi)))


def test_a_clean_field_holds_the_heading_of_long_walks() -> None:
    found = [
        compared(magnetic_walk(700.0, seed, bias_instability_deg_per_h=60.0)) for seed in (201, 202, 203)
    ]
    errors = np.array([one.rmse_m for one in found])
    drifts = np.abs([one.drift_deg_per_min for one in found])
    assert (errors[:, 1] < errors[:, 0]).all()
    assert errors[:, 1].mean() < 0.5 * errors[:, 0].mean()
    assert drifts[:, 1].mean() < 0.3 * drifts[:, 0].mean()


@pytest.mark.parametrize("seed", [211, 212])
def test_above_the_steel_of_a_floor_nothing_changes(seed: int) -> None:
    walked = magnetic_walk(150.0, seed, surroundings=FLOOR)
    with_it, _, counters = outputs(walked)
    without, _, _ = outputs(walked, foot=WITHOUT.settings())
    assert counters["fields_used"] == 0
    assert counters["fields_refused"] > 80
    assert np.array_equal(with_it, without)


@pytest.mark.recorded
@pytest.mark.parametrize("number", [31, 33, 35, 39])
def test_recorded_disturbed_walks_are_not_worse_with_it(number: int) -> None:
    (task,) = plan(
        load_runs([recorded_data() / f"foot-gcp/SensorConnectData_{number}_LLIO.mat"]), "foot", ["learned"]
    )
    imu = task.run.imus["right_foot"]
    assert imu.mag_ut is not None
    blind = replace(task, run=replace(task.run, imus={"right_foot": replace(imu, mag_ut=None)}))
    with_it, without = (evaluate_task(one, "best-fit").row["rmse_m"] for one in (task, blind))
    assert with_it == without


def test_a_magnetometer_that_hangs_is_not_believed() -> None:
    """Its field would turn with the foot: believed, it cost this walk 13°."""
    walked = magnetic_walk(300.0, seed=22)
    assert walked.imu.mag_ut is not None
    frozen = np.tile(walked.imu.mag_ut[:1], (len(walked.imu.time_s), 1))
    rows, _, counters = outputs(walked, mag=frozen, calibration=CALIBRATED)
    assert counters["fields_used"] == 0
    assert np.array_equal(rows, outputs(walked, foot=WITHOUT.settings())[0])


@settings(max_examples=5, deadline=None)
@given(st.lists(st.integers(0, 50_000), max_size=20))
def test_the_cut_into_batches_changes_nothing(cuts: list[int]) -> None:
    walked = WALKED
    count = len(walked.imu.time_s)
    whole, cut = outputs(walked), outputs(walked, tuple(min(place, count) for place in cuts))
    assert whole[2]["fields_used"] > 50
    assert np.array_equal(whole[0], cut[0])
    assert repr(whole[1]) == repr(cut[1])


WALKED = magnetic_walk(150.0, seed=12)


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, 1e300, -3e4])
def test_a_broken_magnetometer_is_as_none(value: float) -> None:
    broken = np.full((len(WALKED.imu.time_s), 3), value)
    assert np.array_equal(outputs(WALKED, mag=broken)[0], outputs(WALKED, foot=WITHOUT.settings())[0])


def test_iron_that_is_calibrated_away_does_no_harm() -> None:
    walked = magnetic_walk(400.0, seed=11, device=IRON)
    matrix = np.linalg.inv(IRON.soft)
    calibration = convert(
        {"offset_ut": IRON.hard_ut.tolist(), "matrix": matrix.tolist()},
        MagnetometerCalibration,
        where="test",
    )
    rows, steps, counters = outputs(walked, calibration=calibration, know_earth=True)
    assert counters["fields_used"] > 200
    assert final_heading_error_deg(walked, rows) < 2.0
    assert sum(step.magnetic_azimuth_rad is not None for step in steps) > 200
    uncalibrated = outputs(walked, know_earth=True)[1]
    assert all(step.magnetic_azimuth_rad is None for step in uncalibrated[:20])


def true_azimuth_rad(walked: MagneticWalk, step: FootStepEstimate) -> float:
    """Azimuth of the sensor's x axis, which is the navigator's forward axis as this unit is mounted."""
    at = np.searchsorted(walked.imu.time_s, (step.time_ns - START_NS) * 1e-9) - 1
    east, north, _ = Rotation.from_euler("z", walked.yaw_rad[at]).apply(MOUNTING.apply([1.0, 0.0, 0.0]))
    return math.atan2(east, north)


def test_azimuths_are_of_the_forward_axis_from_true_north(clean: MagneticWalk) -> None:
    _, steps, _ = outputs(clean, calibration=CALIBRATED, know_earth=True)
    told = [step for step in steps if step.magnetic_azimuth_rad is not None]
    assert len(told) > 0.9 * len(steps)
    errors = [
        math.remainder(
            step.magnetic_azimuth_rad + EARTH.declination_rad - true_azimuth_rad(clean, step), 2 * math.pi
        )
        for step in told
        if step.magnetic_azimuth_rad is not None
    ]
    assert np.abs(errors).max() < math.radians(1.0)
    sigmas = [step.magnetic_azimuth_sigma_rad or 0.0 for step in told]
    assert (
        math.radians(2.0) < sigmas[-1] < sigmas[0] < 0.3
    )  # surer with every place, never surer than the floor


def test_azimuths_above_the_steel_of_a_floor_are_rare_and_cover_their_error() -> None:
    walked = magnetic_walk(300.0, seed=31, surroundings=FLOOR)
    _, steps, _ = outputs(walked, calibration=CALIBRATED, know_earth=True)
    told = [step for step in steps if step.magnetic_azimuth_rad is not None]
    assert len(told) < 0.4 * len(steps)
    for step in told:
        assert step.magnetic_azimuth_rad is not None
        assert step.magnetic_azimuth_sigma_rad is not None
        error = math.remainder(
            step.magnetic_azimuth_rad + EARTH.declination_rad - true_azimuth_rad(walked, step), 2 * math.pi
        )
        assert abs(error) < 3.0 * step.magnetic_azimuth_sigma_rad


def test_where_the_earth_s_field_is_unknown_no_azimuth_is_told(clean: MagneticWalk) -> None:
    assert all(step.magnetic_azimuth_rad is None for step in outputs(clean, calibration=CALIBRATED)[1])


def test_the_core_adds_the_declination_of_the_realm(clean: MagneticWalk) -> None:
    config = convert(
        {"places": ["left_foot"], "foot": {"magnetometer": {"left_foot": {"offset_ut": [1e-9, 0.0, 0.0]}}}},
        PdrConfig,
        where="test",
    )
    core = EngineCore(config, ME, PLACE)
    imu, cut = clean.imu, slice(0, 2000)
    assert imu.mag_ut is not None
    time_ns = START_NS + np.round(imu.time_s[cut] * 1e9).astype(np.int64)
    batch = ImuBatch.from_arrays(0, time_ns, imu.accel_m_s2[cut], imu.gyro_rad_s[cut], imu.mag_ut[cut])
    steps = [one.message for one in core.handle(Envelope(ME.address("imu", "left_foot"), batch))]
    step = next(message for message in steps if isinstance(message, FootStep))
    assert step.magnetic_azimuth_rad is not None
    assert 0.0 <= step.magnetic_azimuth_rad < 2.0 * math.pi
    east, north, _ = Rotation.from_euler("z", clean.yaw_rad[0]).apply(MOUNTING.apply([1.0, 0.0, 0.0]))
    error = math.remainder(step.magnetic_azimuth_rad - math.atan2(east, north), 2.0 * math.pi)
    assert abs(error) < math.radians(1.0)
    assert abs(EARTH.declination_rad) > math.radians(2.0)  # or its sign would not show


def test_a_wrong_calibration_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match="offset"):
        convert(
            {"foot": {"magnetometer": {"left_foot": {"offset": [1.0, 2.0, 3.0]}}}}, PdrConfig, where="[pdr]"
        )


def outer_filter(seed: int) -> tuple[np.void, np.void]:
    """A state with random knowledge and field, and parameters."""
    rng = np.random.default_rng(seed)
    state, foot = fresh_state(FootSettings())[0], parameters(FootSettings())[0]
    root = rng.normal(size=(AID_STATES, AID_STATES))
    state["aid_P"] = root @ root.T
    state["aid_x"] = rng.normal(size=AID_STATES) + np.array([0.0, 0.0, 20.0, -15.0, 0.0, 0.0])
    state["aid_x"][0] *= 0.05
    state["field"] = rng.normal(size=3) * 20.0
    state["yaw"] = rng.uniform(-3.0, 3.0)
    return state, foot


@pytest.mark.parametrize("seed", range(4))
def test_the_innovation_s_jacobian_is_its_derivative(seed: int) -> None:
    state, _ = outer_filter(seed)
    ex, ey = math.cos(seed), math.sin(seed)
    magnetic._innovation(state, ex, ey)
    jacobian, here = state["aid_h"].copy(), state["aid_x"].copy()
    step = 1e-5
    for index in range(AID_STATES):
        ends = []
        for sign in (-1.0, 1.0):
            state["aid_x"] = here
            state["aid_x"][index] += sign * step
            ends.append(magnetic._innovation(state, ex, ey))
        # Linear in each state but for ψ·m, whose Jacobian is taken at ψ = 0, where the filter always is.
        slack = 0.0 if index < 2 else abs(here[0]) * 1.01
        assert -(ends[1] - ends[0]) / (2 * step) == pytest.approx(jacobian[index], abs=slack + 1e-6)


def test_a_scalar_update_is_kalman_s() -> None:
    state, _ = outer_filter(7)
    state["aid_h"] = np.random.default_rng(9).normal(size=AID_STATES)
    h, P, x = state["aid_h"].copy(), state["aid_P"].copy(), state["aid_x"].copy()
    gain = P @ h / (h @ P @ h + 4.0)
    rest = np.eye(AID_STATES) - np.outer(gain, h)
    magnetic._scalar_update(state, 2.5, 4.0)
    np.testing.assert_allclose(state["aid_x"], x + gain * 2.5, atol=1e-12)
    np.testing.assert_allclose(state["aid_P"], rest @ P @ rest.T + 4.0 * np.outer(gain, gain), atol=1e-12)


def beside_the_reference(across_ut: float) -> tuple[np.void, np.void]:
    """A field held to be (20, 0) µT within 1 µT of disturbance, and a stance that is this much beside it."""
    state, foot = fresh_state(FootSettings())[0], parameters(FootSettings())[0]
    state["aid_P"] = 1e-6 * np.eye(AID_STATES)
    state["aid_x"][2] = 20.0
    state["field"] = [20.0, across_ut, -40.0]
    state["position"] = [1.0, 0.0, 0.0]
    state["disturbance"], state["disturbance_sum"], state["fresh"] = 1.0, 2.0, 0.5
    return state, foot


def test_what_is_refused_counts_as_disturbance() -> None:
    """A field that turns with the foot keeps its strength: only its direction tells that it is disturbed."""
    state, foot = beside_the_reference(15.0)
    before = state["aid_x"].copy()
    magnetic._update(state, foot)
    assert state["disturbance_sum"] == pytest.approx(2.0 + 0.5 * 15.0**2)
    assert (state["fields_refused"], state["fields_used"]) == (1, 0)
    assert np.array_equal(state["aid_x"], before)


def test_what_is_used_does_not_count_as_disturbance() -> None:
    state, foot = beside_the_reference(2.0)
    magnetic._update(state, foot)
    assert state["disturbance_sum"] == 2.0
    assert (state["fields_refused"], state["fields_used"]) == (0, 1)
    assert state["aid_x"][0] > 0.0


@pytest.mark.parametrize("stop_s", [3.0, 60.0])
def test_a_real_stop_does_not_turn_the_foot(stop_s: float) -> None:
    """The bias moves by 3°/min before the stop; what it turned until the stop had taught it is taken back."""
    walking, standing = walk(8), still(stop_s, seed=55)
    stream = Stream.joined(walking, standing)
    stream.gyro[len(walking.time_ns) - 200 :] += np.radians(3.0 / 60.0)
    track = navigate(stream)
    begin = np.searchsorted(track.time_ns, stream.time_ns[len(walking.time_ns) - 200])
    assert abs(math.degrees(track.yaw_rad[-1] - track.yaw_rad[begin])) < 0.02
