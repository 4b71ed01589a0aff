"""Finding a key frame's landmarks again where following has lost them: after blur, darkness, a leap of the view.

Patches are told apart by the bits of ORB (Rublee et al. 2011), wherever in the image they are, but upright: a head
nods, it does not roll over. A match must be mutual and clearly better than the next.
"""

import cv2
import numpy as np
import numpy.typing as npt

from sensor_gateway.stereo.images import Image
from sensor_gateway.stereo.tracking import FloatArray, find_corners

_PATCH_PX = 31.0
_MOST_CORNERS, _GRID = 800, (16, 12)
_MOST_BITS, _CLEARLY = 64, 0.85  # of 256; and of the next best
Described = tuple[list[int], npt.NDArray[np.uint8]]


def recognised(key: Image, pixels: FloatArray, image: Image) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Which of the key image's patches (n, 2) are seen in the other one (indices), and where (k, 2)."""
    corners = find_corners(image, np.zeros((0, 2)), _MOST_CORNERS, _GRID)
    (known, known_bits), (found, found_bits) = _described(key, pixels), _described(image, corners)
    if len(known) == 0 or len(found) < 2:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    back = {match.queryIdx: match.trainIdx for match in matcher.match(found_bits, known_bits)}
    sure = [
        (known[best.queryIdx], found[best.trainIdx])
        for best, second in matcher.knnMatch(known_bits, found_bits, k=2)
        if best.distance <= min(_MOST_BITS, _CLEARLY * second.distance)
        and back.get(best.trainIdx) == best.queryIdx
    ]
    index = np.array(sure, dtype=np.int64).reshape(-1, 2)
    return index[:, 0], corners[index[:, 1]]


def _described(image: Image, pixels: FloatArray) -> Described:
    """The bits of patches, and which of them are far enough from the border to have any."""
    points = [
        cv2.KeyPoint(float(x), float(y), _PATCH_PX, 0.0, 0.0, 0, number)
        for number, (x, y) in enumerate(pixels)
    ]
    described, bits = cv2.ORB.create(nlevels=1).compute(image, points)
    if not described:
        return [], np.zeros((0, 32), dtype=np.uint8)
    return [point.class_id for point in described], np.asarray(bits, dtype=np.uint8)
