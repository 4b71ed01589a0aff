"""Motions of one camera put end to end: steps of a chain, and how far it has come since the last of them.

A motion that starts where the last one did replaces it (odometry tells everything since its key frame); one that
starts where the last one ended makes that one a finished step; one that starts later leaves a gap that nobody saw.
Attitude goes along, so that every step is level (`fusion.models.camera`).
"""

import math
from dataclasses import dataclass

import numpy as np

from bootprint.messages import CameraMotion, Vector3
from fusion.models import camera
from fusion.state import Array

_SHARE, _TURN_SHARE = 0.05, 0.05  # sigma of a motion that states none
_FLOOR = (0.001, 0.0003)  # m, rad: no motion is known better
_LARGEST = 1e6


@dataclass(frozen=True, slots=True)
class CameraStep:
    """A level displacement (forward, left, up m) and heading change (rad) with covariance (4, 4).

    ``gap_s``: how long before it nobody saw where the camera went.
    """

    start_ns: int
    time_ns: int
    displacement_m: Vector3
    turn_rad: float
    covariance: Array
    gap_s: float = 0.0


class CameraChain:
    """One camera. ``attitude`` (3, 3): body to level where the newest finished step ended."""

    def __init__(self, attitude: Array | None = None) -> None:
        self.attitude: Array = np.eye(3) if attitude is None else attitude
        self._last: CameraMotion | None = None
        self._gap_s = 0.0  # before the motion that is not finished

    def take(self, motion: CameraMotion) -> CameraStep | None:
        """The step that this motion shows to be finished, if it does; a motion out of order is left out."""
        last = self._last
        if last is None:
            self._begin(motion)
            return None
        if motion.start_time_ns < last.time_ns:
            if motion.start_time_ns == last.start_time_ns and motion.time_ns > last.time_ns:
                self._last = motion
            return None
        finished = self.finish()
        self._begin(motion)
        self._gap_s = (motion.start_time_ns - last.time_ns) / 1e9
        return finished

    def _begin(self, motion: CameraMotion) -> None:
        """This motion starts where the last step ended; if it tells where up is, the attitude obeys."""
        self._last = motion
        if motion.up is not None:
            self.attitude = camera.levelled(self.attitude, motion.up)

    def pending(self) -> CameraStep | None:
        """The newest motion, as a step that is not finished."""
        if self._last is None:
            return None
        displacement, turn = camera.level_step(self.attitude, self._last)
        stated = camera.stated_covariance(self._last, _SHARE, _TURN_SHARE, _FLOOR)
        covariance = camera.step_covariance(self.attitude, self._last, stated)
        start_ns, time_ns = self._last.start_time_ns, self._last.time_ns
        return CameraStep(start_ns, time_ns, displacement, turn, covariance, self._gap_s)

    def finish(self) -> CameraStep | None:
        """Make the newest motion a step."""
        step = self.pending()
        if step is not None and self._last is not None:
            self.attitude = self.attitude @ camera.turn_matrix(self._last.rotation_rad)
            self._last, self._gap_s = None, 0.0
        return step

    def tilt(self, turn: Array) -> None:
        """The level was misjudged: turn the attitude by a small rotation vector (3,), rad, in level axes."""
        self.attitude = camera.turn_matrix(turn) @ self.attitude


def is_plausible(step: CameraStep, max_speed_m_s: float) -> bool:
    """Whether somebody on foot can have moved so, and the covariance is one."""
    duration_s = max((step.time_ns - step.start_ns) / 1e9, 0.05)
    sane = bool(np.isfinite(step.covariance).all() and np.abs(step.covariance).max() < _LARGEST)
    return sane and math.hypot(*step.displacement_m) <= max_speed_m_s * duration_s
