"""Robust motion of a camera against known points: P3P and RANSAC, refined on sights with their points' own doubt.

A pose maps points of the key frame into the camera's axes now: ``q = R p + t``. Perturbed on the left,
``q' = exp(δθ) q + δt``. The residual of a point is its sight less the one foretold; its covariance is the sight's
noise and the point's own covariance seen through the camera: ``S = σ² I + J R Σ Rᵀ Jᵀ``. Weights are those of a
Student distribution, so that what moves by itself hardly pulls (Lange, Little and Taylor 1989).

How far off sights are is a guess of good cameras. Where a shutter rolls, a lens distorts or the view is blurred
all are off by more, and a gate for good ones would call the room a crowd: so the median of what is left scales all.

A landmark is a sight of the key frame, and so is its doubt: there errors are the same near and far. As places they
would be skewed, and their covariance small where noise has put a point too near: it would shorten every motion.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from sensor_gateway.stereo.calibration import FloatArray, StereoCalibration

BoolArray = npt.NDArray[np.bool_]
_RANSAC_PX, _RANSAC_ROUNDS, _RANSAC_SURE = 3.0, 300, 0.999
_STUDENT = 5.0
_GATE = 16.3  # chi-square of three numbers, 0.999
_ROUNDS, _SETTLED = 12, 1e-7
_USUAL, _MOST_SCALE = (
    0.77,
    16.0,
)  # median of chi-square by its numbers, two or three; and how bad sights may be
_NEAREST_M = 0.05
_LEAST_POINTS = 6
_LEAST_OF_DISPARITY = 0.5  # that a shift may leave
_KEPT_DOUBT, _BLIND_PX2 = 1.5, 1e8


@dataclass(frozen=True, slots=True)
class Landmarks:
    """Points (n, 3) m in the key frame's axes, covariances (n, 3, 3) px² of their sights there, and where their
    patches are in its left image (n, 2) px."""

    pixels: FloatArray
    points: FloatArray
    covariances: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def chosen(self, which: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> "Landmarks":
        """Some of them."""
        return Landmarks(self.pixels[which], self.points[which], self.covariances[which])

    def with_more(self, others: "Landmarks") -> "Landmarks":
        """These and others."""
        return Landmarks(
            np.concatenate([self.pixels, others.pixels]),
            np.concatenate([self.points, others.points]),
            np.concatenate([self.covariances, others.covariances]),
        )


@dataclass(frozen=True, slots=True)
class Pose:
    """``q = R p + t``, with the covariance (6, 6) of (δθ, δt) and which landmarks agree (n,).

    ``scale``: how many times as large as expected the sights' variances were.
    """

    rotation: Rotation
    translation: FloatArray
    covariance: FloatArray
    agree: BoolArray
    scale: float = 1.0

    @classmethod
    def none(cls) -> "Pose":
        """The key frame itself."""
        return cls(Rotation.identity(), np.zeros(3), np.zeros((6, 6)), np.zeros(0, dtype=bool))

    def points(self, points: FloatArray) -> FloatArray:
        """Points (n, 3) of the key frame in the camera's axes now."""
        return np.asarray(self.rotation.apply(points) + self.translation)

    @property
    def place(self) -> FloatArray:
        """Where the camera is in the key frame's axes, (3,) m."""
        return np.asarray(-self.rotation.inv().apply(self.translation))

    def after(self, before: "Pose") -> "Pose":
        """This pose, if the key frame is where ``before`` leads."""
        turned = self.rotation.apply(before.translation) + self.translation
        return Pose(self.rotation * before.rotation, turned, self.covariance, self.agree)

    def inverse(self) -> "Pose":
        """The way back (without its doubt)."""
        return Pose(self.rotation.inv(), self.place, np.zeros((6, 6)), self.agree)


def solve(
    calibration: StereoCalibration, landmarks: Landmarks, sights: FloatArray, sigma_px: float, guess: Pose
) -> Pose | None:
    """The pose from which landmarks (n) are seen at sights (n, 3; NaN in the third where the right eye is blind).

    None where fewer than six agree on one.
    """
    starts = [start for start in (_ransac(calibration, landmarks, sights), guess) if start is not None]
    found = [_refined(calibration, landmarks, sights, sigma_px, start) for start in starts]
    solved = [pose for pose in found if pose is not None]
    return max(solved, key=lambda pose: int(pose.agree.sum()), default=None)


