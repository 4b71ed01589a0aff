"""What real stereo cameras do to images that are called rectified: a shutter that rolls, exposures that take time,
an eye that has been knocked, lenses whose distortion was not all taken out, dark corners, gains that flicker.

All but light is done to the rays before they are cast, not to the image after: so it is the geometry that is wrong.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.camera_render import TO_BODY, Image, StereoCamera, developed, seen
from proving_ground.sensors.camera_world import CameraWorld
from proving_ground.sensors.mounting import Mounting


@dataclass(frozen=True, slots=True)
class Bursts:
    """Longer exposures of ``exposure_s``, for the last ``length_s`` of every ``period_s``."""

    period_s: float
    length_s: float
    exposure_s: float


@dataclass(frozen=True, slots=True)
class Defects:
    """What a camera does that its calibration does not say.

    ``rolling_s``: from the first row's moment to the last one's; the middle row's is the image's. ``exposure_s``:
    in which each row gathers light. ``right_turn_rad``: rotation vector of the right eye, camera axes (right, down,
    ahead). ``right_focal``: its focal length over the calibration's. ``radial``: what is left of both lenses' first
    radial coefficient. ``vignetting``: share of light missing in the corners. ``flicker``: sigma of the logarithm
    of each image's gain, ``right_gain`` the right eye's own. ``from_s``: before it the right eye is as calibrated.
    """

    rolling_s: float = 0.0
    exposure_s: float = 0.0
    bursts: Bursts | None = None
    right_turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    right_focal: float = 1.0
    radial: float = 0.0
    vignetting: float = 0.0
    flicker: float = 0.0
    right_gain: float = 1.0
    from_s: float = -np.inf

    def exposure_at(self, time_s: float) -> float:
        """How long the image of that time is exposed, s."""
        bursts = self.bursts
        if bursts is not None and time_s % bursts.period_s >= bursts.period_s - bursts.length_s:
            return bursts.exposure_s
        return self.exposure_s


@dataclass(frozen=True, slots=True)
class Carried:
    """A camera on a moving body, as a motion of its own."""

    motion: Motion
    mounting: Mounting

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Position (n, 3) and attitude of the camera."""
        return self.mounting.carried(self.motion, time_s)


_MOST_EXPOSURES, _BLUR_STEP_S = 9, 0.006


def defective_pair(
    world: CameraWorld,
    camera: StereoCamera,
    defects: Defects,
    motion: Motion,
    time_s: float,
    rng: np.random.Generator,
) -> tuple[Image, Image]:
    """Left and right image (height, width) of a camera body that moves so."""
    gain = float(np.exp(defects.flicker * rng.normal()))
    left = _photograph(world, camera, defects, motion, time_s, gain, False, rng)
    right = _photograph(world, camera, defects, motion, time_s, gain * defects.right_gain, True, rng)
    return left, right


def _photograph(
    world: CameraWorld,
    camera: StereoCamera,
    defects: Defects,
    motion: Motion,
    time_s: float,
    gain: float,
    right: bool,
    rng: np.random.Generator,
) -> Image:
    """The mean of what each row sees while it is exposed."""
    rays = _rays(camera, defects, right and time_s >= defects.from_s)
    exposure_s = defects.exposure_at(time_s)
    count = min(_MOST_EXPOSURES, 1 + round(exposure_s / _BLUR_STEP_S))
    rows_s = time_s + defects.rolling_s * (np.arange(camera.height_px) / (camera.height_px - 1) - 0.5)
    grey = np.zeros(rays.shape[:2])
    for share in (np.arange(count) + 0.5) / count - 0.5:
        grey += _row_by_row(world, camera, motion, rows_s + share * exposure_s, rays, right) / count
    middle_m, _ = motion.at(np.array([time_s]))
    light = world.light(np.array([time_s]), middle_m)
    return developed(camera, (gain * _brightness(camera, defects) * grey).ravel(), light, rng)


def _row_by_row(
    world: CameraWorld,
    camera: StereoCamera,
    motion: Motion,
    rows_s: FloatArray,
    rays: FloatArray,
    right: bool,
) -> FloatArray:
    """Grey values (height, width), each row seen from where the camera is at its own moment."""
    place_m, attitude = motion.at(rows_s)
    turned = (attitude * TO_BODY).as_matrix()
    eye_m = place_m + (camera.baseline_m if right else 0.0) * turned[:, :, 0]
    return seen(world, camera, rows_s, eye_m, np.einsum("mij,mrj->mri", turned, rays))


def _rays(camera: StereoCamera, defects: Defects, is_off: bool) -> FloatArray:
    """Directions (height, width, 3) in which the pixels really look, in camera axes as calibrated."""
    rays = camera.rays().reshape(camera.height_px, camera.width_px, 3)
    rays[..., :2] *= 1.0 + defects.radial * (rays[..., :2] ** 2).sum(axis=-1, keepdims=True)
    if is_off:
        rays[..., :2] /= defects.right_focal
        rays = rays @ Rotation.from_rotvec(defects.right_turn_rad).as_matrix().T
    return rays


def _brightness(camera: StereoCamera, defects: Defects) -> FloatArray:
    """Share of light (height, width) that comes through: all in the middle, least in the corners."""
    rays = camera.rays().reshape(camera.height_px, camera.width_px, 3)
    square = (rays[..., :2] ** 2).sum(axis=-1)
    return np.asarray(1.0 - defects.vignetting * square / square.max())
