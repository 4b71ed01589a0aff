"""How far the right eye is turned in, by what a motion shows of near and far landmarks.

An eye that is turned in about the vertical by ω shifts what it sees by ``f ω (1 + x²)``, nearly alike everywhere:
no row tells of it, and all depths are wrong, the far ones most. But then near and far landmarks disagree on how
far the camera has moved. So ω is solved for beside the pose: with residuals ``r``, their derivatives ``B`` by the
pose and ``c`` by ω (of the sight now, and through the landmark of the key frame's), all weighed by W,

    (cᵀWc − cᵀWB (BᵀWB)⁻¹ BᵀWc) ω = cᵀWr − cᵀWB (BᵀWB)⁻¹ BᵀWr,

whose left side is ω's information.
"""

import numpy as np

from sensor_gateway.stereo.calibration import FloatArray, StereoCalibration
from sensor_gateway.stereo.motion import Landmarks, Pose, Problem, linearised

_ROUNDS = 2  # until landmarks are where they fit best, the last pose being settled


def turned_in(
    calibration: StereoCalibration, landmarks: Landmarks, sights: FloatArray, pose: Pose, sigma_px: float
) -> tuple[float, float] | None:
    """ω, rad, about the camera's down axis, and its variance; None where nothing tells of it.

    ``landmarks`` (n) of the key frame were seen at ``sights`` (n, 3; NaN where the right eye is blind) from
    ``pose``.
    """
    shifts = np.zeros((len(landmarks), 3))
    for _ in range(_ROUNDS):
        problem = linearised(calibration, landmarks, sights, sigma_px, pose, shifts)
        if problem is None:
            return None
        shifts = problem.shifts(np.zeros(6))
    problem = linearised(calibration, landmarks, sights, sigma_px, pose, shifts)
    known = calibration.sights(landmarks.points) + shifts
    return None if problem is None else _solved(problem, _by_turn(calibration, known, sights, pose))


def _by_turn(calibration: StereoCalibration, known: FloatArray, sights: FloatArray, pose: Pose) -> FloatArray:
    """Derivatives (n, 3) px/rad of the residuals by ω; sights (n, 3) known of the key frame, and seen now."""
    blind = ~np.isfinite(sights[:, 2])
    places = calibration.points(known)
    seen = calibration.sight_jacobian(pose.points(places))
    seen[blind, 2] = 0.0
    turned = seen @ pose.rotation.as_matrix() @ calibration.point_jacobian(places)
    by_turn: FloatArray = -turned[:, :, 2] * _across(calibration, known)[:, None]
    by_turn[:, 2] += np.where(blind, 0.0, _across(calibration, sights))
    return by_turn


def _across(calibration: StereoCalibration, sights: FloatArray) -> FloatArray:
    """By how much (n,) px/rad a turned right eye sees things further right than a straight one."""
    x = (sights[:, 2] - calibration.right_centre_x_px) / calibration.focal_x_px
    return np.asarray(-calibration.focal_x_px * (1.0 + x**2))


def _solved(problem: Problem, by_turn: FloatArray) -> tuple[float, float] | None:
    weighed = np.einsum("nij,nj->ni", problem.weight, by_turn)
    mixed = np.einsum("ni,nij->j", weighed, problem.by_pose)
    share: FloatArray = np.linalg.solve(problem.information, mixed).astype(np.float64)
    information = float((weighed * by_turn).sum() - mixed @ share)
    if not information > 0.0:
        return None
    told = float((weighed * problem.residual).sum() - share @ problem.gradient)
    return told / information, problem.scale / information
