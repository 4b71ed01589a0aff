"""Rendered stereo pairs: geometry by hand, light and smoke, and the motion that they carry, read by OpenCV."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PngImage
from scipy.spatial.transform import Rotation

from proving_ground.motion import Motion
from proving_ground.sensors import (
    Area,
    CameraWorld,
    Figure,
    LightZone,
    Mounting,
    Slab,
    StereoCamera,
    Walls,
    render_pair,
    write_camera_folder,
)
from proving_ground.sensors.camera_folder import camera_poses
from proving_ground.sensors.camera_render import TO_BODY, Image
from proving_ground.sensors.camera_world import SKY, cast
from support.camera_rooms import CAMERA, EVERYWHERE, WALKING, room
from support.moving import Circling, Straight
from support.visual_odometry import movement

SHARP = StereoCamera(noise_grey=0.0)
FACING_WALL = CameraWorld(Walls(np.array([[[2.4, -9.0], [2.4, 9.0]]]), np.array([[-9.0, 9.0]])))


def pair_at(
    world: CameraWorld, camera: StereoCamera = SHARP, place: tuple[float, float, float] = (0.0, 0.0, 1.5)
) -> tuple[Image, Image]:
    rng = np.random.default_rng(1)
    return render_pair(world, camera, 0.0, np.array(place), Rotation.identity(), rng)


def test_a_wall_shifts_between_the_eyes_by_its_disparity() -> None:
    """Focal length 200 px, 12 cm apart, 2.4 m away: 10 px to the left in the right image, everywhere."""
    left, right = pair_at(FACING_WALL)
    assert left.shape == (240, 320)
    assert left.std() > 15.0
    difference = left[:, 10:].astype(int) - right[:, :-10].astype(int)
    assert np.abs(difference).max() <= 1


def test_the_picture_stands_upright_and_the_right_way_round() -> None:
    """Ahead a corridor: left wall near, right wall far, ceiling open: rays tell what is where."""
    walls = Walls(
        np.array([[[-9.0, 1.0], [9.0, 1.0]], [[-9.0, -3.0], [9.0, -3.0]]]), np.tile([0.0, 9.0], (2, 1))
    )
    world = CameraWorld(walls, slabs=(Slab(0.0),))
    rays = TO_BODY.apply(CAMERA.rays())
    hits = cast(world, np.zeros(1), np.array([[0.0, 0.0, 1.5]]), rays[None])
    surface, distance = (values.reshape(240, 320) for values in (hits.surface, hits.distance))
    assert (surface[120, 0], surface[120, -1], surface[-1, 160], surface[0, 160]) == (0, 1, 2, SKY)
    # The left edge looks 159.5/200 to the side: the wall 1 m to the left is 200/159.5 m ahead.
    assert distance[120, 0] == pytest.approx(200.0 / 159.5)
    assert distance[-1, 160] == pytest.approx(1.5 * 200.0 / 119.5)


def test_a_wall_out_of_sight_changes_nothing() -> None:
    ends = np.array([[[300.0, -9.0], [300.0, 9.0]], [[2.4, -9.0], [2.4, 9.0]], [[9.0, 9.0], [9.0, -9.0]]])
    hits = cast(
        CameraWorld(Walls(ends, np.tile([-9.0, 9.0], (3, 1)))),
        np.zeros(1),
        np.array([[0.0, 0.0, 1.5]]),
        np.array([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]]),
    )
    np.testing.assert_array_equal(hits.surface, [[1, SKY]])
    np.testing.assert_allclose(hits.distance, [[2.4, np.inf]])


def test_one_sees_over_a_low_wall_and_under_a_high_one() -> None:
    """Eyes at 1.5 m: over a parapet of 1 m, under a lintel from 2 m on; slanting rays hit them."""
    ends = np.array([[[1.0, -9.0], [1.0, 9.0]], [[1.0, -9.0], [1.0, 9.0]], [[4.0, -9.0], [4.0, 9.0]]])
    world = CameraWorld(Walls(ends, np.array([[0.0, 1.0], [2.0, 3.0], [0.0, 3.0]])))
    rays = np.array([[[1.0, 0.0, 0.0], [1.0, 0.0, -0.7], [1.0, 0.0, 0.7]]])
    hits = cast(world, np.zeros(1), np.array([[0.0, 0.0, 1.5]]), rays)
    np.testing.assert_array_equal(hits.surface, [[2, 0, 1]])
    np.testing.assert_allclose(hits.across_m, [[1.5, 0.8, 2.2]])


def test_people_hide_what_is_behind_them_and_only_where_they_are() -> None:
    figure = Figure(Straight((1.5, 0.0, 1.0)))
    empty, _ = pair_at(FACING_WALL)
    with_one, _ = pair_at(CameraWorld(FACING_WALL.walls, figures=(figure,)))
    changed = (empty != with_one).mean(axis=0)
    # 25 cm to each side at 1.5 m, seen on the tangent: ±200·0.25/√(1.5² − 0.25²) = ±33.8 px about 159.5.
    seen = np.flatnonzero(changed > 0.3)
    assert seen.min() == pytest.approx(126, abs=2)
    assert seen.max() == pytest.approx(193, abs=2)
    # From 0 to 1.8 m: the head ends 0.3 m above the camera, 1.25 m ahead at the nearest.
    rows = np.flatnonzero((empty != with_one)[:, 160])
    assert rows.min() == pytest.approx(119.5 - 200.0 * 0.3 / 1.25, abs=2)


def test_darkness_and_smoke_take_the_contrast() -> None:
    bright, _ = pair_at(FACING_WALL)
    dark, _ = pair_at(CameraWorld(FACING_WALL.walls, zones=(LightZone("dark", EVERYWHERE, 0.999),)))
    assert dark.mean() < 5.0
    half, _ = pair_at(CameraWorld(FACING_WALL.walls, zones=(LightZone("dark", EVERYWHERE, 0.5),)))
    np.testing.assert_allclose(half.astype(int), bright.astype(int), atol=1)  # exposure makes up for it
    smoky, _ = pair_at(CameraWorld(FACING_WALL.walls, zones=(LightZone("smoke", EVERYWHERE, 0.5),)))
    # The middle looks through 2.4 m of it: e^-1.2 of the contrast is left.
    middle = (slice(100, 140), slice(130, 190))
    assert smoky[middle].std() / bright[middle].std() == pytest.approx(np.exp(-1.2), rel=0.05)


def test_zones_are_felt_in_their_place_and_time() -> None:
    zone = LightZone("dark", Area.box(0.0, 0.0, 1.0, 1.0), 0.9, start_s=5.0, end_s=6.0)
    world = CameraWorld(zones=(zone,))
    places = np.array([[0.5, 0.5, 1.0], [0.5, 0.5, 1.0], [1.5, 0.5, 1.0]])
    np.testing.assert_allclose(world.light(np.array([5.5, 6.5, 5.5]), places), [0.1, 1.0, 1.0])


def test_noise_is_that_of_the_camera_and_grows_in_the_dark() -> None:
    plain = CameraWorld(FACING_WALL.walls, contrast=0.0)
    assert pair_at(plain, CAMERA)[0].std() == pytest.approx(1.5, rel=0.05)
    dim = CameraWorld(FACING_WALL.walls, contrast=0.0, zones=(LightZone("dark", EVERYWHERE, 0.8),))
    assert pair_at(dim, CAMERA)[0].std() == pytest.approx(7.5, rel=0.05)


def test_a_camera_folder_is_as_recorded_ones_are(tmp_path: Path) -> None:
    small = StereoCamera(width_px=40, height_px=30, focal_px=25.0)
    mounting = Mounting(np.array([0.1, 0.0, 0.4]))
    motion, rng = Straight((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), np.random.default_rng(1)
    folder = write_camera_folder(tmp_path / "camera", room(), small, motion, mounting, 0.5, rng)
    names = sorted(path.name for path in (folder / "image_l").iterdir())
    assert names == [f"{number:06d}.png" for number in range(5)]
    assert names == sorted(path.name for path in (folder / "image_r").iterdir())
    with PngImage.open(folder / "image_r" / "000004.png") as image:
        assert (image.size, image.mode) == ((40, 30), "L")
    calibration = (folder / "calib.txt").read_text().splitlines()
    assert [line.split()[0] for line in calibration] == ["P0:", "P1:"]
    right = np.array(calibration[1].split()[1:], dtype=float).reshape(3, 4)
    assert right[0, 3] == pytest.approx(-25.0 * 0.12)
    np.testing.assert_allclose(right[:, :3], [[25.0, 0.0, 19.5], [0.0, 25.0, 14.5], [0.0, 0.0, 1.0]])
    poses = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    # 1 m/s ahead at 10 Hz: z grows by 0.1 a frame.
    np.testing.assert_allclose(poses[:, :, 3], np.outer(np.arange(5) * 0.1, [0.0, 0.0, 1.0]), atol=1e-8)
    np.testing.assert_allclose(poses[:, :, :3], np.tile(np.eye(3), (5, 1, 1)), atol=1e-8)


def test_a_left_turn_turns_the_pose_about_the_axis_that_points_down() -> None:
    """A quarter turn to the left: what was to the left (-x) is now ahead (z)."""
    place, attitude = Circling(2.0, np.pi / 2.0).at(np.array([0.0, 1.0]))
    pose = camera_poses(place, attitude)[1].reshape(3, 4)
    np.testing.assert_allclose(pose[:, 2], [-1.0, 0.0, 0.0], atol=1e-9)
    # From (2, 0) facing north to (0, 2): 2 m ahead and 2 m to the left.
    np.testing.assert_allclose(pose[:, 3], [-2.0, 0.0, 2.0], atol=1e-9)


@pytest.mark.parametrize(
    ("motion", "share"), [(WALKING, 0.02), (Circling(2.0, 0.6, 1.5), 0.01)], ids=["walking", "circling"]
)
def test_the_images_carry_the_motion(motion: Motion, share: float) -> None:
    """An odometry that knows nothing of our renderer finds the way to within that share of its length."""
    world, rng = room(), np.random.default_rng(1)
    time_s = np.arange(11) / CAMERA.rate_hz
    place, attitude = motion.at(time_s)
    pairs = [
        render_pair(world, CAMERA, float(when), here, turned, rng)
        for when, here, turned in zip(time_s, place, attitude, strict=True)
    ]
    pose, track = Rotation.identity(), [np.zeros(3)]
    for before, after in pairwise(pairs):
        step = movement(CAMERA, before, after)
        assert step is not None
        track.append(track[-1] + pose.apply(step.translation_m))
        pose = pose * step.rotation
    true = camera_poses(place, attitude).reshape(-1, 3, 4)
    length = np.linalg.norm(np.diff(place, axis=0), axis=1).sum()
    assert length > 1.0
    assert np.linalg.norm(np.array(track) - true[:, :, 3], axis=1).max() < share * length
    assert (Rotation.from_matrix(true[-1, :, :3]).inv() * pose).magnitude() < np.radians(0.3)
