"""MAVLink visual odometry as camera motion: VISION_POSITION_DELTA, and differences of successive ODOMETRY poses.

MAVLink's body axes are forward, right, down; ours forward, left, up: the last two components change sign.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion, Float64Array, Vector3

_BODY_FRAMES = (8, 12)  # MAV_FRAME_BODY_NED (as older senders say), MAV_FRAME_BODY_FRD
_WORLD_FRAMES = (1, 20)  # MAV_FRAME_LOCAL_NED, MAV_FRAME_LOCAL_FRD
_FAILED = -1


def from_vision_delta(message: Any, device_ns: int) -> CameraMotion:
    """VISION_POSITION_DELTA, whose translation is told in the axes at the *end*, turned back to the start's."""
    turn = Rotation.from_rotvec(message.angle_delta)
    return CameraMotion(
        time_ns=device_ns,
        start_time_ns=device_ns - message.time_delta_usec * 1000,
        translation_m=_flu(turn.apply(message.position_delta)),
        rotation_rad=_flu(np.asarray(message.angle_delta)),
        confidence_pct=min(100.0, max(0.0, message.confidence)),
    )


@dataclass(frozen=True, slots=True)
class _Pose:
    device_ns: int
    reset_counter: int
    position_m: Float64Array
    attitude: Rotation


class OdometryDifference:
    """Turns absolute ODOMETRY poses of one camera into motions between them.

    The pose's covariance is that of the whole way since the start, so the motion's stays unknown.
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._last: _Pose | None = None

    def motion(self, message: Any, device_ns: int) -> CameraMotion | None:
        """The motion since the pose before; None at the start, after a reset, and when odometry failed."""
        before, self._last = self._last, self._pose(message, device_ns)
        if before is None or self._last is None or device_ns <= before.device_ns:
            return None
        if self._last.reset_counter != before.reset_counter:
            self._counts["odometry_resets"] += 1
            return None
        back = before.attitude.inv()
        return CameraMotion(
            time_ns=device_ns,
            start_time_ns=before.device_ns,
            translation_m=_flu(back.apply(self._last.position_m - before.position_m)),
            rotation_rad=_flu((back * self._last.attitude).as_rotvec()),
            confidence_pct=float(message.quality) if message.quality > 0 else None,
        )

    def _pose(self, message: Any, device_ns: int) -> _Pose | None:
        if message.quality == _FAILED:
            self._counts["odometry_failed"] += 1
            return None
        if message.frame_id not in _WORLD_FRAMES or message.child_frame_id not in _BODY_FRAMES:
            self._counts["odometry_frame_unsupported"] += 1
            return None
        w, x, y, z = message.q
        values = np.array([message.x, message.y, message.z, w, x, y, z])
        if not np.isfinite(values).all() or not values[3:].any():
            self._counts["not_finite"] += 1
            return None
        return _Pose(device_ns, message.reset_counter, values[:3], Rotation.from_quat([x, y, z, w]))


def _flu(frd: Float64Array) -> Vector3:
    forward, right, down = (float(value) for value in frd)
    return forward, -right, -down
