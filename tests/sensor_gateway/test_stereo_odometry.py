"""Stereo odometry on rendered pairs: right to a per cent, honest about itself, and silent where nothing is seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion
from proving_ground.sensors import Figure, LightZone
from sensor_gateway.stereo import StereoCalibration, StereoOdometry, Verdict
from sensor_gateway.stereo.images import Image, as_grey, evened
from sensor_gateway.stereo.motion import Landmarks, Pose, solve
from support.camera_rooms import EVERYWHERE, Swaying, room
from support.moving import Straight
from support.stereo_walks import SMALL, Sequence, calibration, nees, render, told
from support.striding_view import Jostle

WALK = Swaying(Straight((-3.5, -1.0, 1.5), (1.2, 0.1, 0.0)), 0.1)
CALIBRATION = StereoCalibration(160.0, 165.0, 127.5, 95.5, 129.0, 0.12)


@pytest.fixture(scope="module")
def walk() -> Sequence:
    """Four seconds through a room: 5 m."""
    return render(room(), WALK, 4.0)


def motions(said: list[CameraMotion | Verdict]) -> list[CameraMotion]:
    return [one for one in said if isinstance(one, CameraMotion)]


def track_end(said: list[CameraMotion | Verdict]) -> np.ndarray:
    """Where the chain of motions leads, in the first one's body axes."""
    place, attitude, last = np.zeros(3), Rotation.identity(), None
    for motion in motions(said):
        if last is not None and motion.start_time_ns != last.start_time_ns:
            assert motion.start_time_ns == last.time_ns
            place = place + attitude.apply(last.translation_m)
            attitude = attitude * Rotation.from_rotvec(last.rotation_rad)
        last = motion
    assert last is not None
    return np.asarray(place + attitude.apply(last.translation_m))


def end_error_share(sequence: Sequence, said: list[CameraMotion | Verdict]) -> float:
    truth = sequence.attitude[0].inv().apply(sequence.place_m[-1] - sequence.place_m[0])
    travelled = np.linalg.norm(np.diff(sequence.place_m, axis=0), axis=1).sum()
    return float(np.linalg.norm(track_end(said) - truth) / travelled)


def test_a_walk_is_right_to_a_per_cent(walk: Sequence) -> None:
    said = told(walk)
    assert isinstance(said[0], Verdict)
    assert said[0].condition == "starting"
    assert len(motions(said)) == len(walk.pairs) - 1
    assert end_error_share(walk, said) < 0.01


def test_landmarks_told_once_a_start_lie_on_walls_floor_or_ceiling(walk: Sequence) -> None:
    said = motions(told(walk))
    starts = [motion.start_time_ns for motion in said if motion.landmarks_m is not None]
    assert starts == list(dict.fromkeys(motion.start_time_ns for motion in said))
    off = []
    for motion in said:
        start = round(motion.start_time_ns * SMALL.rate_hz / 1e9)
        points = (
            walk.attitude[start].apply(np.array(motion.landmarks_m or ()).reshape(-1, 3))
            + walk.place_m[start]
        )
        x, y, z = np.abs(points).T
        off.append(np.min([np.abs(x - 5.0), np.abs(y - 4.0), z, np.abs(z - 2.8)], axis=0))
    assert np.concatenate(off).size > 20
    assert np.percentile(np.concatenate(off), 90) < 0.3


def test_exposure_that_differs_between_eyes_and_images_changes_little(walk: Sequence) -> None:
    def exposed(image: Image, gain: float, offset: float) -> Image:
        return np.asarray(np.clip(gain * image + offset, 0.0, 255.0), dtype=np.uint8)

    rng = np.random.default_rng(3)
    pairs = tuple(
        (exposed(left, gain, 10.0), exposed(right, 0.9 * gain, 0.0))
        for (left, right), gain in zip(walk.pairs, rng.uniform(0.6, 1.2, len(walk.pairs)), strict=True)
    )
    other = Sequence(pairs, walk.place_m, walk.attitude)
    assert end_error_share(other, told(other)) < 0.015


def test_leaps_of_half_a_metre_a_pair_are_followed() -> None:
    leaps = render(room(2.0), Straight((-8.0, 0.0, 1.5), (5.0, 0.0, 0.0)), 2.5)
    assert end_error_share(leaps, told(leaps)) < 0.015


