"""What can be set under ``[fusion]`` of computer.toml, with the defaults and the reasons for them.

A minimal section is empty; a soldier who starts at a known point and walks off to the east::

    [fusion]
    feet = ["left_foot"]
    gnss_sources = []                     # no receiver to wait for

    [fusion.start]
    east_m = 12.0
    north_m = -3.5
    azimuth_deg = 90.0
"""

from typing import Annotated, Literal

import msgspec

from bootprint.config import Config
from bootprint.messages import Latitude, Longitude
from bootprint.topics import check_part
from fusion.rooms.settings import RoomsConfig

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Probability = Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)]
Share = Annotated[float, msgspec.Meta(ge=0.0, lt=1.0)]
Coupling = Literal["passing", "same_position", "none"]
Feet = Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=2)]


class StartConfig(Config, frozen=True):
    """A known point where the soldier is when the boots make their first step (``[fusion.start]``).

    It holds at the very first step of the pdr-engine (sequence 0) only: whoever is restarted in the middle of a
    walk does not claim to be back at the door.

    Give ``east_m`` and ``north_m``, or ``latitude_deg`` and ``longitude_deg``. ``azimuth_deg`` (clockwise from
    true north) is the direction the soldier *walks off in*; without it the heading stays unknown until
    satellites or a second known point tell it.
    """

    east_m: float | None = None
    north_m: float | None = None
    latitude_deg: Latitude | None = None
    longitude_deg: Longitude | None = None
    up_m: float = 0.0
    sigma_m: Positive = 1.0
    up_sigma_m: Positive = 1.0
    azimuth_deg: float | None = None
    azimuth_sigma_deg: Positive = 5.0

    def __post_init__(self) -> None:
        local = (self.east_m, self.north_m)
        geodetic = (self.latitude_deg, self.longitude_deg)
        if (None in local) == (None in geodetic) or local.count(None) == 1 or geodetic.count(None) == 1:
            raise ValueError("start needs either east_m and north_m, or latitude_deg and longitude_deg")


class GnssConfig(Config, frozen=True):
    """How satellite fixes are believed (``[fusion.gnss]``)."""

    gate_probability: Probability = 0.999  # share of good fixes that pass the innovation gate
    uere_m: Positive = 6.0  # metres per unit of HDOP when a receiver states no accuracy; conservative
    accuracy_floor_m: Positive = 1.0  # the antenna is on the shoulder, the state at the feet
    vertical_floor_m: Positive = 2.0  # covers the antenna's height as well
    correlation_s: NonNegative = 30.0  # a receiver's error lives about this long (multipath, ionosphere)
    standing_correlation_s: Positive = (
        300.0  # ... where it stands: what walls reflect changes with the sky only
    )
    reflection_m: Positive = 6.0  # or with the place, over this far
    fresh_s: Positive = 5.0  # mode "gnss" for this long after an accepted fix
    placement_accuracy_m: Positive = 15.0  # only fixes this good may place a soldier
    placement_heading_sigma_deg: Positive = 8.0  # heading is known when the fit of tracks is this sure
    max_range_km: Positive = 200.0  # further from the realm's origin, or less accurate, a fix is nonsense
    late_s: NonNegative = (
        3.0  # a fix that comes later than its turn by up to this is carried along by the feet
    )
    late_sigma_m_s: NonNegative = 0.3  # what that adds to its sigma: heading errors, and stamps a little off


class VelocityConfig(Config, frozen=True):
    """How a receiver's speed and course are believed (``[fusion.velocity]``)."""

    sigma_m_s: Positive = 0.15  # each axis of one fix: Doppler is better, shoulders sway
    clear_accuracy_m: Positive = 3.0  # of a position under open sky: worse ones have worse velocities
    repeats: Positive = 2.0  # sway and turns err alike over so many fixes
    fewest: Annotated[int, msgspec.Meta(ge=2)] = 4  # ways before a heading is told
    lasting_rad: NonNegative = 0.02  # that no number of ways mends
    placement_sigma_deg: Positive = 5.0  # heading is known when it is this sure
    gate_probability: Probability = 0.999


class TrustConfig(Config, frozen=True):
    """When satellites are not to be believed any more (``[fusion.trust]``)."""

    false_alarm: Probability = 1e-3  # of one comparison of a fix with dead reckoning
    confirm_s: Positive = 4.0  # so long most fixes must be astray
    agreement: Probability = 0.99  # a distrusted receiver's fix agrees within this share of errors
    retrust_s: Positive = 20.0  # so long all of them must agree
    shadow_interval_s: Positive = 30.0  # dead reckoning without satellites begins anew this often
    scatter_window_s: Positive = 30.0  # a receiver's own scatter is of this long
    witness_heading_sigma_deg: Positive = 8.0  # dead reckoning whose heading is less sure accuses nobody


