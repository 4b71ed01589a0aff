"""Foot steps: what the stream hands over from stance to stance, for the rest of the house."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from bootprint.messages import Float64Array, MotionClass

STANDING_SWING_S = 0.12  # the foot was not lifted for longer than this
STANDING_DISTANCE_M = 0.05
RUNNING_SPEED_M_S = 2.2  # people go over from walking to running at about 2 m/s


@dataclass(frozen=True, slots=True)
class FootStepEstimate:
    """One step: from the foot's last reported stance (``start_time_ns``) to this one (``time_ns``).

    ``displacement_m`` (3,): forward, left, up in the foot's heading at the start. ``heading_change_rad``: yaw,
    counter-clockwise. ``covariance`` (4, 4) of (forward m, left m, up m, heading rad), independent of the step
    before. ``stance_quality``: 0 to 100, how far below its threshold the detector was. ``realigned``: the
    stream broke within this step, so it does not tell the whole way.
    """

    start_time_ns: int
    time_ns: int
    displacement_m: Float64Array
    heading_change_rad: float
    covariance: Float64Array
    motion: MotionClass
    stance_quality: float
    realigned: bool


def motion_class(
    displacement_m: Float64Array, duration_s: float, swing_s: float, realigned: bool
) -> MotionClass:
    """How the foot moved: unknown across a fault, standing if hardly lifted, running by the stride's mean speed."""
    distance_m = math.hypot(*displacement_m)
    if realigned:
        return "unknown"
    if swing_s < STANDING_SWING_S or distance_m < STANDING_DISTANCE_M:
        return "standing"
    return "running" if distance_m > RUNNING_SPEED_M_S * duration_s else "walking"


def step_from_row(row: np.void | Any) -> FootStepEstimate:
    """A row of the kernel's `STEP` table as an estimate of its own (nothing shared with the table)."""
    displacement_m = np.array(row["displacement_m"])
    realigned = bool(row["realigned"])
    duration_s = float(row["time_ns"] - row["start_time_ns"]) * 1e-9
    return FootStepEstimate(
        start_time_ns=int(row["start_time_ns"]),
        time_ns=int(row["time_ns"]),
        displacement_m=displacement_m,
        heading_change_rad=float(row["heading_change_rad"]),
        covariance=np.array(row["covariance"]),
        motion=motion_class(displacement_m, duration_s, float(row["swing_ns"]) * 1e-9, realigned),
        stance_quality=100.0 * (1.0 - min(1.0, float(row["doubt"]))),
        realigned=realigned,
    )
