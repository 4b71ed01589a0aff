"""Cameras that are not as their calibration says: an eye that was knocked, blur, sights worse than expected."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion
from proving_ground.sensors.camera_defects import Bursts, Defects, defective_pair
from sensor_gateway.stereo.motion import Landmarks, Pose, solve
from sensor_gateway.stereo.recognition import recognised
from sensor_gateway.stereo.right_eye import RightEye
from sensor_gateway.stereo.turned_in import turned_in
from support.camera_rooms import Swaying, room
from support.moving import Straight
from support.stereo_walks import SMALL, FloatArray, Sequence, calibration, render, told

CALIBRATION = calibration()
WALK = Swaying(Straight((-4.0, 0.0, 1.5), (1.2, 0.0, 0.0)))


def filmed(defects: Defects, seconds: float = 3.0) -> Sequence:
    """A walk through a room by a camera with defects."""
    rng = np.random.default_rng(2)
    time_s = np.arange(0.0, seconds, 1.0 / SMALL.rate_hz)
    pairs = tuple(defective_pair(room(), SMALL, defects, WALK, float(when), rng) for when in time_s)
    return Sequence(pairs, *WALK.at(time_s))


def way_error_share(sequence: Sequence) -> float:
    """How far off the end is, of the way; the chain must not break."""
    motions = [one for one in told(sequence) if isinstance(one, CameraMotion)]
    place, attitude, start_ns = np.zeros(3), Rotation.identity(), 0
    for motion in {motion.start_time_ns: motion for motion in motions}.values():  # the last of each start
        assert motion.start_time_ns == start_ns
        place = place + attitude.apply(motion.translation_m)
        attitude, start_ns = attitude * Rotation.from_rotvec(motion.rotation_rad), motion.time_ns
    assert start_ns == round((len(sequence.pairs) - 1) * 1e9 / SMALL.rate_hz)
    true = sequence.attitude[0].inv().apply(sequence.place_m[-1] - sequence.place_m[0])
    return float(np.linalg.norm(place - true) / np.linalg.norm(true))


@pytest.mark.parametrize(
    "defects",
    [
        Defects(right_turn_rad=(0.012, 0.0, 0.008)),
        Defects(right_turn_rad=(0.0, 0.0, 0.02), right_focal=1.01),
        Defects(rolling_s=0.02),
        Defects(radial=-0.02, vignetting=0.6),
        Defects(bursts=Bursts(1.9, 0.9, 0.06)),
    ],
    ids=["turned", "rolled and longer", "shutter rolls", "distortion left", "blurred for a while"],
)
def test_defects_cost_little(defects: Defects) -> None:
    assert way_error_share(filmed(defects)) < 0.03


def test_a_pair_that_is_missing_breaks_no_chain() -> None:
    """At 4 m/s the next one is 0.4 m further on than it should be, and its time does not say so."""
    whole = render(room(), Straight((-4.0, 0.0, 1.5), (4.0, 0.0, 0.0)), 1.2)
    kept = np.delete(np.arange(len(whole.pairs)), 6)
    thinned = Sequence(tuple(whole.pairs[at] for at in kept), whole.place_m[kept], whole.attitude[kept])
    assert way_error_share(thinned) < 0.02


def turned_rows(state: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Sights of an eye that is turned by ω, its focal length longer by ε: by projection, not linearised."""
    points = np.column_stack([rng.uniform(-0.7, 0.7, 150), rng.uniform(-0.5, 0.5, 150), np.ones(150)])
    points *= rng.uniform(1.5, 8.0, (150, 1))
    left = CALIBRATION.sights(points)[:, :2]
    seen = Rotation.from_rotvec(state[:3]).inv().apply(points - [CALIBRATION.baseline_m, 0.0, 0.0])
    matrix = CALIBRATION.matrix @ np.diag([1.0 + state[3], 1.0 + state[3], 1.0])
    right = seen @ matrix.T
    return left, right[:, :2] / right[:, 2:] + rng.normal(0.0, 0.1, (150, 2))


