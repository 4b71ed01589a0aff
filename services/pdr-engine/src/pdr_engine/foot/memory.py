"""What the compiled kernel remembers and takes in and gives out: structured records.

A navigator *is* its state record: copying the record copies the navigator. Samples wait in rings until those
behind them are known (a clipped peak's other flank, the rest of a detector's window); counts ``head``,
``clean`` and ``done`` say how far each stage has come, and count & MASK is a sample's place in the rings.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from bootprint.messages import Direction, MotionClass
from pdr_engine.foot.settings import FootSettings

RING = 2048
MASK = RING - 1
STATES = 12
FEATURES, HIDDEN = 20, 10  # of the learned detector
POSITION, VELOCITY, ATTITUDE, LEVER = 0, 3, 6, 9  # first index of each block: m, m/s, rad (nav), m (sensor)
HEADING = ATTITUDE + 2  # rotation error about the vertical
ALIGNING, RUNNING = 0, 1
CLIP_LAG_NS = 35_000_000  # look-ahead of the cleaning stage
LATENCY_NS = 95_000_000  # look-ahead of the whole: the house allows 100 ms
STANCE_END_NS = 20_000_000  # a stance has ended when nothing within this time belongs to it
AID_STATES = 6  # of the outer filter that the magnetometer feeds
AID_PSI, AID_DRIFT, AID_FIELD, AID_IRON = 0, 1, 2, 4  # rad, rad/s, µT (2, nav), µT (2, foot of yaw 0)
STANDING_SWING_NS = 120_000_000  # the foot was not lifted for longer than this
GAP_NS = 50_000_000
LONG_GAP_NS = 1_000_000_000
NS = 1e-9

STATE = np.dtype(
    [
        # stages
        ("mode", "i8"),
        ("start", "i8"),  # first sample of this alignment
        ("head", "i8"),  # samples accepted
        ("clean", "i8"),  # samples whose values are final and whose detector windows have been looked at
        ("judged_ns", "i8"),  # time of the newest verdict of its own
        ("looked", "i8"),  # samples that the learned detector has judged
        ("done", "i8"),  # samples the filter has used
        ("unbroken", "i8"),  # first sample after the last gap
        ("aligned", "i8"),  # 1 once the attitude's reference is known
        ("began", "i8"),  # 1 once the first sample has been used
        ("lost_since_ns", "i8"),  # time of the last good state before a fault
        ("flushing", "i8"),  # 1 at the end of the stream: wait for nothing
        ("time_ns", "i8", RING),
        ("accel", "f8", (RING, 3)),
        ("gyro", "f8", (RING, 3)),
        ("mag", "f8", (RING, 3)),  # µT, NaN where unknown
        ("clipped", "u1", (RING, 3)),  # the gyro's axis is at its limit
        ("rebuilt", "f8", (RING, 3)),  # by how much, rad/s
        ("cut_force", "u1", (RING, 3)),  # so is the accelerometer's
        ("filled", "u1", RING),  # never came: interpolated
        ("still", "u1", RING),
        ("sums", "f8", (RING, 8)),  # running sums for the learned detector
        ("sigma", "f8", RING),  # scale of the sole's velocity, m/s, if learned
        ("motion", "f8", (RING, 2)),  # its mean, m/s, along the step's way and up, if learned
        ("doubt", "f8", RING),  # detector's statistic over its threshold: below 1 is stance
        ("usual_ns", "f8"),  # the interval between samples: its median
        ("cut_level", "f8", 3),  # of the gyro's open plateaus; 0 if there is none
        ("cut_first", "i8", 3),  # their first samples
        ("force_top", "f8", (3, 2)),  # the largest force so far along each axis, and against it
        ("force_hits", "i8", (3, 2)),  # samples that came as high
        # detector
        ("last_still_ns", "i8"),  # end of the newest window that was stance
        ("calm_since_ns", "i8"),
        ("interval_s", "f8"),  # running mean of the sampling interval
        ("rate_hz", "f8"),  # its inverse
        ("features", "f8", FEATURES),
        # filter: nominal state, covariance of the error state, work space
        ("position", "f8", 3),
        ("velocity", "f8", 3),
        ("attitude", "f8", 4),  # quaternion w x y z, sensor to nav
        ("lever", "f8", 3),
        ("P", "f8", (STATES, STATES)),
        ("reference", "f8", 4),  # attitude that has yaw 0: the first alignment's
        ("yaw", "f8"),
        ("gravity", "f8"),
        ("gravity_s", "f8"),  # seconds at rest that it is the mean of
        ("accel_noise", "f8"),  # as set, or as heard at rest
        ("gyro_noise", "f8"),
        ("accel_white", "f8"),  # squares of the sensor's own densities, as heard
        ("gyro_white", "f8"),
        ("listened_s", "f8"),
        ("bias", "f8", 3),
        ("bias_variance", "f8"),
        ("nis", "f8"),  # of the newest update: innovation squared, in units of its covariance
        ("cross", "f8", (STATES, 3)),  # P Hᵀ
        ("gain", "f8", (STATES, 3)),
        ("H", "f8", (3, STATES)),
        ("S", "f8", (3, 3)),
        ("force", "f8", 3),  # specific force in nav axes
        ("rate", "f8", 3),
        # the running stop, for the gyro bias
        ("stop_samples", "i8"),
        ("stop_since_ns", "i8"),
        ("stop_block", "i8"),  # first sample of the running block
        ("stop_kind", "i8"),  # of rest
        ("stop_sum", "f8", 3),
        ("stop_unrest", "f8"),
        ("stop_bias", "f8", 3),  # as it was when the stop began
        ("stop_variance", "f8"),
        # the running step
        ("step_time_ns", "i8"),
        ("step_position", "f8", 3),
        ("step_yaw", "f8"),
        ("step_swing_ns", "i8"),
        ("stance_since_ns", "i8"),
        ("stance_samples", "i8"),
        ("stance_doubt", "f8"),
        ("in_stance", "i8"),
        ("realigned", "i8"),
        # what the running stride is like (`strides`)
        ("flight", "f8", (RING, 3)),  # the foot's place in swing, m
        ("predicted", "f8", 3),  # place before the update at hand
        ("correction", "f8", 3),  # what updates have moved the place by since the foot landed, m
        ("swing", "i8"),  # first sample of the step's first swing, and of its newest
        ("lifted", "i8"),
        ("landed", "i8"),  # last sample of its newest; none if below ``lifted``
        ("rest_since_ns", "i8"),  # the stance that is or was last
        ("rest_until_ns", "i8"),
        ("up", "f8", 3),  # sum of the vertical in sensor axes over that stance
        ("worst_nis", "f8"),  # of the step, in that stance
        ("rest_up", "f8", 3),  # the vertical in sensor axes when the foot was lifted
        ("steep_up", "f8", 3),  # ... and when it was tilted most against that
        ("steep_cosine", "f8"),
        ("peak_rate", "f8"),  # squares, in the step's swing: (rad/s)², (m/s²)²
        ("peak_force", "f8"),
        ("cut_angle", "f8"),  # variance of what the gyro's cut peaks may have taken along in it, rad²
        ("cut_turn", "f8"),  # ... of that about the vertical
        # how this foot usually is (`motion`)
        ("upright", "f8", 3),  # the vertical in sensor axes when it stands flat
        ("last_up", "f8", 3),  # the same in the stance before
        ("unsteady", "f8"),  # running mean square of the angle between stances, rad²
        ("ahead", "f8", 2),  # where its toes point, in the heading's axes; the longer, the surer
        # the stance's field, and the outer filter that holds the heading (µT, m, rad, s)
        ("field_sum", "f8", 3),
        ("field_square", "f8"),
        ("field_samples", "i8"),
        ("field", "f8", 3),  # mean over the stance, nav axes
        ("field_strength", "f8"),  # its mean square: the sensor's own, whatever the attitude
        ("field_scatter", "f8"),
        ("fresh", "f8"),  # how new this place is: 0 at the same spot, 1 far away
        ("places", "f8"),  # how many independent places have been judged, the older ones counting less
        ("deviation", "f8"),  # this place's square from what is usual
        ("disturbance_sum", "f8"),
        ("disturbance", "f8"),  # variance of one component from place to place
        ("usual_horizontal", "f8"),
        ("usual_vertical", "f8"),
        ("judged_place", "f8", 3),
        ("aid_known", "i8"),  # 1 once there is a reference
        ("aid_place", "f8", 3),  # where the field was last used
        ("aid_x", "f8", AID_STATES),
        ("aid_P", "f8", (AID_STATES, AID_STATES)),
        ("aid_h", "f8", AID_STATES),
        ("aid_cross", "f8", AID_STATES),
        ("aid_bias", "f8", 3),  # the gyro bias that the drift counts from
        ("aid_bias_variance", "f8"),
        ("magnetic_azimuth", "f8"),
        ("magnetic_variance", "f8"),
        ("fields_used", "i8"),
        ("fields_refused", "i8"),
        # counts
        ("estimates", "i8"),
        ("steps", "i8"),
        ("accepted", "i8"),
        ("dropped", "i8"),
        ("dropped_in_a_row", "i8"),
        ("gaps", "i8"),
        ("missing", "i8"),
        ("clippings", "i8"),
        ("force_clippings", "i8"),
        ("stances", "i8"),
        ("contradictions", "i8"),
        ("realignments", "i8"),
    ],
    align=True,
)

SAMPLE = np.dtype([("time_ns", "i8"), ("accel", "f8", 3), ("gyro", "f8", 3), ("mag", "f8", 3)], align=True)

ESTIMATE = np.dtype(
    [
        ("time_ns", "i8"),
        ("position_m", "f8", 3),
        ("speed_m_s", "f8"),
        ("attitude", "f8", 4),
        ("yaw_rad", "f8"),
        ("stance", "?"),
    ],
    align=True,
)

STEP = np.dtype(
    [
        ("start_time_ns", "i8"),
        ("time_ns", "i8"),
        ("displacement_m", "f8", 3),
        ("heading_change_rad", "f8"),
        ("covariance", "f8", (4, 4)),
        ("swing_ns", "i8"),
        ("doubt", "f8"),
        ("realigned", "?"),
        ("stance_ns", "i8"),  # the stance at the step's end
        ("clearance_m", "f8"),
        ("nis", "f8"),  # worst in that stance
        ("tilt_rad", "f8"),  # of the resting foot against one that stands flat
        ("pitch_rad", "f8"),  # largest tilt in swing against the stance before
        ("unsteady_rad", "f8"),
        ("peak_rate_rad_s", "f8"),
        ("peak_force_m_s2", "f8"),
        ("cut_rad", "f8"),  # 1 sigma of the angle that the gyro's cut peaks may have taken along
        ("cut_turn_rad", "f8"),  # ... of that about the vertical
        ("quality_pct", "f8"),
        # 1 sigma of what all steps share: of the length, of the ground's slope, a turn
        ("common_scale", "f8"),
        ("common_slope", "f8"),
        ("common_turn_rad_s", "f8"),
        ("motion", "i8"),  # place in MOTIONS
        ("direction", "i8"),  # place in DIRECTIONS
        ("magnetic_azimuth", "f8"),  # of the step's axes at its end; NaN where unknown
        ("magnetic_variance", "f8"),
    ],
    align=True,
)

MOTIONS: tuple[MotionClass, ...] = ("standing", "walking", "running", "stairs", "crawling", "unknown")
STANDING, WALKING, RUNNING_GAIT, STAIRS, CRAWLING, UNKNOWN = range(6)
DIRECTIONS: tuple[Direction | None, ...] = (None, "forward", "left", "backward", "right")


def fresh_state(settings: FootSettings) -> npt.NDArray[Any]:
    """The state before the first sample: `STATE`, shape (1,)."""
    record = np.zeros(1, STATE)
    record["bias_variance"] = settings.alignment.bias_sigma_rad_s**2
    record["accel_noise"] = settings.filter.accel_noise_m_s2_sqrt_hz
    record["gyro_noise"] = settings.filter.gyro_noise_rad_s_sqrt_hz
    record["attitude"][0, 0] = 1.0
    record["gravity"] = 9.81
    return record