class AltitudeConfig(Config, frozen=True):
    """Lifts and floors (``[fusion.altitude]``)."""

    least_ride_m: Positive = 1.2  # less than this shows no lift yet
    least_blind_ride_m: Positive = 3.0  # the same where no floors are known, to which it would have to lead
    noise_gate: Positive = 5.0  # times what pressure has lately moved by itself
    standing_s: Positive = 1.5  # the feet stand in a lift
    walking_m: Positive = 0.25  # a step this long is no shuffle
    rest_s: Positive = 2.0  # so long pressure rests when the lift has stopped
    rest_m_s: Positive = 0.12
    ride_sigma_m: Positive = 0.5  # of the whole of a ride: air in the shaft, weather
    level_way_m: Positive = 2.0  # walked on the level after stairs before they have ended
    floor_share: Positive = 0.25  # of a storey: further from a floor is a landing
    floor_sigma_m: Positive = 0.2  # a floor's height: thresholds, soles


class BodyConfig(Config, frozen=True):
    """How the body-worn unit's steps are believed (``[fusion.body]``)."""

    turn_sigma_rad: Positive = 0.2  # how the unit may sit, before boots have told
    turn_reading_rad: Positive = 0.12  # one stretch beside the boots: iron of the place
    turn_wander_rad: NonNegative = 0.02  # a stretch: belts slip
    scale_sigma: Positive = 0.2  # of the length, before boots have told
    scale_reading: Positive = 0.06
    scale_wander: NonNegative = 0.03
    stretch_m: Positive = 15.0
    azimuth_sigma_rad: NonNegative = 0.06  # that lasts, whatever was learned
    own_sigma: NonNegative = 0.15  # of a step's length: sway, single steps
    silence_s: Positive = 2.0  # boots that have not spoken for so long are silent
    memory_s: Positive = 60.0  # how long satellites take to mend what the azimuth did
    fresh_s: Positive = 5.0  # a soldier who stands makes no steps; so long nothing is missed


class AlignConfig(Config, frozen=True):
    """How a walk's first metres give directions (``[fusion.align]``)."""

    distance_m: Positive = 3.0  # walked before a direction is taken as learned
    provisional_m: Positive = 0.5  # from here on a provisional direction is published
    lateral_sigma_m: Positive = 0.15  # a stance lies this far off the line a person walks


class FeetConfig(Config, frozen=True):
    """What is added to the foot INS's own covariance, and how two feet hold each other (``[fusion.boots]``).

    ``scale_sigma`` and ``heading_walk_rad_sqrt_s`` are for steps that do not name what they have in common.
    """

    coupling: Coupling = "passing"
    scale_sigma: NonNegative = 0.03  # of a step's length, per step: errors of steps correlate
    heading_walk_rad_sqrt_s: NonNegative = 0.0015  # 0.3 deg/min of residual drift, matched at 5 minutes
    common_lifetime_s: Positive = 600.0  # what a foot's steps have in common (soles, gyro bias) lives so long
    common_correlation: Share = (
        0.5  # of scale and slope between the feet: the same person, the same estimator
    )
    pose_sigma_m: NonNegative = 0.05  # of a published position against the foot's stance
    same_position_sigma_m: Positive = 1.0  # METHODS D4
    width_m: NonNegative = 0.12  # the feet pass each other this far apart; people differ by its sigma
    width_sigma_m: NonNegative = 0.08
    passing_sigma_m: tuple[Positive, Positive, Positive] = (0.15, 0.06, 0.05)  # ahead, aside, up
    passing_turn_sigma_m: NonNegative = 0.25  # aside as well, per radian that the step turned
    passing_correlation: NonNegative = 10.0  # starts, turns and ways of walking repeat over so many passings
    passing_least_m: Positive = 0.5  # a shorter step passes nothing
    separation_m: Positive = 1.0  # feet abreast are never further apart (METHODS D4, inequality)
    separation_sigma_m: Positive = 0.3
    reach_m: Positive = 3.0  # feet are never further apart, running neither
    gate_probability: Probability = 0.999
    join_sigma_m: Positive = 0.3  # where a foot stands beside the other
    join_distance_m: Positive = 4.0  # of a straight walk that shows how a foot lies beside the other
    join_fit_sigma_m: Positive = 0.12  # of one stance as the other foot has it, while a foot joins
    max_speed_m_s: Positive = 12.0  # a step faster than this is a fault of the sensor