def test_the_covariance_is_honest(walk: Sequence) -> None:
    """NEES of six numbers is 6 when honest; correlated motions make its mean over one walk scatter widely."""
    values = [nees(motion, walk.error(motion, SMALL.rate_hz)) for motion in motions(told(walk))]
    assert 1.0 < np.mean(values) < 10.0


def test_the_same_pairs_give_the_same_motions(walk: Sequence) -> None:
    short = Sequence(walk.pairs[:8], walk.place_m, walk.attitude)
    assert told(short) == told(short)


@pytest.mark.parametrize(
    ("zone", "condition"),
    [
        (LightZone("dark", EVERYWHERE, 0.995, start_s=0.95), "dark"),
        (LightZone("smoke", EVERYWHERE, 3.0, start_s=0.95), "smoke"),
    ],
)
def test_darkness_and_smoke_are_named_and_nothing_is_told(zone: LightZone, condition: str) -> None:
    said = told(render(room(zones=(zone,)), WALK, 1.5))
    assert all(isinstance(one, CameraMotion) for one in said[1:10])
    assert {one.condition if isinstance(one, Verdict) else "motion" for one in said[10:]} == {condition}


def test_a_wall_at_arms_length_is_named() -> None:
    said = told(render(room(), Straight((4.84, 0.0, 1.5), (0.0, 0.3, 0.0)), 0.5))
    conditions = [one.condition for one in said if isinstance(one, Verdict)]
    assert conditions.count("close_wall") >= 3
    assert not motions(said)


def test_a_crowd_is_named_or_misleads_nobody() -> None:
    """Standing still before people who jostle and hide two thirds of the view."""
    crowd = tuple(Figure(Jostle(beside, 9.0 * beside), radius_m=0.3) for beside in (-0.9, 0.0, 0.9))
    said = told(render(room(figures=crowd), Straight((-4.2, 0.0, 1.5)), 2.0))
    assert all(np.linalg.norm(motion.translation_m) < 0.1 for motion in motions(said))


def test_sight_that_comes_back_knows_the_key_frame_again() -> None:
    """More than a second of darkness in a room that stays in view: the chain holds, and is right."""
    zone = LightZone("dark", EVERYWHERE, 0.995, start_s=0.95, end_s=2.05)
    walked = render(room(zones=(zone,)), WALK, 2.6)
    said = told(walked)
    again = next(one for one in said[12:] if isinstance(one, CameraMotion))
    assert (again.start_time_ns, again.time_ns) == (600_000_000, 2_100_000_000)
    assert np.linalg.norm(walked.error(again, SMALL.rate_hz)[:3]) < 0.03


def test_sight_that_comes_back_late_begins_a_new_chain() -> None:
    zone = LightZone("dark", EVERYWHERE, 0.995, start_s=0.55, end_s=3.95)
    said = told(render(room(2.0, zones=(zone,)), Straight((-8.0, 0.0, 1.5), (1.2, 0.0, 0.0)), 4.3))
    again = next(one for one in said[7:] if isinstance(one, CameraMotion))
    assert again.start_time_ns >= 4_000_000_000


def test_a_single_dark_pair_breaks_nothing(walk: Sequence) -> None:
    black = np.zeros_like(walk.pairs[0][0])
    pairs = tuple((black, black) if number == 5 else pair for number, pair in enumerate(walk.pairs[:12]))
    said = told(Sequence(pairs, walk.place_m, walk.attitude))
    assert [number for number, one in enumerate(said) if isinstance(one, Verdict)] == [0, 5]
    track_end(said)


def test_nobody_leaps_half_a_second_ahead_and_back(walk: Sequence) -> None:
    """A view that fits the room perfectly, but where nobody can have been pushed to within a tenth of a second."""
    pairs = tuple(walk.pairs[13] if number == 8 else pair for number, pair in enumerate(walk.pairs[:12]))
    said = told(Sequence(pairs, walk.place_m, walk.attitude))
    assert [number for number, one in enumerate(said) if isinstance(one, Verdict)] == [0, 8]
    track_end(said)


