"""A camera folder: rectified stereo pairs, a calibration and, where it is known, the left camera's true pose.

``image_l/`` and ``image_r/`` (PNG or JPEG, mono or colour, sorted by name), ``calib.txt`` with the projection
matrices ``P0:`` and ``P1:`` (3x4, row by row; other lines are of no matter; two lines without names are those two),
``poses.txt`` (3x4 a row, camera axes x right, y down, z ahead). There are no times: 10 Hz.

The run's frame is (z, −x, −y) of the poses: ahead, left, up.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bootprint.errors import RecordingError
from sensor_gateway.recordings.run import FloatArray, Run, StereoSeries, Truth

RATE_HZ = 10.0
LEFT, RIGHT, CALIBRATION, POSES = "image_l", "image_r", "calib.txt", "poses.txt"
_IMAGES = (".png", ".jpg", ".jpeg")
_LEFT_NAME, _RIGHT_NAME = "P0:", "P1:"
_TO_RUN = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
Pixels = npt.NDArray[np.integer]


def recognises(folder: Path) -> bool:
    """A folder with images of a left or a right eye."""
    return (folder / LEFT).is_dir() or (folder / RIGHT).is_dir()


def read(folder: Path) -> list[Run]:
    """The folder's one run, its images not yet read; RecordingError on anything missing or unequal."""
    left, right = _images(folder / LEFT), _images(folder / RIGHT)
    if len(left) != len(right):
        raise RecordingError(
            f"{folder}: {len(left)} images in {LEFT}/ but {len(right)} in {RIGHT}/; each needs its other"
        )
    both = projections(folder / CALIBRATION)
    poses = _poses(folder / POSES, len(left)) if (folder / POSES).exists() else None
    time_s = np.arange(len(left)) / RATE_HZ
    attitude = np.eye(3) if poses is None else _TO_RUN @ poses[0, :, :3] @ _TO_RUN.T
    truth = {} if poses is None else {"camera": Truth(time_s, poses[:, :, 3] @ _TO_RUN.T)}
    stereo = StereoSeries(time_s, tuple(left), tuple(right), *both, attitude)
    return [Run(folder.resolve().name, "camera", folder, {}, truth, stereo=stereo)]


def _images(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise RecordingError(f"{folder}: no such folder; a camera folder has {LEFT}/ and {RIGHT}/")
    found = sorted((path for path in folder.iterdir() if path.suffix.lower() in _IMAGES), key=_order)
    if len(found) < 2:
        raise RecordingError(f"{folder}: {len(found)} images; at least two are wanted ({', '.join(_IMAGES)})")
    return found


def _order(path: Path) -> tuple[list[tuple[int, str]], str]:
    """By name, in which numbers count as numbers: 9.png before 10.png."""
    parts = re.split(r"(\d+)", path.stem)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts], path.name


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RecordingError(f"{path}: missing; a camera folder has its calibration there") from None
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error


def projections(path: Path) -> tuple[FloatArray, FloatArray]:
    """The projection matrices (3, 4) of the left and the right eye in a calibration file; RecordingError."""
    lines = [line for line in _text(path).splitlines() if line.strip()]
    parted = [line.partition(":") for line in lines]
    named = {f"{name.strip()}:": values.split() for name, colon, values in parted if colon}
    if not named and len(lines) >= 2:
        named = {_LEFT_NAME: lines[0].split(), _RIGHT_NAME: lines[1].split()}
    return _matrix(path, named, _LEFT_NAME), _matrix(path, named, _RIGHT_NAME)


def _matrix(path: Path, named: dict[str, list[str]], name: str) -> FloatArray:
    if name not in named:
        raise RecordingError(f"{path}: no line {name} with 12 numbers")
    try:
        values = np.array([float(word) for word in named[name]])
    except ValueError as error:
        raise RecordingError(f"{path}: {name} {error}") from error
    if values.size != 12 or not np.isfinite(values).all():
        raise RecordingError(f"{path}: {name} has {values.size} numbers, want 12 finite ones")
    return values.reshape(3, 4)


def _poses(path: Path, count: int) -> FloatArray:
    """Poses (n, 3, 4)."""
    rows = [line.split() for line in _text(path).splitlines() if line.strip()]
    if len(rows) != count:
        raise RecordingError(f"{path}: {len(rows)} poses for {count} pairs of images; want one each")
    try:
        poses = np.array([[float(word) for word in row] for row in rows])
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from error
    if poses.shape != (count, 12) or not np.isfinite(poses).all():
        raise RecordingError(f"{path}: every row wants 12 finite numbers")
    return poses.reshape(-1, 3, 4)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two images as they are in their files, and their time from the run's zero."""

    time_s: float
    left: Pixels
    right: Pixels


def pairs(stereo: StereoSeries) -> Iterator[Pair]:
    """The pairs, read one by one; RecordingError on a file that is no image or of another size."""
    size: tuple[int, ...] | None = None
    for time_s, left_path, right_path in zip(stereo.time_s, stereo.left, stereo.right, strict=True):
        left, right = _image(left_path), _image(right_path)
        for path, image in ((left_path, left), (right_path, right)):
            size = size or image.shape[:2]
            if image.shape[:2] != size:
                raise RecordingError(f"{path}: {image.shape[:2]} px, but the first image has {size}")
        yield Pair(float(time_s), left, right)


def _image(path: Path) -> Pixels:
    import cv2

    try:
        data = np.fromfile(path, dtype=np.uint8)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error}") from error
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    if image is None:
        raise RecordingError(f"{path}: no image that can be read")
    return np.asarray(image)