def test_rows_tell_how_the_right_eye_looks() -> None:
    rng = np.random.default_rng(4)
    eye, image = RightEye(CALIBRATION), np.zeros((SMALL.height_px, SMALL.width_px), dtype=np.uint8)
    assert eye.straightened(image) is image
    assert eye.rows_aside > 3
    true = np.array([0.01, 0.0, -0.008, 0.004])
    assert eye.learn(*turned_rows(true, rng))
    assert eye.rows_aside < 3
    # A dot where the turned eye sees it comes back to where it belongs.
    dot = np.array([[0.4, -0.3, 1.0]])
    seen = Rotation.from_rotvec(true[:3]).inv().apply(dot - [CALIBRATION.baseline_m, 0.0, 0.0])[0]
    at = CALIBRATION.matrix @ np.diag([1.004, 1.004, 1.0]) @ seen
    cv2.circle(image, (round(16 * at[0] / at[2]), round(16 * at[1] / at[2])), 4 * 16, 255, -1, shift=4)
    rows, columns = np.nonzero(eye.straightened(image) > 128)
    belongs = CALIBRATION.sights(dot)[0, [2, 1]]
    np.testing.assert_allclose([columns.mean(), rows.mean()], belongs, atol=0.6)


def test_an_eye_as_calibrated_is_left_alone() -> None:
    rng = np.random.default_rng(6)
    eye, image = RightEye(CALIBRATION), np.zeros((SMALL.height_px, SMALL.width_px), dtype=np.uint8)
    eye.straightened(image)
    for _ in range(20):
        eye.learn(*turned_rows(np.zeros(4), rng))
    assert eye.straightened(image) is image
    assert eye.rows_aside == 1


def test_what_is_left_alone_is_not_learned_again_and_again() -> None:
    """Rows a twentieth of a pixel off, told forty times: still a twentieth, and no reason to turn the image."""
    rng = np.random.default_rng(6)
    eye, image = RightEye(CALIBRATION), np.zeros((SMALL.height_px, SMALL.width_px), dtype=np.uint8)
    eye.straightened(image)
    for _ in range(40):
        assert not eye.learn(*turned_rows(np.array([0.0003, 0.0, 0.0, 0.0]), rng))
    assert eye.straightened(image) is image


def test_matches_that_are_wrong_do_not_turn_the_eye() -> None:
    rng = np.random.default_rng(8)
    eye, image = RightEye(CALIBRATION), np.zeros((SMALL.height_px, SMALL.width_px), dtype=np.uint8)
    eye.straightened(image)
    left, right = turned_rows(np.zeros(4), rng)
    right[:40, 1] += 5.0
    eye.learn(left, right)
    assert eye.straightened(image) is image


