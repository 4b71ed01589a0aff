"""A textbook stereo odometry by OpenCV, frame to frame: an independent witness that images carry the motion.

Corners are followed from left to right and from each left image to the next (pyramidal Lucas-Kanade, checked forth
and back), placed by their disparity, and the pose is found by PnP with RANSAC.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from proving_ground.sensors.camera_render import Image, StereoCamera

FloatArray = npt.NDArray[np.float64]
_LEAST_MATCHES = 12
_WINDOW = {"winSize": (15, 15), "maxLevel": 4}


@dataclass(frozen=True)
class Movement:
    """From one pair to the next, in the first one's camera axes."""

    translation_m: FloatArray
    rotation: Rotation
    inliers: int


def movement(
    camera: StereoCamera, before: tuple[Image, Image], after: tuple[Image, Image]
) -> Movement | None:
    """How the camera moved; None where too few corners agree."""
    corners = cv2.goodFeaturesToTrack(before[0], maxCorners=300, qualityLevel=0.02, minDistance=7)
    if corners is None or len(corners) < _LEAST_MATCHES:
        return None
    right, in_right = _followed(before[0], before[1], corners)
    later, in_later = _followed(before[0], after[0], corners)
    disparity = (corners - right)[:, 0, 0]
    level = np.abs((corners - right)[:, 0, 1]) < 1.0
    used = in_right & in_later & level & (disparity > 0.5)
    if used.sum() < _LEAST_MATCHES:
        return None
    return _solved(camera, corners[used][:, 0], disparity[used], later[used][:, 0])


def _followed(
    image: Image, other: Image, corners: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    there, found, _ = cv2.calcOpticalFlowPyrLK(image, other, corners, None, **_WINDOW)
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(other, image, there, None, **_WINDOW)
    returned = np.linalg.norm((back - corners)[:, 0], axis=1) < 0.5
    return there, (found[:, 0] == 1) & (found_back[:, 0] == 1) & returned


def _solved(
    camera: StereoCamera, corners: FloatArray, disparity: FloatArray, later: FloatArray
) -> Movement | None:
    x, y = camera.centre_px
    depth = camera.focal_px * camera.baseline_m / disparity
    points = np.column_stack(
        [(corners[:, 0] - x) * depth / camera.focal_px, (corners[:, 1] - y) * depth / camera.focal_px, depth]
    )
    matrix = np.array([[camera.focal_px, 0.0, x], [0.0, camera.focal_px, y], [0.0, 0.0, 1.0]])
    found, turn, shift, inliers = cv2.solvePnPRansac(
        points, later.astype(np.float64), matrix, None, reprojectionError=1.0, iterationsCount=200
    )
    if not found or inliers is None or len(inliers) < _LEAST_MATCHES:
        return None
    chosen = inliers[:, 0]
    turn, shift = cv2.solvePnPRefineLM(
        points[chosen], later[chosen].astype(np.float64), matrix, None, turn, shift
    )
    # PnP gives the world in the later camera's axes: invert.
    rotation = Rotation.from_rotvec(turn[:, 0]).inv()
    return Movement(-rotation.apply(shift[:, 0]), rotation, len(chosen))