def test_what_is_no_pair_is_said() -> None:
    odometry = StereoOdometry(calibration())
    grey = np.zeros((192, 256), dtype=np.uint8)
    bad = [
        odometry.feed(0, grey, grey[:100]),
        odometry.feed(1, grey.astype(np.int32), grey),
        odometry.feed(2, np.zeros((0, 0), dtype=np.uint8), grey),
    ]
    assert [one.condition for one in bad if isinstance(one, Verdict)] == ["bad_image"] * 3


def test_colour_and_sixteen_bits_become_grey() -> None:
    colour = np.full((4, 5, 3), 80, dtype=np.uint8)
    assert (as_grey(colour) == 80).all()
    assert (as_grey(np.full((4, 5), 80 * 256, dtype=np.uint16)) == 80).all()
    assert as_grey(np.full((4, 5, 1), 7, dtype=np.uint8)).shape == (4, 5)


def test_gain_and_offset_leave_no_trace_in_an_evened_image(walk: Sequence) -> None:
    left = walk.pairs[0][0]
    brighter = np.clip(0.7 * left + 20.0, 0.0, 255.0).astype(np.uint8)
    difference = np.abs(evened(left).astype(float) - evened(brighter))
    assert np.percentile(difference, 95) < 25.0
    assert np.percentile(np.abs(left.astype(float) - brighter), 95) > 20.0


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-2, 2), st.floats(0.5, 50)), min_size=1, max_size=5))
@settings(max_examples=50)
def test_sights_show_their_points_and_jacobians_are_their_derivatives(
    places: list[tuple[float, ...]],
) -> None:
    points = np.array(places)
    sights = CALIBRATION.sights(points)
    np.testing.assert_allclose(CALIBRATION.points(sights), points, rtol=1e-8, atol=1e-8)
    jacobian, step = CALIBRATION.sight_jacobian(points), 1e-6
    for axis in range(3):
        shift = step * np.eye(3)[axis] * points[:, 2:]
        slope = (CALIBRATION.sights(points + shift) - CALIBRATION.sights(points - shift)) / (
            2.0 * step * points[:, 2:]
        )
        np.testing.assert_allclose(jacobian[:, :, axis], slope, rtol=1e-4, atol=1e-4)
    product = jacobian @ CALIBRATION.point_jacobian(points)
    np.testing.assert_allclose(product, np.tile(np.eye(3), (len(points), 1, 1)), atol=1e-9)


def test_the_pose_is_found_among_points_that_move_by_themselves() -> None:
    """Sixty points at rest and forty that went 0.4 m to the right: the sixty tell the motion."""
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(-3, 3, 100), rng.uniform(-2, 2, 100), rng.uniform(2, 12, 100)])
    turn, shift = Rotation.from_rotvec([0.02, -0.05, 0.01]), np.array([0.1, -0.02, -0.5])
    later = points + np.where(np.arange(100)[:, None] < 60, 0.0, [[0.4, 0.0, 0.0]])
    sights = CALIBRATION.sights(turn.apply(later) + shift) + rng.normal(0.0, 0.1, (100, 3))
    doubt = np.tile(0.01 * np.eye(3), (100, 1, 1))
    landmarks = Landmarks(CALIBRATION.sights(points)[:, :2], points, doubt)
    pose = solve(CALIBRATION, landmarks, sights, 0.1, Pose.none())
    assert pose is not None
    np.testing.assert_allclose(pose.translation, shift, atol=0.01)
    np.testing.assert_allclose(pose.rotation.as_rotvec(), turn.as_rotvec(), atol=0.002)
    assert pose.agree[:60].mean() > 0.95
    assert pose.agree[60:].mean() < 0.2


def test_a_right_eye_on_the_left_is_refused() -> None:
    left = np.array([[160.0, 0, 128, 0], [0, 160, 96, 0], [0, 0, 1, 0]])
    right = left + np.array([[0, 0, 0, 19.2], [0, 0, 0, 0], [0, 0, 0, 0]])
    with pytest.raises(ValueError, match="right of the left"):
        StereoCalibration.of_projections(left, right)
    assert StereoCalibration.of_projections(right, left).baseline_m == pytest.approx(0.12)
