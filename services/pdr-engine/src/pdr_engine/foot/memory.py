"""What the compiled kernel remembers: one structured record for its state, one for its parameters.

A navigator *is* its state record: copying the record copies the navigator. Samples wait in rings until those
behind them are known (a clipped peak's other flank, the rest of a detector's window); counts ``head``,
``clean`` and ``done`` say how far each stage has come, and count & MASK is a sample's place in the rings.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from bootprint.messages import Direction, MotionClass
from pdr_engine.foot.settings import METHODS, UNCALIBRATED, FootSettings, MagnetometerCalibration

RING = 2048
MASK = RING - 1
STATES = 12
FEATURES, HIDDEN = 20, 10  # of the learned detector
POSITION, VELOCITY, ATTITUDE, LEVER = (
    0,
    3,
    6,
    9,
)  # first index of each block: m, m/s, rad (all nav), m (sensor)
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
        ("clipped", "u1", (RING, 3)),
        ("still", "u1", RING),
        ("sums", "f8", (RING, 8)),  # running sums for the learned detector
        ("sigma", "f8", RING),  # scale of the foot's velocity, m/s, if learned
        ("doubt", "f8", RING),  # detector's statistic over its threshold: below 1 is stance
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
        ("bias", "f8", 3),
        ("bias_variance", "f8"),
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
        ("nis", "f8"),  # of the newest update, and the worst of the step in that stance
        ("worst_nis", "f8"),
        ("rest_up", "f8", 3),  # the vertical in sensor axes when the foot was lifted
        ("steep_up", "f8", 3),  # ... and when it was tilted most against that
        ("steep_cosine", "f8"),
        ("peak_rate", "f8"),  # squares, in the step's swing: (rad/s)², (m/s²)²
        ("peak_force", "f8"),
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
        ("clippings", "i8"),
        ("stances", "i8"),
        ("realignments", "i8"),
    ],
    align=True,
)

SAMPLE = np.dtype([("time_ns", "i8"), ("accel", "f8", 3), ("gyro", "f8", 3), ("mag", "f8", 3)], align=True)

ESTIMATE = np.dtype(
    [("time_ns", "i8"), ("position_m", "f8", 3), ("speed_m_s", "f8"), ("yaw_rad", "f8"), ("stance", "?")],
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
        ("quality_pct", "f8"),
        (
            "common_scale",
            "f8",
        ),  # 1 sigma of what all steps share: of the length, of the ground's slope, a turn
        ("common_slope", "f8"),
        ("common_turn_rad_s", "f8"),
        ("motion", "i8"),  # place in MOTIONS
        ("direction", "i8"),  # place in DIRECTIONS
        ("magnetic_azimuth", "f8"),  # of the step's axes at its end; NaN where unknown
        ("magnetic_variance", "f8"),
    ],
    align=True,
)

_FLOATS = (
    # filter
    *("accel_noise", "gyro_noise", "accel_scale", "gyro_scale", "velocity_sigma", "gate"),
    *("lever_sigma", "lever_walk", "clip_rate", "clip_noise", "gap_accel", "gap_rate", "max_speed"),
    *("learned_noise", "hidden_motion", "step_scale"),
    # detector
    *("accel_weight", "gyro_weight", "threshold", "growth_rate", "growth_hold"),
    # alignment
    *("still_accel_std", "still_gyro_std", "still_rate", "still_gravity", "tilt_sigma", "quiet_tilt_sigma"),
    *("sway", "bias_walk"),
    # magnetometer
    *("mag_floor", "mag_prior", "mag_disturbed", "mag_correlation", "mag_steadiness", "mag_iron", "mag_gate"),
    *("mag_drift_sigma", "earth_horizontal", "earth_vertical"),
)
_INTEGERS = (
    "method",
    "window_ns",
    "calm_hold_ns",
    "still_window_ns",
    "patience_ns",
    "stop_ns",
    "report_ns",
    "mag_use",
)
_TABLES = (("mag_offset", "f8", 3), ("mag_matrix", "f8", (3, 3)))
PARAMETERS = np.dtype(
    [*((name, "f8") for name in _FLOATS), *((name, "i8") for name in _INTEGERS), *_TABLES], align=True
)

MOTIONS: tuple[MotionClass, ...] = ("standing", "walking", "running", "stairs", "crawling", "unknown")
STANDING, WALKING, RUNNING_GAIT, STAIRS, CRAWLING, UNKNOWN = range(6)
DIRECTIONS: tuple[Direction | None, ...] = (None, "forward", "left", "backward", "right")
LEARNED, ADAPTIVE, SHOE, GYRO, DIFFERENTIAL, ARED = range(6)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _detector_values(settings: FootSettings) -> dict[str, float]:
    d = settings.detector
    thresholds = {
        "learned": d.learned_sigma_m_s,
        "adaptive": d.adaptive_threshold,
        "shoe": d.shoe_threshold,
        "gyro": d.gyro_rms_rad_s**2,
        "differential": d.differential_sum_m_s2,
        "ared": d.ared_threshold,
    }
    windows = {"gyro": d.gyro_window_s, "differential": d.differential_window_s}
    return {
        "method": METHODS.index(settings.method),
        "accel_weight": d.shoe_accel_sigma_m_s2**-2,
        "gyro_weight": d.shoe_gyro_sigma_rad_s**-2,
        "threshold": thresholds[settings.method],
        "growth_rate": d.adaptive_rate_per_s,
        "growth_hold": d.adaptive_hold_s,
        "window_ns": _ns(windows.get(settings.method, d.shoe_window_s)),
        "calm_hold_ns": _ns(d.differential_hold_s),
    }


def _alignment_values(settings: FootSettings) -> dict[str, float]:
    a = settings.alignment
    return {
        "still_accel_std": a.accel_std_m_s2,
        "still_gyro_std": a.gyro_std_rad_s,
        "still_rate": a.rate_rad_s,
        "still_gravity": a.gravity_tolerance_m_s2,
        "tilt_sigma": a.tilt_sigma_rad,
        "quiet_tilt_sigma": a.quiet_tilt_sigma_rad,
        "sway": a.sway_rad,
        "bias_walk": a.bias_walk_rad_s_sqrt_s,
        "still_window_ns": _ns(a.window_s),
        "patience_ns": _ns(a.patience_s),
        "stop_ns": _ns(a.stop_s),
    }


def _filter_values(settings: FootSettings) -> dict[str, float]:
    f = settings.filter
    return {
        "accel_noise": f.accel_noise_m_s2_sqrt_hz,
        "gyro_noise": f.gyro_noise_rad_s_sqrt_hz,
        "accel_scale": f.accel_scale_sqrt_s,
        "gyro_scale": f.gyro_scale_sqrt_s,
        "velocity_sigma": f.zero_velocity_sigma_m_s,
        "gate": f.gate,
        "lever_sigma": f.lever_sigma_m,
        "lever_walk": f.lever_walk_m_sqrt_s,
        "clip_rate": f.clip_rad_s,
        "clip_noise": f.clip_noise_rad_s_sqrt_hz,
        "gap_accel": f.gap_accel_m_s2,
        "gap_rate": f.gap_rate_rad_s,
        "max_speed": f.max_speed_m_s,
        "learned_noise": f.learned_noise,
        "hidden_motion": f.hidden_motion_s,
        "step_scale": f.step_scale,
        "report_ns": _ns(settings.standing_report_s),
    }


def _magnetometer_values(settings: FootSettings) -> dict[str, float]:
    m = settings.magnetometer
    return {
        "mag_use": m.use,
        "mag_floor": m.disturbance_floor_ut,
        "mag_prior": m.disturbance_prior_ut,
        "mag_disturbed": m.disturbed_share,
        "mag_correlation": m.correlation_m,
        "mag_steadiness": m.steadiness_ut,
        "mag_gate": m.gate,
        "mag_drift_sigma": m.drift_sigma_rad_s,
    }


def parameters(
    settings: FootSettings, calibration: MagnetometerCalibration = UNCALIBRATED
) -> npt.NDArray[Any]:
    """The settings as the kernel reads them: `PARAMETERS`, shape (1,)."""
    record = np.zeros(1, PARAMETERS)
    values = _detector_values(settings) | _alignment_values(settings) | _filter_values(settings)
    for name, value in (values | _magnetometer_values(settings)).items():
        record[name] = value
    m = settings.magnetometer
    record["mag_iron"] = m.uncalibrated_iron_ut if calibration == UNCALIBRATED else m.iron_ut
    record["mag_offset"] = calibration.offset_ut
    record["mag_matrix"] = calibration.matrix
    return record


def fresh_state(settings: FootSettings) -> npt.NDArray[Any]:
    """The state before the first sample: `STATE`, shape (1,)."""
    record = np.zeros(1, STATE)
    record["bias_variance"] = settings.alignment.bias_sigma_rad_s**2
    record["attitude"][0, 0] = 1.0
    record["gravity"] = 9.81
    return record
