"""The pinhole geometry of a rectified stereo pair.

Camera axes: x right, y down, z ahead, at the left eye. A *sight* of a point is the three numbers that a rectified
pair tells of it: ``(u_left, v, u_right)``, px.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StereoCalibration:
    """Focal lengths and principal points in px, baseline in m (right eye to the right of the left one)."""

    focal_x_px: float
    focal_y_px: float
    centre_x_px: float
    centre_y_px: float
    right_centre_x_px: float
    baseline_m: float

    @classmethod
    def of_projections(cls, left: FloatArray, right: FloatArray) -> "StereoCalibration":
        """From the rectified projection matrices (3, 4); ValueError if they are none of a stereo pair.

        ``P = K [I | t]``, so that ``−P[0, 3]/P[0, 0]`` is how far right of the origin an eye is.
        """
        if left.shape != (3, 4) or right.shape != (3, 4):
            raise ValueError("projection matrices have 12 numbers each")
        if not (np.isfinite(left).all() and np.isfinite(right).all() and left[0, 0] > 0.0 < left[1, 1]):
            raise ValueError("focal lengths must be positive")
        baseline_m = float(left[0, 3] / left[0, 0] - right[0, 3] / right[0, 0])
        if baseline_m <= 0.0:
            raise ValueError("the right eye must lie to the right of the left one: P1[0, 3] below P0[0, 3]")
        return cls(
            focal_x_px=float(left[0, 0]),
            focal_y_px=float(left[1, 1]),
            centre_x_px=float(left[0, 2]),
            centre_y_px=float(left[1, 2]),
            right_centre_x_px=float(right[0, 2]),
            baseline_m=baseline_m,
        )

    @property
    def matrix(self) -> FloatArray:
        """The left eye's camera matrix K (3, 3)."""
        return np.array(
            [
                [self.focal_x_px, 0.0, self.centre_x_px],
                [0.0, self.focal_y_px, self.centre_y_px],
                [0.0, 0.0, 1.0],
            ]
        )

    def disparity(self, sights: FloatArray) -> FloatArray:
        """Disparity (n,) px of sights (n, 3), zero at infinity."""
        return np.asarray(
            sights[:, 0] - sights[:, 2] - (self.centre_x_px - self.right_centre_x_px), dtype=np.float64
        )

    def points(self, sights: FloatArray) -> FloatArray:
        """The points (n, 3) m that sights (n, 3) of positive disparity show."""
        depth = self.focal_x_px * self.baseline_m / self.disparity(sights)
        across = (sights[:, 0] - self.centre_x_px) / self.focal_x_px
        down = (sights[:, 1] - self.centre_y_px) / self.focal_y_px
        return np.column_stack([across * depth, down * depth, depth])

    def sights(self, points: FloatArray) -> FloatArray:
        """How points (n, 3) ahead of the camera are seen, (n, 3) px."""
        inverse = 1.0 / points[:, 2]
        left = self.focal_x_px * points[:, 0] * inverse
        shift = self.focal_x_px * self.baseline_m * inverse
        down = self.focal_y_px * points[:, 1] * inverse
        return np.column_stack(
            [left + self.centre_x_px, down + self.centre_y_px, left - shift + self.right_centre_x_px]
        )

    def sight_jacobian(self, points: FloatArray) -> FloatArray:
        """``∂sight/∂point`` (n, 3, 3), px/m."""
        inverse = 1.0 / points[:, 2]
        jacobian = np.zeros((len(points), 3, 3))
        jacobian[:, 0, 0] = jacobian[:, 2, 0] = self.focal_x_px * inverse
        jacobian[:, 1, 1] = self.focal_y_px * inverse
        jacobian[:, 0, 2] = -self.focal_x_px * points[:, 0] * inverse**2
        jacobian[:, 1, 2] = -self.focal_y_px * points[:, 1] * inverse**2
        jacobian[:, 2, 2] = -self.focal_x_px * (points[:, 0] - self.baseline_m) * inverse**2
        return jacobian

    def point_jacobian(self, points: FloatArray) -> FloatArray:
        """``∂point/∂sight`` (n, 3, 3), m/px: the inverse of `sight_jacobian`."""
        x, y, z = points.T
        disparity = self.focal_x_px * self.baseline_m / z
        jacobian = np.zeros((len(points), 3, 3))
        for row, values in enumerate((x, y, z)):
            jacobian[:, row, 2] = values / disparity
            jacobian[:, row, 0] = -jacobian[:, row, 2]
        jacobian[:, 0, 0] += z / self.focal_x_px
        jacobian[:, 1, 1] = z / self.focal_y_px
        return jacobian

    def spread(self, points: FloatArray, covariances: FloatArray) -> FloatArray:
        """Covariances (n, 3, 3) m² of points whose sights have covariances (n, 3, 3) px²."""
        back = self.point_jacobian(points)
        return np.asarray(back @ covariances @ np.swapaxes(back, 1, 2))
