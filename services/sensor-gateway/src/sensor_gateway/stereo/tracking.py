"""Corners: found spread over the view, matched from eye to eye, followed from image to image.

Following is pyramidal Lucas–Kanade (Bouguet 2001), kept where the way back leads to where it began (Kalal 2010).
"""

import cv2
import numpy as np
import numpy.typing as npt

from sensor_gateway.stereo.images import Image

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_WINDOW = (15, 15)
_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01)
_LEVELS = 4
_RETURN_PX = 0.7
_QUALITY, _APART_PX, _BORDER_PX = 0.003, 7, 8
_PATCH = 7  # half side of the patch that is searched along a row
_LEAST_LIKENESS, _UNIQUE = 0.75, 0.95


def find_corners(image: Image, taken: FloatArray, wanted: int, grid: tuple[int, int]) -> FloatArray:
    """New corners (n, 2), at most ``wanted``, in the cells (columns, rows) of the view that lack them."""
    height, width = image.shape
    mask = np.full(image.shape, 255, dtype=np.uint8)
    for x, y in taken:
        cv2.circle(mask, (round(x), round(y)), _APART_PX, 0, -1)
    mask[:_BORDER_PX], mask[-_BORDER_PX:], mask[:, :_BORDER_PX], mask[:, -_BORDER_PX:] = 0, 0, 0, 0
    found = cv2.goodFeaturesToTrack(image, 6 * wanted, _QUALITY, _APART_PX, mask=mask, blockSize=5)
    corners = np.asarray([] if found is None else found, dtype=np.float64).reshape(-1, 2)
    size = np.array([width / grid[0], height / grid[1]])
    share = max(1, wanted // (grid[0] * grid[1]))
    return corners[_spread(_cells(corners, size, grid[0]), _cells(taken, size, grid[0]), share)][:wanted]


def _cells(points: FloatArray, size: FloatArray, columns: int) -> npt.NDArray[np.int64]:
    at = (points.reshape(-1, 2) // size).astype(np.int64)
    return np.asarray(at[:, 1] * columns + at[:, 0])


def _spread(cells: npt.NDArray[np.int64], taken: npt.NDArray[np.int64], share: int) -> list[int]:
    """Indices of corners (strongest first) while their cell holds fewer than its share."""
    held: dict[int, int] = {}
    for cell in taken.tolist():
        held[cell] = held.get(cell, 0) + 1
    kept = []
    for index, cell in enumerate(cells.tolist()):
        if held.get(cell, 0) < share:
            held[cell] = held.get(cell, 0) + 1
            kept.append(index)
    return kept


def follow(
    image: Image, other: Image, points: FloatArray, guesses: FloatArray | None = None, levels: int = _LEVELS
) -> tuple[FloatArray, BoolArray]:
    """Where points (n, 2) of one image are in another, (n, 2), and which of them could be followed."""
    if len(points) == 0:
        return np.zeros((0, 2)), np.zeros(0, dtype=bool)
    start = points.astype(np.float32).reshape(-1, 1, 2)
    guess = start.copy() if guesses is None else guesses.astype(np.float32).reshape(-1, 1, 2)
    there, found = _flow(image, other, start, guess, levels)
    back, returned = _flow(other, image, there, start - guess + there, levels)
    near = np.linalg.norm((back - start)[:, 0], axis=1) < _RETURN_PX
    target = there[:, 0].astype(np.float64)
    height, width = other.shape
    inside = ((target >= 0.0) & (target <= (width - 1, height - 1))).all(axis=1)
    return target, found & returned & near & inside


def _flow(
    image: Image,
    other: Image,
    start: npt.NDArray[np.float32],
    guess: npt.NDArray[np.float32],
    levels: int,
) -> tuple[npt.NDArray[np.float32], BoolArray]:
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        image,
        other,
        start,
        guess.copy(),
        winSize=_WINDOW,
        maxLevel=levels,
        criteria=_STOP,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray(there, dtype=np.float32), np.asarray(found[:, 0] == 1)


def match_rows(
    left: Image, right: Image, corners: FloatArray, most_px: int, rows_aside: int = 1
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Sights (n, 3) of corners (n, 2) of the left image, their rows (n,) in the right one, and which are sure.

    Each corner's patch is searched along its row, ``rows_aside`` up and down, by normalised correlation, whatever
    its disparity is up to ``most_px``; the peak must stand out, and following refines it to a fraction of a pixel.
    """
    start = np.array([_searched(left, right, corner, most_px, rows_aside) for corner in corners])
    start = start.reshape(-1, 2)
    sure = np.isfinite(start[:, 0])
    there, followed = follow(left, right, corners[sure], start[sure], levels=0)
    found = np.full((len(corners), 2), np.nan)
    index = np.flatnonzero(sure)
    near = (np.abs(there - start[sure]) < 2.0).all(axis=1)
    level = np.abs(there[:, 1] - corners[sure][:, 1]) < 1.0 + rows_aside
    good = followed & level & near
    found[index[good]] = there[good]
    return np.column_stack([corners, found[:, 0]]), found[:, 1], np.isfinite(found[:, 0])


def _searched(
    left: Image, right: Image, corner: FloatArray, most_px: int, rows_aside: int
) -> tuple[float, float]:
    """Where a corner's patch lies in the right image to a pixel; NaN where nothing stands out."""
    nowhere = (float("nan"), float("nan"))
    x, y = round(corner[0]), round(corner[1])
    height, width = left.shape
    top, bottom = max(0, y - _PATCH - rows_aside), min(height, y + _PATCH + rows_aside + 1)
    if x < _PATCH or x + _PATCH >= width or y < _PATCH or y + _PATCH >= height:
        return nowhere
    patch = left[y - _PATCH : y + _PATCH + 1, x - _PATCH : x + _PATCH + 1]
    first = max(0, x - _PATCH - most_px)
    last = min(width, x + _PATCH + 3)
    likeness = cv2.matchTemplate(right[top:bottom, first:last], patch, cv2.TM_CCOEFF_NORMED)
    row, column = divmod(int(likeness.argmax()), likeness.shape[1])
    best = float(likeness[row, column])
    others = likeness.copy()
    others[:, max(0, column - 3) : column + 4] = -1.0
    if best < _LEAST_LIKENESS or float(others.max()) > _UNIQUE * best:
        return nowhere
    return corner[0] + (first + column + _PATCH - x), corner[1] + (top + row + _PATCH - y)
