"""What can be set on the body module, with the defaults and where they come from.

Times are seconds, so nothing depends on the sensor's rate. A method is a step length model and an azimuth source.
"""

from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from pdr_engine.body.azimuth.deviation import Deviation

StepLength = Literal["blend", "pendulum", "frequency", "weinberg", "network"]
Azimuth = Literal[
    "combined", "gyro", "compass", "two-axis", "cascade", "bridge", "bridge-direct", "bridge-weighted"
]
Denoising = Literal["step", "stride", "wavelet"]
Placement = Literal["auto", "trunk", "hand"]
Forward = Literal["auto", "x", "y", "z", "-x", "-y", "-z"]

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Row3 = tuple[float, float, float]
IDENTITY: tuple[Row3, Row3, Row3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class AttitudeSettings(Config, frozen=True):
    """The complementary filter that tells up from the accelerometer and turns by the gyro."""

    gravity_rate_per_s: Positive = 0.1  # how fast tilt follows the accelerometer while moving
    first_gravity_rate_per_s: Positive = 1.0  # and in the first seconds, when nothing is known
    settling_s: Positive = 1.0
    # The integral part's, of the rate above squared; a quarter is critically damped.
    gravity_bias_share: NonNegative = 0.25
    # A second of standing still tells the gyro's bias.
    rest_accel_std_m_s2: Positive = 0.15
    rest_gyro_std_rad_s: Positive = 0.03
    rest_rate_rad_s: Positive = 0.05
    rest_sway_rad_s: Positive = 0.004  # how far the mean rate of a standing trunk or hand is from the bias
    bias_sigma_rad_s: Positive = 0.01


class StepSettings(Config, frozen=True):
    """Which rises of the vertical acceleration are steps."""

    smallest_rise_m_s2: Positive = 0.8  # from trough to peak of the smoothed vertical acceleration
    share_of_usual_rise: Positive = 0.3  # a step rises at least by this part of the usual step's
    shortest_s: Positive = 0.22  # sprinters make 4.5 steps a second
    # Nobody walks much faster than three steps a second; who flies bounces by 1 g, some of it smoothed away.
    shortest_walk_s: Positive = 0.29
    run_rise_m_s2: Positive = 9.0
    longest_s: Positive = 1.5
    share_of_usual_interval: Positive = (
        0.55  # sooner comes only a peak that rises nearly as the usual one does:
    )
    share_of_usual_rise_soon: Positive = 0.6
    # A bout begins with this many steps whose intervals differ by less than this share of the shortest.
    steps_to_begin: Annotated[int, msgspec.Meta(ge=2, le=10)] = 3
    irregularity: Positive = 0.45
    # After what was no walk with so many, until so many were walked.
    steps_in_doubt: Annotated[int, msgspec.Meta(ge=4, le=16)] = 10
    steps_until_trusted: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 60


class LengthSettings(Config, frozen=True):
    """Step length models. Factors and coefficients: `proving_ground.evaluation.body.train`, unless said."""

    scale: Positive = 1.0  # the person's own factor on whatever model is used, to begin with
    # C2: what is added to the network's output weights for this person, as fixes of earlier walks told.
    refinement: tuple[float, ...] = ()
    leg_length_m: Positive = 0.9
    # Zijlstra and Hof 2003: length = factor · 2 √(2 l h − h²) with h the rise of the trunk in a step.
    # The factor is theirs for the trunk; a hand bounces harder, so there it is smaller. Which of both it is, is
    # told by surge and heel strikes if not set.
    placement: Placement = "auto"
    trunk_factor: Positive = 1.25
    hand_factor: Positive = 1.055
    # A1: length = a + b · frequency, of leg 0.9 m; scaled by leg length. Hurried steps are shorter than a constant
    # walk ratio (0.39 m s, Sekiya and Nagasaki 1998) has them. Running: least squares of relative errors over drawn
    # people (`proving_ground.people`), as many of whom sprint as run; cadence hardly tells whose run is the longer.
    frequency_offset_m: float = 0.21
    frequency_slope_m_s: float = 0.25
    run_offset_m: float = -2.0
    run_slope_m_s: float = 1.05
    # Of steps that no model of walking fits (METHODS A1: a model for each class): one length each.
    stair_step_m: Positive = 0.28  # a tread
    crawl_step_m: Positive = 0.21
    side_step_m: Positive = 0.20  # apart and together are two steps
    # Weinberg 2002: length = factor · (largest − smallest vertical acceleration)^¼.
    weinberg_factor: Positive = 0.38
    # "blend": the first two, each weighed by its precision over walks (scatter 5.4 % and 11 %).
    pendulum_weight: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.8
    # B6: a quick turn shortens the step, by this part for each rad/s, by four fifths at most.
    turn_shortening_s: NonNegative = 0.13
    # Of a step's length, as if independent from step to step: in ten seconds errors of gait, and of the way-points
    # that this was set by, add up to what so much a step would.
    sigma_share: Positive = 0.37
    common_sigma_share: Positive = 0.055  # of all steps of a walk alike


class HeadingSettings(Config, frozen=True):
    """How gyro and compass are weighed."""

    # Of an undisturbed compass on a person: tilt errors and trunk sway.
    compass_sigma_rad: Positive = 0.05
    # A field that is off by a part of its strength errs by about that angle; indoors alike over some metres.
    disturbance_floor: Positive = 0.14
    correlation_steps: Positive = 240.0
    # What iron makes a compass err by in malls is alike over this many steps in a row (sum of its autocorrelation,
    # which is 0.9, 0.6, 0.4 and 0.1 after 1, 3, 5 and 10). A track that is turned while it is walked loses its
    # shape, so the default goes by the larger figure above; a bridge, whose task the azimuth is, by this one.
    alike_steps: Positive = 12.0
    sway_steps: Positive = 10.0  # for which tilt errors and sway are alike
    first_sigma_rad: Positive = 0.7  # of a bridge's first azimuth: nobody knows yet what the field is like
    gyro_noise_rad_sqrt_s: NonNegative = 0.005
    gyro_drift_rad_s: NonNegative = 0.003  # one sigma of the bias that is left: 10°/min
    drift_walk_rad_s_sqrt_s: NonNegative = 2e-5
    # B3: the trunk's direction is the mean over a step, over a left and a right one, or a wavelet's approximation.
    denoising: Denoising = "step"
    sway_sigma_rad: Positive = 0.28  # how far one step's direction is from the trunk's; as above


class CompassCalibration(Config, frozen=True):
    """What iron on the person does to the magnetometer: field = ``matrix`` · (measured − ``offset_ut``)."""

    offset_ut: Row3 = (0.0, 0.0, 0.0)
    matrix: tuple[Row3, Row3, Row3] = IDENTITY


class AltitudeSettings(Config, frozen=True):
    """What is known of the building: floors are counted by it until some were visited."""

    storey_m: Positive = 3.6
    storey_sigma_m: Positive = 0.9
    start_floor: int = 0


class BodySettings(Config, frozen=True):
    """All settings of the body-worn unit's navigator."""

    step_length: StepLength = "blend"
    azimuth: Azimuth = "combined"
    retrace: bool = True  # B6: the way back is laid on the way out
    classes: bool = True  # A3, B1: steps aside and back are told from steps forward
    forward: Forward = "auto"  # the unit's axis that points ahead; found from walking if not told
    misalignment_rad: float = 0.0  # of that axis against the walking direction, clockwise
    attitude: AttitudeSettings = AttitudeSettings()
    steps: StepSettings = StepSettings()
    length: LengthSettings = LengthSettings()
    heading: HeadingSettings = HeadingSettings()
    altitude: AltitudeSettings = AltitudeSettings()
    calibration: CompassCalibration = CompassCalibration()
    online_calibration: bool = True  # A5: iron that is worn is learned from turns and taken off
    # B5: compass deviations by place are taken off where earlier walks saw them, and learned for the next.
    deviation_map: bool = False
    deviations: tuple[Deviation, ...] = ()  # in metres east, north of the realm's origin, magnetic north
