"""How a foot finds its place beside another: two tracks of one walk, laid over one another.

A foot outside the filter walks in a frame of its own. Each of its steps tells where in that frame the other foot
stood that it passed (`fusion.models.dual_foot`), so pairs of such points differ by how people sway only.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from bootprint.geodesy import wrap_angle
from bootprint.messages import Vector3
from fusion.alignment import fit_rigid
from fusion.chi_square import chi_square_quantile
from fusion.config import FusionConfig
from fusion.state import Array
from fusion.transform import RigidTransform

_MOST_PAIRS = 50


@dataclass(slots=True)
class Joining:
    """Where a foot has the other one's stances in its own frame, and where they are, point by point.

    ``together``: both began with the same walk, so that neither foot knows more than the other.
    """

    together: bool
    own: list[Vector3] = field(default_factory=list)
    beside: list[Vector3] = field(default_factory=list)

    def add(self, own: Vector3, stance: Vector3) -> None:
        """One more stance of the foot beside, as this foot has it and as it is."""
        self.own.append(own)
        self.beside.append(stance)

    def relocate(self, transform: RigidTransform) -> None:
        """The filter has changed its frame."""
        points = (transform.point(point) for point in self.beside)
        self.beside = [(float(point[0]), float(point[1]), float(point[2])) for point in points]

    @property
    def is_hopeless(self) -> bool:
        """Whether it has gone on for so long that a fresh start is better."""
        return len(self.own) >= _MOST_PAIRS

    def fit(self, config: FusionConfig) -> RigidTransform | None:
        """From the foot's own frame into the filter's, once as sure as a straight walk of ``join_distance_m`` is.

        None while it is not, or while the two tracks do not look like one walk.
        """
        if math.dist(self.own[0][:2], self.own[-1][:2]) < config.align.provisional_m or len(self.own) < 3:
            return None
        own, beside = np.array(self.own), np.array(self.beside)
        sigma_m = config.boots.join_fit_sigma_m
        fit = fit_rigid(own[:, :2], beside[:, :2], sigma_m**2 * np.eye(len(own)))
        unlike = fit.chi_square > chi_square_quantile(config.boots.gate_probability, 2 * len(own) - 3)
        if unlike or math.sqrt(fit.covariance[2, 2]) > sigma_m / config.boots.join_distance_m:
            return None
        covariance = np.diag([config.boots.join_sigma_m**2] * 3 + [float(fit.covariance[2, 2])])
        return RigidTransform(
            (float(fit.pivot[0]), float(fit.pivot[1]), float(own[:, 2].mean())),
            (float(fit.target[0]), float(fit.target[1]), float(beside[:, 2].mean())),
            wrap_angle(fit.yaw_rad),
            covariance,
        )


def relative_noise(move: RigidTransform, own: Array) -> Array:
    """Covariance (4, 4) of a joined foot's pose against the foot beside it; ``own`` its pose before the move."""
    jacobian = move.error_jacobian((float(own[0]), float(own[1]), float(own[2])))
    result: Array = jacobian @ move.covariance @ jacobian.T
    return result
