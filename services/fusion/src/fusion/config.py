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

from typing import Annotated

import msgspec

from bootprint.config import Config
from bootprint.messages import Latitude, Longitude
from bootprint.topics import check_part

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Probability = Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)]
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
    fresh_s: Positive = 5.0  # mode "gnss" for this long after an accepted fix
    placement_accuracy_m: Positive = 15.0  # only fixes this good may place a soldier
    placement_heading_sigma_deg: Positive = 8.0  # heading is known when the fit of tracks is this sure
    max_range_km: Positive = 200.0  # further from the realm's origin, or less accurate, a fix is nonsense
    late_s: NonNegative = (
        3.0  # a fix that comes later than its turn by up to this is carried along by the feet
    )
    late_sigma_m_s: NonNegative = 0.3  # what that adds to its sigma: heading errors, and stamps a little off


class AlignConfig(Config, frozen=True):
    """How a walk's first metres give directions (``[fusion.align]``)."""

    distance_m: Positive = 3.0  # walked before a direction is taken as learned
    provisional_m: Positive = 0.5  # from here on a provisional direction is published
    lateral_sigma_m: Positive = 0.15  # a stance lies this far off the line a person walks


class FeetConfig(Config, frozen=True):
    """What is added to the foot INS's own covariance, and how two feet hold each other (``[fusion.boots]``)."""

    scale_sigma: NonNegative = 0.03  # of a step's length, per step: errors of steps correlate
    heading_walk_rad_sqrt_s: NonNegative = 0.0015  # 0.3 deg/min of residual drift, matched at 5 minutes
    pose_sigma_m: NonNegative = 0.05  # of a published position against the foot's stance
    same_position_sigma_m: Positive = 1.0  # METHODS D4
    separation_m: Positive = 1.0  # feet abreast are never further apart (METHODS D4, inequality)
    separation_sigma_m: Positive = 0.3
    gate_probability: Probability = 0.999
    join_sigma_m: Positive = 0.3  # where a foot stands beside the other
    max_speed_m_s: Positive = 12.0  # a step faster than this is a fault of the sensor


class SilenceConfig(Config, frozen=True):
    """What silence means (``[fusion.silence]``); all in event time."""

    coasting_s: Positive = 1.0
    lost_s: Positive = 60.0
    lost_sigma_m: Positive = 100.0
    drift_m_s: Positive = 1.5  # how fast an unobserved soldier's position becomes unknown
    turn_rad_sqrt_s: Positive = 0.3  # the same for the heading
    rejoin_s: Positive = 5.0  # a foot unseen for longer has to find its place beside the other again
    patience_s: Positive = 2.0  # so long silent feet are waited for, once; then others carry time on


class FusionConfig(Config, frozen=True):
    """``[fusion]``: everything the fusion service can be told."""

    feet: Feet = ("left_foot", "right_foot")
    gnss_sources: tuple[str, ...] = ("gnss",)  # receivers waited for, within the window
    reorder_window_s: NonNegative = 0.3  # the longest wait for what is out of order
    stance_delay_s: NonNegative = 0.1  # a FootStep is stamped at most this long before poses already sent
    rate_hz: Annotated[float, msgspec.Meta(ge=1.0, le=20.0)] = 5.0
    lookahead_s: NonNegative = 0.1  # a published position lies between two foot poses, this far apart
    floor_height_m: Positive | None = None
    unplaced_sigma_m: Positive = 10_000.0  # an unplaced soldier is published at the origin, give or take this
    start: StartConfig | None = None
    align: AlignConfig = AlignConfig()
    boots: FeetConfig = FeetConfig()
    gnss: GnssConfig = GnssConfig()
    silence: SilenceConfig = SilenceConfig()

    def __post_init__(self) -> None:
        if len(set(self.feet)) != len(self.feet):
            raise ValueError(f"feet names {self.feet[0]!r} twice")
        for name in (*self.feet, *self.gnss_sources):
            check_part("a name in feet or gnss_sources", name)
