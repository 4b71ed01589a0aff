"""Images as odometry wants them: grey, and freed of exposure by local normalisation."""

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Pixels = npt.NDArray[np.integer]
"""As a camera or a file gives them: (height, width) or (height, width, channels), 8 or 16 bits."""

_REACH = 31  # px: side of the window whose mean and spread are taken out
_FLOOR_GREY = 6.0  # spreads below are noise and stay small
_MIDDLE, _GAIN = 128.0, 48.0


def as_grey(image: Pixels) -> Image:
    """Mono or colour (BGR, BGRA), of 8 or 16 bits: 8-bit grey; ValueError on any other shape or kind."""
    if image.dtype == np.uint16:
        image = (image // 256).astype(np.uint8)
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or image.size == 0:
        raise ValueError(f"an image of {image.dtype} and shape {image.shape} is neither mono nor colour")
    if image.ndim == 2:
        return np.ascontiguousarray(image, dtype=np.uint8)
    if image.shape[2] == 1:
        return np.ascontiguousarray(image[:, :, 0], dtype=np.uint8)
    if image.shape[2] not in (3, 4):
        raise ValueError(f"an image of {image.shape[2]} channels is neither mono nor colour")
    code = cv2.COLOR_BGR2GRAY if image.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
    return np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)


def evened(image: Image) -> Image:
    """The image with local mean and spread taken out: gain, offset and vignetting leave no trace in it.

    Corner trackers hold grey values to be constant; cameras with automatic exposure do not keep that.
    """
    values = image.astype(np.float32)
    mean = cv2.boxFilter(values, -1, (_REACH, _REACH))
    square = cv2.boxFilter(values * values, -1, (_REACH, _REACH))
    spread = np.sqrt(np.maximum(square - mean * mean, 0.0)) + _FLOOR_GREY
    return np.clip(_MIDDLE + _GAIN * (values - mean) / spread, 0.0, 255.0).astype(np.uint8)
