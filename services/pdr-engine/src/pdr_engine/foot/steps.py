"""Foot steps: what the stream hands over from stance to stance, for the rest of the house."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from bootprint.messages import Direction, Float64Array, MotionClass
from pdr_engine.foot.memory import DIRECTIONS, MOTIONS, NS


@dataclass(frozen=True, slots=True)
class FootStepEstimate:
    """One step: from the foot's last reported stance (``start_time_ns``) to this one (``time_ns``).

    ``displacement_m`` (3,): forward, left, up in the foot's heading at the start. ``heading_change_rad``: yaw,
    counter-clockwise. ``direction``: of the displacement against the toes, None if unknown.

    ``covariance`` (4, 4) of (forward m, left m, up m, heading rad). Of it all steps share ``common_scale_sigma`` of
    the displacement, ``common_slope_sigma`` of the way across the ground (upwards) and ``common_turn_sigma_rad_s``
    of the duration; the rest is independent of the step before.

    ``clearance_m``: largest height of the sensor above the line between the stances; ``swing_s``: how long it
    moved; ``stance_s``: how long it had rested at the end. ``stance_quality``: 0 to 100, how far below its
    threshold the detector was; ``landing_nis``: largest normalised innovation squared (3 components) of the stance
    at the end; ``quality_pct``: both. ``realigned``: the stream broke within this step, so it does not tell the
    whole way. ``magnetic_azimuth_rad``: of the step's forward axis at its end, clockwise from *magnetic* north,
    None unless the field could be trusted.
    """

    start_time_ns: int
    time_ns: int
    displacement_m: Float64Array
    heading_change_rad: float
    covariance: Float64Array
    motion: MotionClass
    direction: Direction | None
    clearance_m: float
    swing_s: float
    stance_s: float
    stance_quality: float
    landing_nis: float
    quality_pct: float
    common_scale_sigma: float
    common_slope_sigma: float
    common_turn_sigma_rad_s: float
    realigned: bool
    magnetic_azimuth_rad: float | None = None
    magnetic_azimuth_sigma_rad: float | None = None

    @property
    def length_m(self) -> float:
        """From stance to stance in space."""
        return math.hypot(*self.displacement_m)

    @property
    def horizontal_length_m(self) -> float:
        """From stance to stance across the ground."""
        return math.hypot(*self.displacement_m[:2])


def step_from_row(row: np.void | Any) -> FootStepEstimate:
    """A row of the kernel's `STEP` table as an estimate of its own (nothing shared with the table)."""
    variance = float(row["magnetic_variance"])
    told = math.isfinite(variance)
    return FootStepEstimate(
        start_time_ns=int(row["start_time_ns"]),
        time_ns=int(row["time_ns"]),
        displacement_m=np.array(row["displacement_m"]),
        heading_change_rad=float(row["heading_change_rad"]),
        covariance=np.array(row["covariance"]),
        motion=MOTIONS[int(row["motion"])],
        direction=DIRECTIONS[int(row["direction"])],
        clearance_m=float(row["clearance_m"]),
        swing_s=float(row["swing_ns"]) * NS,
        stance_s=float(row["stance_ns"]) * NS,
        stance_quality=100.0 * (1.0 - min(1.0, float(row["doubt"]))),
        landing_nis=float(row["nis"]),
        quality_pct=float(row["quality_pct"]),
        common_scale_sigma=float(row["common_scale"]),
        common_slope_sigma=float(row["common_slope"]),
        common_turn_sigma_rad_s=float(row["common_turn_rad_s"]),
        realigned=bool(row["realigned"]),
        magnetic_azimuth_rad=float(row["magnetic_azimuth"]) if told else None,
        magnetic_azimuth_sigma_rad=math.sqrt(variance) if told else None,
    )