def _ransac(calibration: StereoCalibration, landmarks: Landmarks, sights: FloatArray) -> Pose | None:
    if len(landmarks) < _LEAST_POINTS:
        return None
    cv2.setRNGSeed(1)  # the same images give the same motion
    try:
        found, turn, shift, inliers = cv2.solvePnPRansac(
            landmarks.points,
            np.ascontiguousarray(sights[:, :2]),
            calibration.matrix,
            None,
            iterationsCount=_RANSAC_ROUNDS,
            reprojectionError=_RANSAC_PX,
            confidence=_RANSAC_SURE,
            flags=cv2.SOLVEPNP_AP3P,
        )
    except cv2.error:  # degenerate samples: all points on one ray
        return None
    if not found or inliers is None or not (np.isfinite(turn).all() and np.isfinite(shift).all()):
        return None
    return Pose(
        Rotation.from_rotvec(turn[:, 0]),
        shift[:, 0].astype(np.float64),
        np.zeros((6, 6)),
        np.zeros(0, dtype=bool),
    )


def _refined(
    calibration: StereoCalibration, landmarks: Landmarks, sights: FloatArray, sigma_px: float, start: Pose
) -> Pose | None:
    """Gauss–Newton over pose and landmarks from ``start``, each step weighing every landmark anew.

    Landmarks are eliminated (Schur complement); their own best sights are kept from step to step, for a model
    linearised at places with noise would take the motion for shorter than it is.
    """
    pose, shifts = start, np.zeros((len(landmarks), 3))
    for _ in range(_ROUNDS):
        problem = linearised(calibration, landmarks, sights, sigma_px, pose, shifts)
        if problem is None:
            return None
        step: FloatArray = np.linalg.solve(problem.information, problem.gradient).astype(np.float64)
        pose, shifts = _moved(pose, step), problem.shifts(step)
        if float(np.abs(step).max()) < _SETTLED:
            break
    problem = linearised(calibration, landmarks, sights, sigma_px, pose, shifts)
    if problem is None:
        return None
    agree = problem.squared < _GATE * problem.scale
    if agree.sum() < _LEAST_POINTS:
        return None
    spread = max(1.0, float(np.mean(problem.squared[agree] / problem.numbers[agree])))
    covariance: FloatArray = np.linalg.inv(problem.information).astype(np.float64)
    return Pose(pose.rotation, pose.translation, spread * covariance, agree, problem.scale)


@dataclass(frozen=True, slots=True)
class Problem:
    """Normal equations of the pose, (6, 6) and (6,), and by landmark (n): the residual (n, 3), squared in units of
    its covariance, how many numbers it is of, its derivative by the pose, its weight (n, 3, 3), and the gain for
    the landmark's sight in the key frame. ``scale``: of all covariances, by what is left of all."""

    information: FloatArray
    gradient: FloatArray
    residual: FloatArray
    squared: FloatArray
    numbers: FloatArray
    by_pose: FloatArray
    weight: FloatArray
    gain: FloatArray
    scale: float

    def shifts(self, step: FloatArray) -> FloatArray:
        """What sights in the key frame lack, (n, 3) px, once the pose has made a step."""
        left = np.where(self.squared[:, None] < _GATE * self.scale, self.residual - self.by_pose @ step, 0.0)
        return np.asarray(np.einsum("nij,nj->ni", self.gain, left))


