"""What can be set of stereo odometry, with the defaults and the reasons for them."""

from typing import Annotated

import msgspec

from bootprint.config import Config

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Share = Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)]


class OdometrySettings(Config, frozen=True):
    """Sizes in px are of the image as it comes; nothing depends on the camera's make."""

    most_landmarks: Annotated[int, msgspec.Meta(ge=30, le=2000)] = 300
    least_landmarks: Annotated[int, msgspec.Meta(ge=6, le=200)] = 15  # fewer that agree: no motion is told
    columns: Annotated[int, msgspec.Meta(ge=2, le=40)] = (
        12  # of the grid that spreads landmarks over the view
    )
    rows: Annotated[int, msgspec.Meta(ge=2, le=40)] = 6
    sight_sigma_px: Positive = 0.35  # of each number of a sight, as followed from frame to frame
    least_disparity_px: Positive = 1.0  # further off depth is not told, and its error is not symmetrical
    largest_disparity: Share = 0.4  # of the image's width: what is nearer is a lens cap or a shoulder
    least_share: Share = 0.4  # of the landmarks that should be in view: fewer agree where a crowd moves
    key_share: Share = 0.6  # of its landmarks still seen: below, a new key frame
    key_parallax_rad: Positive = 0.125  # median shift since the key frame that makes a new one, as an angle
    key_turn_rad: Positive = 0.2
    longest_key_s: Positive = 2.0
    longest_gap_s: Positive = 0.6  # without a motion: a key frame that is not recognised is given up
    remembered_s: Positive = 3.0  # ... while there is nothing to see: darkness, smoke, blur
    blurred: Share = (
        0.5  # of the key frame's sharpness: such a view makes no key frame while the old one serves
    )
    told_landmarks: Annotated[int, msgspec.Meta(ge=1, le=40)] = 30  # a key frame, at most, for maps of rooms
    told_landmark_sigma_m: Positive = 0.3  # of their depth, at most
    scale_sigma: NonNegative = 0.005  # of the translation: calibration and matching err alike in all frames
    turn_sigma: NonNegative = 0.001  # of the rotation
