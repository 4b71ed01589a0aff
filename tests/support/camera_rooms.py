"""Rooms for cameras, and somebody who walks through them as people do."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from proving_ground.motion import Motion
from proving_ground.sensors import Area, CameraWorld, Figure, LightZone, Slab, StereoCamera, Walls
from support.moving import Straight

FloatArray = npt.NDArray[np.float64]
CAMERA = StereoCamera()
EVERYWHERE = Area.box(-999.0, -999.0, 999.0, 999.0)
_PLAN_M = np.array(
    [[[-5, -4], [5, -4]], [[5, -4], [5, 4]], [[5, 4], [-5, 4]], [[-5, 4], [-5, -4]]], dtype=float
)


def room(
    scale: float = 1.0,
    zones: tuple[LightZone, ...] = (),
    figures: tuple[Figure, ...] = (),
    contrast: float = 0.6,
) -> CameraWorld:
    """A room of 10 m by 8 m, 2.8 m high; its plan scaled."""
    walls = Walls(_PLAN_M * scale, np.tile([0.0, 2.8], (4, 1)))
    return CameraWorld(walls, (Slab(0.0), Slab(2.8)), figures, zones, contrast)


def corridor() -> CameraWorld:
    """2 m wide, with a far end."""
    ends = np.array([[[-20, -1], [20, -1]], [[20, -1], [20, 1]], [[20, 1], [-20, 1]]], dtype=float)
    return CameraWorld(Walls(ends, np.tile([0.0, 2.8], (3, 1))), (Slab(0.0), Slab(2.8)))


def yard() -> CameraWorld:
    """40 m by 32 m between houses of 6 m, under the open sky."""
    return CameraWorld(Walls(_PLAN_M * 4.0, np.tile([0.0, 6.0], (4, 1))), (Slab(0.0),))


@dataclass(frozen=True)
class Swaying:
    """A motion with the bounce, sway and rotation of walking on top, and a steady turn."""

    motion: Motion
    turn_rad_s: float = 0.0

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        place, attitude = self.motion.at(time_s)
        stride, step = (np.sin(2.0 * np.pi * hz * time_s) for hz in (0.9, 1.8))
        sway = np.column_stack([0.0 * step, 0.02 * stride, 0.025 * step])
        angles = np.column_stack([0.05 * stride + self.turn_rad_s * time_s, 0.02 * step, 0.03 * stride])
        return place + sway, attitude * Rotation.from_euler("ZYX", angles)


WALKING = Swaying(Straight((-2.0, -1.0, 1.5), (1.2, 0.0, 0.0)))