def linearised(
    calibration: StereoCalibration,
    landmarks: Landmarks,
    sights: FloatArray,
    sigma_px: float,
    pose: Pose,
    shifts: FloatArray,
) -> Problem | None:
    """The problem at a pose, sights in the key frame shifted by (n, 3) px; None where it has no one solution."""
    known = calibration.sights(landmarks.points)
    flat = calibration.disparity(known + shifts) < _LEAST_OF_DISPARITY * calibration.disparity(known)
    shifts = np.where(flat[:, None], 0.0, shifts)  # beyond what a linear model can tell
    places = calibration.points(known + shifts)
    points = pose.points(places)
    ahead = points[:, 2] > _NEAREST_M
    points[~ahead] = (0.0, 0.0, 1.0)
    blind = ~np.isfinite(sights[:, 2])
    seen = calibration.sight_jacobian(points)
    seen[blind, 2] = 0.0
    turned = seen @ pose.rotation.as_matrix() @ calibration.point_jacobian(places)
    residual = np.where(np.isfinite(sights), sights - calibration.sights(points), 0.0)
    residual += np.einsum("nij,nj->ni", turned, shifts)
    crossed = landmarks.covariances @ np.swapaxes(turned, 1, 2)
    inverse = np.linalg.inv(turned @ crossed + sigma_px**2 * np.eye(3))
    squared = np.einsum("ni,nij,nj->n", residual, inverse, residual)
    numbers = np.where(blind, 2.0, 3.0)
    near = ahead & (np.abs(residual).max(axis=1) < _RANSAC_PX)
    scale = _scale(squared[near] / numbers[near])
    weight = np.where(ahead, (_STUDENT + 3.0) / (_STUDENT + squared / scale), 0.0)
    by_pose = np.concatenate([-seen @ _crosses(points), seen], axis=2)
    weights = weight[:, None, None] * inverse
    whitened = np.swapaxes(by_pose, 1, 2) @ weights
    information = (whitened @ by_pose).sum(axis=0)
    if np.linalg.matrix_rank(information) < 6:
        return None
    gradient = np.einsum("nij,nj->i", whitened, residual)
    squared = np.where(ahead, squared, np.inf)
    gain = crossed @ inverse * ahead[:, None, None]
    return Problem(information, gradient, residual, squared, numbers, by_pose, weights, gain, scale)


def _scale(squared: FloatArray) -> float:
    """How many times as large as expected variances are, by their residuals' squares a number (k,)."""
    if len(squared) < _LEAST_POINTS:
        return 1.0
    return min(max(1.0, float(np.median(squared)) / _USUAL), _MOST_SCALE)


def _crosses(points: FloatArray) -> FloatArray:
    """Matrices (n, 3, 3) of ``p ×``."""
    crosses = np.zeros((len(points), 3, 3))
    x, y, z = points.T
    crosses[:, 0, 1], crosses[:, 0, 2] = -z, y
    crosses[:, 1, 0], crosses[:, 1, 2] = z, -x
    crosses[:, 2, 0], crosses[:, 2, 1] = -y, x
    return crosses


def _moved(pose: Pose, step: FloatArray) -> Pose:
    turn = Rotation.from_rotvec(step[:3])
    shift = turn.apply(pose.translation) + step[3:]
    return Pose(turn * pose.rotation, shift, pose.covariance, pose.agree)


def carried(
    calibration: StereoCalibration, landmarks: Landmarks, sights: FloatArray, pose: Pose, sigma_px: float
) -> Landmarks:
    """Landmarks in the axes of a new key frame from which they were seen at sights (n, 3), averaged with those.

    Their doubt is kept half as large again, for errors of matching live on from frame to frame.
    """
    points = pose.points(landmarks.points)
    foretold = calibration.sights(points)
    blind = ~np.isfinite(sights[:, 2])
    noise = np.tile(pose.scale * sigma_px**2 * np.eye(3), (len(points), 1, 1))
    noise[blind, 2, 2] = _BLIND_PX2
    residual = np.where(np.isfinite(sights), sights - foretold, 0.0)
    for _ in range(2):  # the second time linearised where the average is
        known = calibration.spread(pose.inverse().points(points), _KEPT_DOUBT * landmarks.covariances)
        seen = calibration.sight_jacobian(points) @ pose.rotation.as_matrix()
        prior = seen @ known @ np.swapaxes(seen, 1, 2)
        gain = prior @ np.linalg.inv(prior + noise)
        points = calibration.points(foretold + np.einsum("nij,nj->ni", gain, residual))
    return Landmarks(sights[:, :2].copy(), points, prior - gain @ prior)
