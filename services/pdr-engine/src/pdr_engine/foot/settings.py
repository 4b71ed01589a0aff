"""What can be set on the foot INS, with the defaults and where they come from.

Times are seconds and noise is given as a spectral density, so that nothing depends on the sensor's rate. The
noise defaults are for the MicroStrain 3DM-GX class on a shoe.
"""

from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from pdr_engine.foot.presets import REFERENCE, Sensor, alignment_for, filter_for

Method = Literal["learned", "adaptive", "shoe", "gyro", "differential", "ared"]
METHODS: tuple[str, ...] = ("learned", "adaptive", "shoe", "gyro", "differential", "ared")

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]


class DetectorSettings(Config, frozen=True):
    """Thresholds of the stance detectors."""

    # SHOE (Skog 2010): generalised likelihood ratio over 25 ms, the study's weights (REFERENCES.md).
    shoe_window_s: Positive = 0.025
    shoe_accel_sigma_m_s2: Positive = 0.00098
    shoe_gyro_sigma_rad_s: Positive = 8.7e-5
    shoe_threshold: Positive = 8.5e7  # the fixed threshold of pyshoe
    # The default: a small network tells how fast the foot may be moving; slower than this is stance.
    learned_sigma_m_s: Positive = 0.16
    # SHOE whose threshold waits after a zero-velocity update and then grows exponentially.
    adaptive_threshold: Positive = 1e7
    adaptive_hold_s: NonNegative = 0.5
    adaptive_rate_per_s: NonNegative = 3.0
    # D2 (FOI soldiers): RMS of the angular rate over 5 samples at 100 Hz.
    gyro_window_s: Positive = 0.05
    gyro_rms_rad_s: Positive = 0.3
    # ARED: energy of the angular rate over the SHOE window, in the gyro's own sigmas.
    ared_threshold: Positive = 3e7
    # C1: the acceleration's total variation in a sliding window (SWS), small for more than ``hold`` in a row.
    differential_window_s: Positive = 0.05
    differential_sum_m_s2: Positive = 1.5
    differential_hold_s: NonNegative = 0.02


class AlignmentSettings(Config, frozen=True):
    """When the foot counts as verified still, and how sure its attitude and gyro bias are then."""

    window_s: Positive = 0.25
    patience_s: Positive = 1.0  # without such a window by then, align on the quietest moment
    accel_std_m_s2: Positive = 0.12
    gyro_std_rad_s: Positive = 0.05
    rate_rad_s: Positive = 0.02  # a mean rate above this is a turn, not a bias (four of its sigmas)
    gravity_tolerance_m_s2: Positive = 0.5
    tilt_sigma_rad: Positive = 0.01
    quiet_tilt_sigma_rad: Positive = 0.03  # 0.3 m/s² of motion taken for gravity
    sway_rad: Positive = 0.0008  # a standing foot rocks by this much: a mean over T is a bias ± sway/T
    bias_sigma_rad_s: Positive = 0.006  # before anything is known
    bias_walk_rad_s_sqrt_s: NonNegative = 2e-5
    stop_s: Positive = 0.5  # a stop this long re-estimates the gyro bias


