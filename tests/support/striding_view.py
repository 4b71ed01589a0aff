"""People who move in front of a camera."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Jostle:
    """Somebody who steps from side to side."""

    beside_m: float
    phase: float

    def at(self, time_s: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Position (n, 3) and attitude."""
        sway = 0.5 * np.sin(2.0 * np.pi * 0.8 * time_s + self.phase)
        place = np.column_stack([np.full(len(time_s), -2.4), self.beside_m + sway, np.full(len(time_s), 1.0)])
        return place, Rotation.identity(len(time_s))
