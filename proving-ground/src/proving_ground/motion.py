"""What a motion is to those who measure it: a place and an attitude at any time, smooth enough to be differenced.

Frames are local ENU (metres, z up); body axes are forward, left, up. Whoever moves (a foot, a torso, a vehicle)
and whoever measures meet here, so that neither knows the other.
"""

from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

FloatArray = npt.NDArray[np.float64]


class Motion(Protocol):
    """A rigid body's continuous motion."""

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) m, ENU, and attitude (n), body to ENU, at these times (n,) s."""
        ...  # pragma: no cover