class FilterSettings(Config, frozen=True):
    """Noise of the error-state filter."""

    accel_noise_m_s2_sqrt_hz: Positive = 0.012
    gyro_noise_rad_s_sqrt_hz: Positive = 0.0006
    # What scale errors and bandwidth add: this part of the force (without gravity) and of the rate.
    accel_scale_sqrt_s: NonNegative = 0.005
    # What shocks add: the force's change from sample to sample may have come this much earlier or later.
    accel_timing_s: NonNegative = 3e-4
    gyro_scale_sqrt_s: NonNegative = 0.002
    zero_velocity_sigma_m_s: Positive = (
        0.01  # of one update at 200 Hz; scaled so that other rates weigh the same
    )
    # The learned detector's σ counts this often in the noise of an update: updates a few ms apart err alike.
    learned_noise: NonNegative = 3.0
    # The part of the sole's learned mean motion that is expected; 0: a stance without motion. All of it fits the
    # walks it was learned from best and lowers some others as much as nothing of it lifts them.
    learned_motion: NonNegative = 0.5
    # What a foot creeps by in stance: a velocity of σ, for this long alike.
    hidden_motion_s: NonNegative = 0.3
    step_scale: NonNegative = 0.01  # part of a step's length that no noise explains: scale errors, sole, shoe
    gate: Positive = 3.0  # innovations beyond this many sigmas inflate the measurement's noise
    lever_sigma_m: NonNegative = 0.1  # still point of the sole to sensor; 0 leaves a plain 9-state filter
    lever_walk_m_sqrt_s: NonNegative = 0.0
    clip_rad_s: Positive = 6.0  # no gyro of this class clips below
    clip_noise_rad_s_sqrt_hz: NonNegative = 0.06  # 0.85 rad/s a sample at 200 Hz
    clip_m_s2: Positive = 30.0  # no accelerometer for feet clips below
    clip_excess_m_s2: NonNegative = 15.0  # sigma of what a clipped sample may have been above its limit
    gap_accel_m_s2: Positive = 15.0  # what a foot may do unseen in a gap of the stream
    gap_rate_rad_s: Positive = 2.0
    max_speed_m_s: Positive = 15.0


Row3 = tuple[float, float, float]
IDENTITY: tuple[Row3, Row3, Row3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class MagnetometerCalibration(Config, frozen=True):
    """What iron on boot and sensor does to one magnetometer: field = ``matrix`` · (measured − ``offset_ut``).

    `bootprint calibrate foot-magnetometer` finds both.
    """

    offset_ut: Row3 = (0.0, 0.0, 0.0)
    matrix: tuple[Row3, Row3, Row3] = IDENTITY


UNCALIBRATED = MagnetometerCalibration()


class MagnetometerSettings(Config, frozen=True):
    """When the field at stand-still may hold the heading (`foot.magnetic`), and the boots' calibrations."""

    use: bool = True
    left_foot: MagnetometerCalibration = UNCALIBRATED
    right_foot: MagnetometerCalibration = UNCALIBRATED
    # Disturbance of one component from place to place: at least, and until the surroundings have shown theirs.
    disturbance_floor_ut: Positive = 1.0
    disturbance_prior_ut: Positive = 5.0
    disturbed_share: Positive = 0.15  # of the horizontal field: a larger disturbance (9°) is not worth using
    correlation_m: Positive = 5.0  # places err alike over this distance
    steadiness_ut: Positive = 2.0  # the field's standard deviation within a stance
    iron_ut: NonNegative = 2.0  # what a calibration may have left, one sigma of each component
    uncalibrated_iron_ut: NonNegative = 10.0  # what boot and sensor may have where nobody calibrated
    gate: Positive = 3.0  # sigmas
    drift_sigma_rad_s: Positive = 3e-4  # heading drift of walking itself, beyond the gyro bias: 1°/min

    def calibration(self, place: str) -> MagnetometerCalibration:
        """The calibration of the unit at a place (left_foot, right_foot)."""
        calibrations = {"left_foot": self.left_foot, "right_foot": self.right_foot}
        return calibrations.get(place, UNCALIBRATED)


class FootSettings(Config, frozen=True):
    """All settings of one foot's navigator."""

    method: Method = "learned"
    # Its noise takes the place of the reference's, in terms that are not set by hand.
    sensor: Sensor = REFERENCE
    standing_report_s: Positive = 0.5
    detector: DetectorSettings = DetectorSettings()
    alignment: AlignmentSettings = AlignmentSettings()
    filter: FilterSettings = FilterSettings()
    magnetometer: MagnetometerSettings = MagnetometerSettings()

    def __post_init__(self) -> None:
        msgspec.structs.force_setattr(self, "alignment", alignment_for(self.sensor, self.alignment))
        msgspec.structs.force_setattr(self, "filter", filter_for(self.sensor, self.filter))
