"""How the right eye really looks: a turn and a focal length that calibration missed, learned from rows.

In a rectified pair a point is in the same row of both images. An eye that was knocked, or whose calibration was not
that good, sees it in others, by an amount that depends on where in the image it is. With the right eye turned by a
small rotation vector ω (camera axes), its focal length longer by a share ε, and a radial distortion κ left in both
lenses, rows in units of the focal length differ by

    Δy = ω_x·(1 + y²) − ω_y·x·y − ω_z·x + ε·y + κ·y·(x_r² − x_l²),

x, y being the sight's (right) coordinates: so a Kalman filter learns all five from the matches of each key frame
(Dang, Hoffmann and Stiller 2009 calibrate cars' cameras so). Then the right image is turned back by the homography
``K diag(1 + ε, 1 + ε, 1) Rᵀ K⁻¹`` before anything is matched in it. ω_y, which shifts all disparities alike and so
scales the way, shows in rows only at the corners; motions tell it (`stereo.turned_in`).
"""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from sensor_gateway.stereo.calibration import FloatArray, StereoCalibration
from sensor_gateway.stereo.images import Image

_DOUBT_PX = np.array([2.0, 0.3, 2.0, 2.0])  # of ω and ε at the image's edge, before anything was seen
_RADIAL_DOUBT = 0.02
_WANDER = 0.02  # of the doubt, a key frame
_ROW_SIGMA_PX = 0.4
_REPEATS = 8.0  # corners beside each other, and one after another, err alike
_OUTLIER = 3.0  # sigmas from the median of what is left
_FEWEST = 12
_LEAST_PX = 0.15  # what is off by less is left as it is
_WIDEST_ROWS = 6
_TURNED_IN, _RADIAL = 1, 4  # ω_y and κ in the state