def corridor_points(rng: np.random.Generator, count: int = 240) -> FloatArray:
    """Points on two walls, a floor and a ceiling, all seen before and after half a metre ahead."""
    points = np.column_stack(
        [rng.uniform(-1.2, 1.2, count), rng.uniform(-1.2, 1.4, count), rng.uniform(2.2, 12.0, count)]
    )
    points[: count // 2, 0] = np.sign(points[: count // 2, 0]) * 1.2
    points[count // 2 :, 1] = np.where(points[count // 2 :, 1] > 0.0, 1.4, -1.2)
    return points


def seen_by_turned_eye(points: FloatArray, turn_rad: float, rng: np.random.Generator) -> FloatArray:
    """Sights (n, 3) of a pair whose right eye is turned in: by projection, not linearised."""
    sights = CALIBRATION.sights(points)
    right = (
        Rotation.from_rotvec([0.0, turn_rad, 0.0]).inv().apply(points - [CALIBRATION.baseline_m, 0.0, 0.0])
    )
    sights[:, 2] = CALIBRATION.right_centre_x_px + CALIBRATION.focal_x_px * right[:, 0] / right[:, 2]
    return sights + rng.normal(0.0, 0.15, sights.shape)


@pytest.mark.parametrize("turn_px", [0.0, 0.3, -0.4])
def test_a_motion_tells_how_far_the_right_eye_is_turned_in(turn_px: float) -> None:
    """One step says most of it (the rest when that has been taken out); their spread is as claimed or less."""
    rng = np.random.default_rng(9)
    turn, shift = Rotation.from_rotvec([0.01, 0.02, 0.005]), np.array([0.02, -0.01, -0.5])
    found = []
    for _ in range(25):
        points = corridor_points(rng)
        known, sights = (
            seen_by_turned_eye(places, turn_px / CALIBRATION.focal_x_px, rng)
            for places in (points, turn.apply(points) + shift)
        )
        doubt = np.tile(0.15**2 * np.eye(3), (len(points), 1, 1))
        landmarks = Landmarks(known[:, :2], CALIBRATION.points(known), doubt)
        pose = solve(CALIBRATION, landmarks, sights, 0.15, Pose.none())
        assert pose is not None
        told = turned_in(CALIBRATION, landmarks, sights, pose, 0.15)
        assert told is not None
        found.append((told[0] * CALIBRATION.focal_x_px, np.sqrt(told[1]) * CALIBRATION.focal_x_px))
    values, claimed = np.array(found).T
    assert values.mean() == pytest.approx(turn_px, abs=0.05, rel=0.25)
    assert values.std() < 1.3 * claimed.mean()


def test_an_eye_that_is_turned_in_is_turned_back() -> None:
    """Motions tell what is left of 0.6 px; as much as can be told is taken out of images."""
    eye, image = RightEye(CALIBRATION), np.zeros((SMALL.height_px, SMALL.width_px), dtype=np.uint8)
    eye.straightened(image)
    assert eye.learn_turn(0.6 / CALIBRATION.focal_x_px, 1e-8)
    middle = (SMALL.height_px // 2, SMALL.width_px // 2)
    image[middle[0] - 20 : middle[0] + 20, middle[1]] = 255
    row = eye.straightened(image)[middle[0]].astype(float)
    # A turn to the right by ω moves what is ahead left by f ω: it is taken back to the right.
    assert (row @ np.arange(SMALL.width_px)) / row.sum() - middle[1] == pytest.approx(0.6, abs=0.1)


def test_sights_three_times_as_bad_as_expected_still_agree() -> None:
    rng = np.random.default_rng(7)
    points = np.column_stack([rng.uniform(-3, 3, 150), rng.uniform(-2, 2, 150), rng.uniform(2, 12, 150)])
    turn, shift = Rotation.from_rotvec([0.02, -0.05, 0.01]), np.array([0.1, -0.02, -0.5])
    sights = CALIBRATION.sights(turn.apply(points) + shift) + rng.normal(0.0, 0.9, (150, 3))
    doubt = np.tile(0.09 * np.eye(3), (150, 1, 1))
    landmarks = Landmarks(CALIBRATION.sights(points)[:, :2], points, doubt)
    pose = solve(CALIBRATION, landmarks, sights, 0.3, Pose.none())
    assert pose is not None
    assert pose.agree.mean() > 0.95
    assert 2.0 < pose.scale < 9.0
    np.testing.assert_allclose(pose.translation, shift, atol=0.03)
    np.testing.assert_allclose(pose.rotation.as_rotvec(), turn.as_rotvec(), atol=0.005)


def test_patches_are_recognised_wherever_they_are() -> None:
    """A window of one view, 70 px aside: what is in both is found, and where it is."""
    image = render(room(), Straight((0.0, 0.0, 1.5)), 0.1).pairs[0][0]
    key, later = image[:, :186], image[:, 70:]
    corners = cv2.goodFeaturesToTrack(key, 80, 0.01, 7)
    pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    index, found = recognised(key, pixels, later)
    off = np.linalg.norm(found - (pixels[index] - [70.0, 0.0]), axis=1)
    assert len(index) > 15
    assert np.mean(off < 2.0) > 0.5  # the texture repeats itself: the others agree on no motion
