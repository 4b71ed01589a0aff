"""What a camera has seen, in ENU: landmarks of a key frame, from where the fusion has the camera."""

from dataclasses import dataclass

import numpy as np

from bootprint.messages import CameraMotion
from fusion.models import camera
from fusion.state import Array


@dataclass(frozen=True, slots=True)
class Sight:
    """Where the camera was (3,) m, and the points (n, 3) m that it saw from there."""

    eye_m: Array
    points_m: Array


def sight_of(motion: CameraMotion, attitude: Array, pose: Array) -> Sight | None:
    """The landmarks that a motion tells; None if it tells none.

    ``attitude`` (3, 3) is body to level, its level turned from ENU by an angle that ``pose`` (east, north, up,
    yaw of the forward axis) tells; both are of the motion's start.
    """
    if not motion.landmarks_m:
        return None
    turn = camera.turn_matrix((0.0, 0.0, float(pose[3]) - camera.heading(attitude)))
    points = np.array(motion.landmarks_m) @ (turn @ attitude).T
    return Sight(pose[:3].copy(), points + pose[:3])
