"""Whether a pair of images can tell a motion, and if not, why: dark, smoke, a close wall, a crowd."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from sensor_gateway.stereo.images import Image

Condition = Literal["starting", "dark", "smoke", "close_wall", "crowd", "few_landmarks", "bad_image"]

_BLACK_GREY = 12.0  # a mean below: the shutter is open in vain
_AMPLIFIED_GREY, _NOISY = 5.0, 0.45  # noise, and noise against structure: what an amplifier makes of darkness
_FLAT_GREY = 8.0  # structure (standard deviation) of a view through smoke, at most
_SMALL = 4  # images are judged at a quarter of their size
_CLOSE_M = 0.6
# Immerkær, "Fast noise variance estimation" (1996): a mask that edges and slopes hardly move.
_NOISE_MASK = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])
_NOISE_GAIN = 6.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """No motion is told, and why; ``words`` for people."""

    time_ns: int
    condition: Condition
    words: str


@dataclass(frozen=True, slots=True)
class Look:
    """What an image is like: mean grey, its structure (standard deviation of what is not noise) and its noise."""

    mean_grey: float
    structure_grey: float
    noise_grey: float

    @property
    def is_dark(self) -> bool:
        """Hardly any light, or what is seen is mostly the amplifier's noise."""
        amplified = self.noise_grey > max(_AMPLIFIED_GREY, _NOISY * self.structure_grey)
        return self.mean_grey < _BLACK_GREY or amplified

    @property
    def is_flat(self) -> bool:
        """Light, but nothing to see."""
        return self.structure_grey < _FLAT_GREY


def look_at(image: Image) -> Look:
    """Judge an image."""
    values = image.astype(np.float32)
    noise = cv2.filter2D(values, -1, _NOISE_MASK)[1:-1, 1:-1] / _NOISE_GAIN
    # The median of |N(0, σ)| is 0.6745 σ: sharp corners are few and do not move it.
    noise_grey = float(np.median(np.abs(noise))) / 0.6745
    small = cv2.resize(image, None, fx=1.0 / _SMALL, fy=1.0 / _SMALL, interpolation=cv2.INTER_AREA)
    return Look(float(image.mean()), float(small.std()), noise_grey)


def sharpness_of(image: Image) -> float:
    """How much fine structure an evened image has: of one view it falls when the view is blurred."""
    return float(cv2.Laplacian(image, cv2.CV_32F).std())


def condition_of(look: Look, median_depth_m: float | None, agreeing_share: float | None) -> Condition:
    """Why no motion was found, the plainest reason first."""
    if look.is_dark:
        return "dark"
    if median_depth_m is not None and median_depth_m < _CLOSE_M:
        return "close_wall"
    if look.is_flat:
        return "smoke"
    if agreeing_share is not None:
        return "crowd"
    return "few_landmarks"


WORDS: dict[Condition, str] = {
    "starting": "first pair",
    "dark": "too dark",
    "smoke": "light, but nothing to see: smoke or a blank wall",
    "close_wall": "a wall too close",
    "crowd": "most of the view moves by itself",
    "few_landmarks": "too few corners to follow",
    "bad_image": "an image that cannot be used",
}
