"""A camera with its inertial unit: it knows up, is not moved by a crowd, and bridges a moment of darkness."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion
from proving_ground.motion import Motion
from proving_ground.sensors import Figure, Mounting, imu_class, measure_imu
from sensor_gateway.stereo import InertialOdometry, Sample, StereoOdometry, Verdict
from sensor_gateway.stereo.inertial_filter import BIAS_A, BIAS_G, THETA, InertialFilter, P, UnitQuality, V
from support.camera_rooms import Swaying, room
from support.moving import Straight
from support.stereo_walks import SMALL, Sequence, calibration, nees, render
from support.striding_view import Jostle

WALK = Swaying(Straight((-3.5, -1.0, 1.5), (1.2, 0.1, 0.0)), 0.1)
GRAVITY = np.array([0.0, 0.0, 9.80665])


def told(sequence: Sequence, motion: Motion) -> list[CameraMotion | Verdict]:
    """Images and what an industrial unit beside the camera measures, in order of time."""
    seconds = len(sequence.pairs) / SMALL.rate_hz
    imu = measure_imu(motion, seconds, Mounting(), imu_class("industrial"), None, np.random.default_rng(3))
    odometry = InertialOdometry(StereoOdometry(calibration()))
    out, row = [], 0
    for number, pair in enumerate(sequence.pairs):
        time_s = number / SMALL.rate_hz
        while row < len(imu.time_s) and imu.time_s[row] <= time_s:
            sample = Sample(round(imu.time_s[row] * 1e9), imu.accel_m_s2[row], imu.gyro_rad_s[row])
            odometry.feed_sample(sample)
            row += 1
        out.append(odometry.feed(round(time_s * 1e9), *pair))
    return out


def motions(said: list[CameraMotion | Verdict]) -> list[CameraMotion]:
    return [one for one in said if isinstance(one, CameraMotion)]


@pytest.fixture(scope="module")
def walk() -> Sequence:
    """Four seconds through a room."""
    return render(room(), WALK, 4.0)


def test_the_motions_know_where_up_is(walk: Sequence) -> None:
    """Up in the true body's axes at each motion's start, within a degree once it has walked for three seconds."""
    levelled = [motion for motion in motions(told(walk, WALK)) if motion.up is not None]
    assert len(levelled) > 25
    for motion in levelled[-5:]:
        start = round(motion.start_time_ns / 1e8)
        up = walk.attitude[start].inv().apply([0.0, 0.0, 1.0])
        assert np.degrees(np.arccos(np.clip(up @ np.array(motion.up), -1.0, 1.0))) < 1.0


def test_a_moment_of_darkness_is_bridged_and_a_longer_one_is_not(walk: Sequence) -> None:
    black = np.zeros_like(walk.pairs[0][0])
    pairs = [(black, black) if 28 <= number < 38 else pair for number, pair in enumerate(walk.pairs)]
    dark = Sequence(tuple(pairs), walk.place_m, walk.attitude)
    said = told(dark, WALK)
    bridged = [one for one in said[28:32] if isinstance(one, CameraMotion)]
    assert len(bridged) == 4
    assert all(motion.confidence_pct == 10.0 for motion in bridged)
    errors = [dark.error(motion, SMALL.rate_hz) for motion in bridged]
    assert max(np.linalg.norm(error[:3]) for error in errors) < 0.15
    assert np.mean([nees(motion, error) for motion, error in zip(bridged, errors, strict=True)]) < 18.0
    assert all(isinstance(one, Verdict) for one in said[34:38])


def test_who_stands_still_in_a_crowd_is_not_carried_along() -> None:
    """People who fill most of the view and sway alike: without the unit the camera believed them."""
    crowd = tuple(Figure(Jostle(beside, beside), radius_m=0.3) for beside in (-0.9, -0.3, 0.3, 0.9))
    standing = Straight((-3.5, 0.0, 1.5))
    said = told(render(room(figures=crowd), standing, 2.0), standing)
    assert all(np.linalg.norm(motion.translation_m) < 0.1 for motion in motions(said)[3:])
    assert any(isinstance(one, Verdict) and one.condition == "crowd" for one in said)


def test_samples_that_are_not_finite_are_left_out() -> None:
    odometry = InertialOdometry(StereoOdometry(calibration()))
    for number in range(60):
        odometry.feed_sample(Sample(number, np.full(3, np.nan), np.zeros(3)))
    grey = np.zeros((192, 256), dtype=np.uint8)
    assert isinstance(odometry.feed(100, grey, grey), Verdict)


vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


@given(vectors, vectors, vectors)
@settings(max_examples=40)
def test_the_transition_follows_finite_differences(
    tilt: np.ndarray, force: np.ndarray, rate: np.ndarray
) -> None:
    """Errors put into the state before a step come out as the covariance's transition says."""
    step_s, size = 0.01, 1e-5
    quality = UnitQuality(0.0, 0.0, 0.0, 0.0)

    def made(error: np.ndarray) -> InertialFilter:
        one = InertialFilter(GRAVITY, quality)
        one.attitude = Rotation.from_rotvec(error[THETA]) * Rotation.from_rotvec(tilt)
        one.position, one.velocity = error[P].copy(), error[V].copy()
        one.bias_a, one.bias_g = error[BIAS_A].copy(), error[BIAS_G].copy()
        one.covariance = np.zeros((15, 15))
        one.predict(step_s, force + GRAVITY, rate)
        return one

    middle = made(np.zeros(15))
    for index in range(15):
        error = size * np.eye(15)[index]
        moved = made(error)
        found = np.concatenate(
            [
                moved.position - middle.position,
                moved.velocity - middle.velocity,
                (moved.attitude * middle.attitude.inv()).as_rotvec(),
                error[BIAS_A],
                error[BIAS_G],
            ]
        )
        start = InertialFilter(GRAVITY, quality)
        start.attitude = Rotation.from_rotvec(tilt)
        start.covariance = np.outer(error, error)
        start.predict(step_s, force + GRAVITY, rate)
        assert start.covariance == pytest.approx(np.outer(found, found), abs=2e-3 * size**2)