class RightEye:
    """Learns how the right eye looks, and turns its images back."""

    def __init__(self, calibration: StereoCalibration) -> None:
        self._calibration = calibration
        self._state: FloatArray = np.zeros(5)
        self._taken_out: FloatArray = np.zeros(5)  # of images, so far: of what is left alone they still tell
        self._prior: FloatArray | None = None  # needs the image's size
        self._covariance: FloatArray = np.zeros((5, 5))
        self._corners: FloatArray = np.zeros((0, 2))

    def straightened(self, image: Image) -> Image:
        """The image as an eye would have seen it that is as calibrated."""
        if self._prior is None:
            self._begin(image)
        if not self._taken_out.any():
            return image
        height, width = image.shape
        return np.asarray(
            cv2.warpPerspective(
                image,
                self._homography(),
                (width, height),
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            dtype=np.uint8,
        )

    @property
    def rows_aside(self) -> int:
        """How many rows off a match may be, up or down."""
        spread = self._rows(self._corners, self._corners)[:, :4]
        variance = np.einsum("ni,ij,nj->n", spread, self._covariance[:4, :4], spread).max(initial=0.0)
        off = 2.0 * self._calibration.focal_y_px * float(np.sqrt(variance))
        return min(_WIDEST_ROWS, max(1, round(off)))

    def learn(self, left: FloatArray, right: FloatArray) -> bool:
        """Matches (n, 2) px of the left and the straightened right image; whether images are to be turned anew."""
        if len(left) < _FEWEST:
            return False
        self._covariance = self._covariance + _WANDER**2 * self._prior_covariance()
        design = self._rows(self._normal(left), self._normal(right, self._calibration.right_centre_x_px))
        off = (right[:, 1] - left[:, 1]) / self._calibration.focal_y_px
        off -= design @ (self._state - self._taken_out)  # what is known of it already
        sigma = _ROW_SIGMA_PX / self._calibration.focal_y_px
        kept = np.ones(len(off), dtype=bool)
        for _ in range(3):
            change, covariance = self._corrected(design[kept], off[kept], sigma)
            rest = off - design @ change
            spread = max(sigma, 1.4826 * float(np.median(np.abs(rest - np.median(rest)))))
            kept = np.abs(rest - np.median(rest)) < _OUTLIER * spread
        self._state, self._covariance = self._state + change, covariance
        return self._take_out()

    def learn_turn(self, turn_rad: float, variance: float) -> bool:
        """ω_y of the straightened images, as a motion shows it; whether images are to be turned anew."""
        innovation = turn_rad - float((self._state - self._taken_out)[_TURNED_IN])
        gain = self._covariance[:, _TURNED_IN] / (
            self._covariance[_TURNED_IN, _TURNED_IN] + _REPEATS * variance
        )
        self._state = self._state + gain * innovation
        self._covariance = self._covariance - np.outer(gain, self._covariance[_TURNED_IN])
        return self._take_out()

    def _take_out(self) -> bool:
        """From now on images are turned by what is known now, if that is another turn than before."""
        known = self._state.copy()
        known[_RADIAL] = 0.0  # no homography takes that out
        if not np.abs(self._moved_px(known) - self._moved_px(self._taken_out)).max() > _LEAST_PX:
            return False
        self._taken_out = known
        return True

    def forget(self) -> None:
        """Nothing fits any more: the eye may have been knocked."""
        self._covariance = self._prior_covariance()

    def _begin(self, image: Image) -> None:
        height, width = image.shape
        self._corners = self._normal(
            np.array([[x, y] for x in (0.0, width / 2, width - 1.0) for y in (0.0, height / 2, height - 1.0)])
        )
        reach = np.abs(self._corners).max(axis=0)
        focal_px = self._calibration.focal_y_px
        turns = _DOUBT_PX / focal_px / np.array([1.0, 1.0, reach[0], reach[1]])
        self._prior = np.append(turns, _RADIAL_DOUBT)
        self._covariance = self._prior_covariance()

    def _prior_covariance(self) -> FloatArray:
        return np.zeros((5, 5)) if self._prior is None else np.diag(self._prior**2)

    def _corrected(self, design: FloatArray, off: FloatArray, sigma: float) -> tuple[FloatArray, FloatArray]:
        """What rows say of the state: a change (5,) and the covariance then."""
        information = np.linalg.inv(self._covariance) + design.T @ design / (_REPEATS * sigma**2)
        covariance: FloatArray = np.linalg.inv(information).astype(np.float64)
        return covariance @ design.T @ off / (_REPEATS * sigma**2), covariance

    def _normal(self, pixels: FloatArray, centre_x_px: float | None = None) -> FloatArray:
        """Pixels (n, 2) in focal lengths from the middle."""
        calibration = self._calibration
        across = pixels[:, 0] - (calibration.centre_x_px if centre_x_px is None else centre_x_px)
        down = pixels[:, 1] - calibration.centre_y_px
        return np.column_stack([across / calibration.focal_x_px, down / calibration.focal_y_px])

    @staticmethod
    def _rows(left: FloatArray, right: FloatArray) -> FloatArray:
        """``∂Δy/∂state`` (n, 5) at normalised coordinates (n, 2)."""
        x, y = right[:, 0], right[:, 1]
        return np.column_stack([1.0 + y**2, -x * y, -x, y, y * (x**2 - left[:, 0] ** 2)])

    def _moved_px(self, state: FloatArray) -> FloatArray:
        """By how much (k, 2) the image's corners and edges are off."""
        x, y = self._corners[:, 0], self._corners[:, 1]
        turn_x, turn_y, turn_z, longer, _ = state
        across = -turn_y * (1.0 + x**2) + turn_z * y + turn_x * x * y + longer * x
        down = turn_x * (1.0 + y**2) - turn_y * x * y - turn_z * x + longer * y
        return self._calibration.focal_y_px * np.column_stack([across, down])

    def _homography(self) -> FloatArray:
        """From pixels as they should be to those as they are, (3, 3)."""
        matrix = self._calibration.matrix
        matrix[0, 2] = self._calibration.right_centre_x_px
        longer = 1.0 + self._taken_out[3]
        turned = Rotation.from_rotvec(self._taken_out[:3]).as_matrix().T
        result: FloatArray = matrix @ np.diag([longer, longer, 1.0]) @ turned @ np.linalg.inv(matrix)
        return result