class CameraConfig(Config, frozen=True):
    """How a camera is held to the body, and what is added to its own covariance (``[fusion.camera]``)."""

    same_position_sigma_m: Positive = 0.3  # METHODS D6: 0.1 to 1 m; feet stride, a head sways
    offset_sigma_m: Positive = 0.2  # of the constant vertical offset
    couple_s: NonNegative = 1.0  # once in so long: sway and stride repeat within it
    repeats: NonNegative = 5.0  # lean, and who kneels, repeat over so many couplings
    stretch_m: NonNegative = 10.0  # of way, over which scale and tilt err alike
    scale_sigma: NonNegative = 0.01  # of a motion's length: calibration errs alike in all of them
    heading_walk_rad_sqrt_s: NonNegative = 0.0003
    join_sigma_m: Positive = (
        0.3  # of track points abreast, while it is found how the camera lies beside the feet
    )
    tilt_sigma_rad: Positive = 0.2  # how a camera without a level may sit on its wearer
    level_sigma_rad: Positive = 0.02  # how well an inertial unit beside a camera tells up, while walking
    tilt_walk_rad_sqrt_s: NonNegative = 0.001
    distrust_s: NonNegative = 10.0  # a camera that contradicts the feet does not join again for so long
    climb_sigma_m: Positive = 0.15  # between the feet's climb over a few metres and the camera's


class PeersConfig(Config, frozen=True):
    """How ranges to others of the squad are believed (``[fusion.peers]``)."""

    use: bool = True
    window_s: Positive = 5.0  # of the ranges to one peer
    interval_s: Positive = 2.0  # between two looks at all of them
    range_floor_m: Positive = 0.4  # of a window: antennas on two bodies, walls in between
    worth: Share = 0.5  # a peer's variance along the line must be less than this share of one's own
    gate_probability: Probability = 0.999
    distrust_s: NonNegative = 30.0  # a peer that contradicts the others is not heard for so long
    placement_accuracy_m: Positive = 15.0  # a place by ranges this good may place a soldier
    feet_sigma_m: Positive = 0.1  # of a range between the own feet: where the radios sit on the boots


class SilenceConfig(Config, frozen=True):
    """What silence means (``[fusion.silence]``); all in event time."""

    coasting_s: Positive = 1.0
    lost_s: Positive = 60.0
    lost_sigma_m: Positive = 100.0
    drift_m_s: Positive = 1.5  # how fast an unobserved soldier's position becomes unknown
    turn_rad_sqrt_s: Positive = 0.5  # the same for the heading: a right angle every ten seconds
    rejoin_s: Positive = 5.0  # a foot unseen for longer has to find its place beside the other again
    remembered_s: Positive = (
        60.0  # a saved state further from the first message than this is not gone on from
    )
    patience_s: Positive = 2.0  # so long silent feet are waited for, once; then others carry time on


class FusionConfig(Config, frozen=True):
    """``[fusion]``: everything the fusion service can be told."""

    feet: Feet = ("left_foot", "right_foot")
    gnss_sources: tuple[str, ...] = ("gnss",)  # receivers waited for, within the window
    reorder_window_s: NonNegative = 0.3  # the longest wait for what is out of order
    stance_delay_s: NonNegative = 0.0  # a FootStep is stamped so long before poses already sent: never
    rate_hz: Annotated[float, msgspec.Meta(ge=1.0, le=20.0)] = 5.0
    lookahead_s: NonNegative = 0.1  # a published position lies between two foot poses, this far apart
    floor_height_m: Positive | None = None
    unplaced_sigma_m: Positive = 10_000.0  # an unplaced soldier is published at the origin, give or take this
    start: StartConfig | None = None
    align: AlignConfig = AlignConfig()
    boots: FeetConfig = FeetConfig()
    gnss: GnssConfig = GnssConfig()
    camera: CameraConfig = CameraConfig()
    silence: SilenceConfig = SilenceConfig()
    trust: TrustConfig = TrustConfig()
    altitude: AltitudeConfig = AltitudeConfig()
    body: BodyConfig = BodyConfig()
    peers: PeersConfig = PeersConfig()
    velocity: VelocityConfig = VelocityConfig()
    rooms: RoomsConfig = RoomsConfig()

    def __post_init__(self) -> None:
        if len(set(self.feet)) != len(self.feet):
            raise ValueError(f"feet names {self.feet[0]!r} twice")
        for name in (*self.feet, *self.gnss_sources):
            check_part("a name in feet or gnss_sources", name)
