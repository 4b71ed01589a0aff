"""The way along a leg's points: places and directions by the length walked."""

from dataclasses import dataclass

import numpy as np

from proving_ground.people.legs import FloatArray


@dataclass(frozen=True)
class Route:
    """Way-points (k, 3) in ENU metres, walked in order; directions are of chords, which rounds the corners."""

    points_m: FloatArray

    @property
    def arc_m(self) -> FloatArray:
        """Horizontal length up to each point (k,)."""
        pieces = np.linalg.norm(np.diff(self.points_m[:, :2], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(pieces)])

    @property
    def length_m(self) -> float:
        """Horizontal length."""
        return float(self.arc_m[-1])

    def at(self, arc_m: FloatArray) -> FloatArray:
        """Points (n, 3) at these lengths (n,)."""
        return np.column_stack([np.interp(arc_m, self.arc_m, self.points_m[:, axis]) for axis in range(3)])

    def yaw_at(self, arc_m: FloatArray, reach_m: float = 0.4) -> FloatArray:
        """Direction (n,), counter-clockwise from east, of the chord ``reach_m`` back and ahead; unwrapped."""
        chord = self.at(np.minimum(arc_m + reach_m, self.length_m)) - self.at(
            np.maximum(arc_m - reach_m, 0.0)
        )
        return np.unwrap(np.arctan2(chord[:, 1], chord[:, 0]))

    def slope_at(self, arc_m: FloatArray, reach_m: float = 0.4) -> FloatArray:
        """Rise over way (n,) of the same chord."""
        ahead, behind = np.minimum(arc_m + reach_m, self.length_m), np.maximum(arc_m - reach_m, 0.0)
        rise = (self.at(ahead) - self.at(behind))[:, 2]
        return np.asarray(rise / np.maximum(ahead - behind, 1e-6))
