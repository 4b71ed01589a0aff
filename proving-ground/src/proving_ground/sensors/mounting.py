"""Where a sensor sits on the body that carries it."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.motion import FloatArray, Motion


@dataclass(frozen=True)
class Mounting:
    """Where a sensor sits on its body: ``offset_m`` (3,) in body axes, ``rotation`` sensor to body."""

    offset_m: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: Rotation = field(default_factory=Rotation.identity)

    def carried(self, motion: Motion, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude (sensor to ENU) of the sensor."""
        position, attitude = motion.at(time_s)
        return position + attitude.apply(self.offset_m), attitude * self.rotation
