"""How a camera without a level sits on its wearer: learnt from heights that the feet tell.

A small turn δ = (δ_x, δ_y) of the attitude about level axes moves the height of a displacement d to
``d_z + δ_x d_y − δ_y d_x``: two unknowns, one linear measurement for every metre or so walked, a Kalman filter.
Turns about up are no tilt; they are the heading, which the positions tell.
"""

import numpy as np

from fusion.state import Array


class Tilt:
    """The filter of δ, taken out of the attitude after every update, so that its mean is always zero."""

    def __init__(self, sigma_rad: float, walk_rad_sqrt_s: float, height_sigma_m: float) -> None:
        self.covariance: Array = np.eye(2) * sigma_rad**2
        self._walk = walk_rad_sqrt_s
        self._noise_m2 = height_sigma_m**2

    @property
    def sigma_rad(self) -> float:
        """The larger of the two sigmas."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance)[-1]))

    def age(self, seconds: float) -> None:
        """Attitude drifts."""
        self.covariance = self.covariance + self._walk**2 * max(seconds, 0.0) * np.eye(2)

    def learn(self, displacement_m: Array, climb_m: float) -> Array:
        """The turn (3,) rad to be made, after a level displacement (3,) on which feet climbed so much."""
        slope = np.array([displacement_m[1], -displacement_m[0]])
        shared = self.covariance @ slope
        gain = shared / (float(slope @ shared) + self._noise_m2)
        self.covariance = self.covariance - np.outer(gain, shared)
        turn = gain * (climb_m - float(displacement_m[2]))
        return np.array([turn[0], turn[1], 0.0])

    def note_level(self, sigma_rad: float) -> None:
        """An inertial unit tells where up is."""
        self.covariance = sigma_rad**2 * np.eye(2)
