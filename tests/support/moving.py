"""Motions in closed form, whose sensor signals can be worked out by hand."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Straight:
    """Level and facing along ``yaw_rad``, from ``start_m`` with a constant velocity (0: standing)."""

    start_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        place = np.array(self.start_m) + np.outer(time_s, self.velocity_m_s)
        return place, Rotation.from_euler("Z", np.full((len(time_s), 1), self.yaw_rad))


@dataclass(frozen=True)
class Circling:
    """Counter-clockwise round (0, 0, height), facing along the circle: a constant turn."""

    radius_m: float
    rate_rad_s: float
    height_m: float = 0.0

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        turn = self.rate_rad_s * time_s
        place = np.column_stack(
            [self.radius_m * np.cos(turn), self.radius_m * np.sin(turn), np.full(len(time_s), self.height_m)]
        )
        return place, Rotation.from_euler("Z", (turn + np.pi / 2.0)[:, None])


@dataclass(frozen=True)
class Bouncing:
    """Level, up and down: amplitude·sin(2π·frequency·t)."""

    amplitude_m: float
    frequency_hz: float

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        up = self.amplitude_m * np.sin(2.0 * np.pi * self.frequency_hz * time_s)
        return np.column_stack([0.0 * up, 0.0 * up, up]), Rotation.identity(len(time_s))


@dataclass(frozen=True)
class Track:
    """Through way-points (k, 3) at times (k,), straight in between, facing east."""

    time_s: FloatArray
    place_m: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude."""
        place = np.column_stack([np.interp(time_s, self.time_s, column) for column in self.place_m.T])
        return place, Rotation.identity(len(time_s))
