"""Writes a camera folder: rendered stereo pairs with ``calib.txt`` and ``poses.txt``, as recorded sets have them.

``image_l/`` and ``image_r/`` are rectified PNG, sorted by name; ``calib.txt`` has ``P0:`` and ``P1:``, 3x4 row by
row; ``poses.txt`` each left camera's true pose, 3x4 row by row, in the first one's axes: x right, y down, z ahead.
"""

from pathlib import Path

import numpy as np
from PIL import Image as PngImage
from scipy.spatial.transform import Rotation

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.camera_defects import Carried, Defects, defective_pair
from proving_ground.sensors.camera_render import TO_BODY, StereoCamera, render_pair
from proving_ground.sensors.camera_world import CameraWorld
from proving_ground.sensors.mounting import Mounting


def write_camera_folder(
    folder: Path,
    world: CameraWorld,
    camera: StereoCamera,
    motion: Motion,
    mounting: Mounting,
    duration_s: float,
    rng: np.random.Generator,
    defects: Defects | None = None,
) -> Path:
    """Render what a camera on a moving body sees from time zero to ``duration_s``; returns the folder.

    ``defects``: of the camera, of which ``calib.txt`` knows nothing.
    """
    for side in ("image_l", "image_r"):
        (folder / side).mkdir(parents=True, exist_ok=True)
    time_s = np.arange(0.0, duration_s, 1.0 / camera.rate_hz)
    place_m, attitude = mounting.carried(motion, time_s)
    for number, when in enumerate(time_s):
        if defects is None:
            pair = render_pair(world, camera, float(when), place_m[number], attitude[number], rng)
        else:
            pair = defective_pair(world, camera, defects, Carried(motion, mounting), float(when), rng)
        for side, image in zip(("image_l", "image_r"), pair, strict=True):
            PngImage.fromarray(image).save(folder / side / f"{number:06d}.png")
    (folder / "calib.txt").write_text(_calibration(camera), encoding="utf-8")
    np.savetxt(folder / "poses.txt", camera_poses(place_m, attitude), fmt="%.9f")
    return folder


def camera_poses(place_m: FloatArray, attitude: Rotation) -> FloatArray:
    """Poses (n, 12) in the first camera's axes, of camera bodies at (n, 3) with attitudes (body to ENU)."""
    turned = attitude * TO_BODY
    first = turned[0].inv()
    matrices = np.concatenate(
        [(first * turned).as_matrix(), first.apply(place_m - place_m[0])[:, :, None]], axis=2
    )
    return np.asarray(matrices.reshape(-1, 12))


def _calibration(camera: StereoCamera) -> str:
    x, y = camera.centre_px
    rows = (
        (camera.focal_px, 0.0, x, -camera.focal_px * shift, 0.0, camera.focal_px, y, 0.0, 0.0, 0.0, 1.0, 0.0)
        for shift in (0.0, camera.baseline_m)
    )
    lines = (f"P{number}: " + " ".join(f"{value:.9g}" for value in row) for number, row in enumerate(rows))
    return "\n".join(lines) + "\n"
