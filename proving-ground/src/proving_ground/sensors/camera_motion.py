"""The fast mode of the camera: the motion that stereo odometry would report, without rendering.

A few rays a frame tell how far the walls are, how much of the view moves by itself and how much contrast light and
smoke leave; from these follow the errors' sigmas and whether odometry fails. The coefficients describe a textbook
frame-to-frame odometry on pairs of our own renderer (`tests/proving_ground/test_sensors_camera_fast.py` compares).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from scipy.special import pdtr

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.camera_render import CONTRAST_GREY, TO_BODY, StereoCamera
from proving_ground.sensors.camera_world import CameraWorld, Hits, cast
from proving_ground.sensors.mounting import Mounting
from sensor_gateway.recordings.run import CameraSeries

_RAYS = (9, 7)  # across and down
_CHUNK = 500
_FAR_M = 50.0
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class OdometryQuality:
    """Errors of one frame to the next, a sigma an axis, for motion t (m) and turn θ (rad) at median depth z (m).

    Translation: z·(``still`` + ``per_m``·t + ``per_rad``·θ) + ``share``·t.
    Rotation: ``turn_still`` + ``turn_per_m``·t/z + ``turn_per_rad``·θ.
    Both grow by 1 + (``contrast``/s)², s the contrast in units of the pixel noise, and by 1/still², the part of the
    view that does not move by itself. ``scale``: sigma of the error of length that a calibration leaves, one a
    camera. Odometry fails under ``least_contrast``, and when fewer than ``least_corners`` of ``corners_per_m2`` are
    in view.
    """

    still: float = 2e-5
    per_m: float = 1.8e-3
    per_rad: float = 2.2e-3
    share: float = 2e-3
    turn_still: float = 2e-5
    turn_per_m: float = 3e-3
    turn_per_rad: float = 2e-3
    scale: float = 5e-3
    contrast: float = 2.8
    least_contrast: float = 0.5
    corners_per_m2: float = 35.0
    least_corners: int = 12


@dataclass(frozen=True)
class _View:
    """What each frame (n,) sees: median depth m, part of the view that does not move by itself, area m²."""

    depth_m: FloatArray
    still_share: FloatArray
    area_m2: FloatArray
    contrast: FloatArray  # of the textures, in units of the pixels' noise

    def ahead(self) -> "_View":
        """The worse of each frame and the next, (n - 1,): odometry needs both."""
        worse = [
            np.minimum(values[1:], values[:-1]) for values in (self.still_share, self.area_m2, self.contrast)
        ]
        return _View(0.5 * (self.depth_m[1:] + self.depth_m[:-1]), *worse)


def measure_camera(
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    camera: StereoCamera,
    quality: OdometryQuality,
    world: CameraWorld,
    rng: np.random.Generator,
) -> CameraSeries:
    """Motions from frame to frame until ``duration_s``; where odometry fails there is none."""
    time_s = np.arange(0.0, duration_s, 1.0 / camera.rate_hz)
    place_m, attitude = mounting.carried(motion, time_s)
    view = _seen(world, camera, time_s, place_m, attitude).ahead()
    back = attitude[:-1].inv()
    shift, turn = back.apply(np.diff(place_m, axis=0)), (back * attitude[1:]).as_rotvec()
    sigma_m, sigma_rad, confidence_pct = _sigmas(view, shift, turn, quality)
    noisy_shift = (1.0 + rng.normal(0.0, quality.scale)) * shift
    noisy_shift += rng.normal(0.0, 1.0, shift.shape) * sigma_m[:, None]
    noisy_turn = turn + rng.normal(0.0, 1.0, turn.shape) * sigma_rad[:, None]
    stated_m = np.hypot(sigma_m, quality.scale * np.linalg.norm(shift, axis=1))
    works = _works(view, quality, rng)
    columns = (time_s[:-1], time_s[1:], noisy_shift, noisy_turn, stated_m, sigma_rad, confidence_pct)
    return CameraSeries(*(column[works] for column in columns))


def _seen(
    world: CameraWorld,
    camera: StereoCamera,
    time_s: FloatArray,
    place_m: FloatArray,
    attitude: Rotation,
) -> _View:
    rays = _sparse_rays(camera)
    parts = []
    for start in range(0, len(time_s), _CHUNK):
        part = slice(start, start + _CHUNK)
        turned = np.einsum("mij,rj->mri", (attitude[part] * TO_BODY).as_matrix(), rays)
        hits = cast(world, time_s[part], place_m[part], turned)
        smoke = world.smoke_per_m(time_s[part], place_m[part])
        light = world.light(time_s[part], place_m[part])
        parts.append(_judged(world, camera, hits, light, smoke))
    columns = zip(
        *((part.depth_m, part.still_share, part.area_m2, part.contrast) for part in parts), strict=True
    )
    return _View(*(np.concatenate(column) for column in columns))


def _sparse_rays(camera: StereoCamera) -> FloatArray:
    """Directions (r, 3) of a coarse grid of pixels, in camera axes, with z = 1."""
    grid = camera.rays().reshape(camera.height_px, camera.width_px, 3)
    down = ((np.arange(_RAYS[1]) + 0.5) * camera.height_px / _RAYS[1]).astype(np.int64)
    across = ((np.arange(_RAYS[0]) + 0.5) * camera.width_px / _RAYS[0]).astype(np.int64)
    return np.asarray(grid[np.ix_(down, across)].reshape(-1, 3))


def _judged(
    world: CameraWorld,
    camera: StereoCamera,
    hits: Hits,
    light: FloatArray,
    smoke: FloatArray,
) -> _View:
    moving = hits.surface >= world.first_figure
    still = (hits.distance < _FAR_M) & ~moving
    distance = np.where(still, hits.distance, np.nan)
    any_still = still.any(axis=1)
    depth = np.full(len(distance), _FAR_M)
    depth[any_still] = np.nanmedian(distance[any_still], axis=1)
    pixels = camera.width_px * camera.height_px / distance.shape[1]
    area = np.nansum((distance / camera.focal_px) ** 2, axis=1) * pixels
    signal = world.contrast * CONTRAST_GREY * light * np.exp(-smoke * depth)
    return _View(depth, 1.0 - moving.mean(axis=1), area, signal / camera.noise_grey)


def _sigmas(
    view: _View, shift: FloatArray, turn: FloatArray, quality: OdometryQuality
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sigmas of translation (m) and rotation (rad) of every axis, and the confidence in per cent, (n,) each."""
    t, angle = np.linalg.norm(shift, axis=1), np.linalg.norm(turn, axis=1)
    z = view.depth_m
    noise = 1.0 + (quality.contrast / np.maximum(view.contrast, 1e-3)) ** 2
    growth = noise / np.maximum(view.still_share, 0.05) ** 2
    sigma_m = z * (quality.still + quality.per_m * t + quality.per_rad * angle) + quality.share * t
    sigma_rad = quality.turn_still + quality.turn_per_m * t / z + quality.turn_per_rad * angle
    return sigma_m * growth, sigma_rad * growth, 100.0 / growth


def _works(view: _View, quality: OdometryQuality, rng: np.random.Generator) -> BoolArray:
    """Whether odometry finds its corners: Poisson of those on the area in view."""
    failing = pdtr(quality.least_corners - 1, quality.corners_per_m2 * view.area_m2)
    lucky = rng.random(len(view.area_m2)) >= failing
    return np.asarray(lucky & (view.contrast >= quality.least_contrast))
