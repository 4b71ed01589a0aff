"""A plain renderer: rectified stereo pairs of a `CameraWorld`, by casting a ray a pixel at textured surfaces.

No shadows, no reflections, no blur of motion: what visual odometry lives on (corners that move as geometry says)
and what it dies of (darkness with its noise, smoke, walls too close, people who move) is there.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import zoom
from scipy.spatial.transform import Rotation

from proving_ground.motion import FloatArray
from proving_ground.sensors.camera_world import SKY, CameraWorld, Hits, cast

Image = npt.NDArray[np.uint8]
TO_BODY = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Camera axes (x right, y down, z ahead) to body axes (forward, left, up)."""

_TEXELS = 1024
_TEXEL_M = 0.004
_LEVELS = 6
_PATCHES = ((64, 0.15), (256, 0.3))  # size in texels and weight of soft shades
_GRAIN = 0.05
_THINGS, _THING_TEXELS = 120, (12, 140)  # posters, switches, tiles, stains: how many a tile, and how large
_GREY, CONTRAST_GREY = 120.0, 70.0
_SKY_GREY, _SMOKE_GREY = 210.0, 150.0
_MOST_GAIN = 12.0


@dataclass(frozen=True, slots=True)
class StereoCamera:
    """Two alike pinhole cameras side by side; ``noise_grey``: sigma of a pixel in full light, of 255."""

    width_px: int = 320
    height_px: int = 240
    focal_px: float = 200.0
    baseline_m: float = 0.12
    rate_hz: float = 10.0
    noise_grey: float = 1.5

    @property
    def centre_px(self) -> tuple[float, float]:
        """The principal point (x, y)."""
        return 0.5 * (self.width_px - 1), 0.5 * (self.height_px - 1)

    def rays(self) -> FloatArray:
        """Directions (height·width, 3) of the pixels in camera axes, with z = 1, row by row."""
        x, y = self.centre_px
        across, down = np.meshgrid(
            (np.arange(self.width_px) - x) / self.focal_px, (np.arange(self.height_px) - y) / self.focal_px
        )
        return np.stack([across, down, np.ones_like(across)], axis=-1).reshape(-1, 3)


def render_pair(
    world: CameraWorld,
    camera: StereoCamera,
    time_s: float,
    place_m: FloatArray,
    attitude: Rotation,
    rng: np.random.Generator,
) -> tuple[Image, Image]:
    """Left and right image (height, width) of a camera body at (3,) with an attitude (body to ENU)."""
    from_camera = (attitude * TO_BODY).as_matrix()
    direction = camera.rays() @ from_camera.T
    right_m = place_m + camera.baseline_m * from_camera[:, 0]
    left, right = (_photograph(world, camera, time_s, eye_m, direction, rng) for eye_m in (place_m, right_m))
    return left, right


def _photograph(
    world: CameraWorld,
    camera: StereoCamera,
    time_s: float,
    eye_m: FloatArray,
    direction: FloatArray,
    rng: np.random.Generator,
) -> Image:
    when, where = np.array([time_s]), eye_m[None]
    return developed(camera, seen(world, camera, when, where, direction[None]), world.light(when, where), rng)


def seen(
    world: CameraWorld, camera: StereoCamera, time_s: FloatArray, eye_m: FloatArray, direction: FloatArray
) -> FloatArray:
    """Grey values in full light (m, r), without noise, along rays (m, r, 3) from eyes (m, 3) at times (m,)."""
    hits = cast(world, time_s, eye_m, direction)
    range_m = hits.distance * np.linalg.norm(direction, axis=-1)
    smoke_per_m = world.smoke_per_m(time_s, eye_m)[:, None]
    clear = np.exp(-smoke_per_m * np.minimum(range_m, 1e3))
    return np.asarray(clear * _textured(world, camera, hits) + (1.0 - clear) * _SMOKE_GREY)


def developed(camera: StereoCamera, grey: FloatArray, light: FloatArray, rng: np.random.Generator) -> Image:
    """The image (height, width) of grey values in full light: amplified as far as can be, with its noise."""
    share = float(light[0])
    gain = min(1.0 / max(share, 1e-3), _MOST_GAIN)
    exposed = gain * (share * grey + rng.normal(0.0, camera.noise_grey, grey.shape))
    image: Image = np.clip(np.round(exposed), 0, 255).astype(np.uint8)
    return image.reshape(camera.height_px, camera.width_px)


def _textured(world: CameraWorld, camera: StereoCamera, hits: Hits) -> FloatArray:
    """Grey values (m, r) of the surfaces: every surface has its own stretch of the texture and its own shade."""
    rng = np.random.default_rng(world.seed + 1)
    count = world.first_figure + len(world.figures) + 1  # the last row is for the sky, number -1
    # A row for each: who joins the view changes nobody else's look.
    look = rng.uniform([0.0, 0.0, 0.75], [_TEXELS, _TEXELS, 1.15], (count, 3))
    offsets, shades = look[:, :2], look[:, 2]
    place = np.stack([hits.along_m, hits.across_m], axis=-1)
    at = offsets[hits.surface] + (place if world.tile_m is None else place % world.tile_m) / _TEXEL_M
    footprint = hits.distance / camera.focal_px / _TEXEL_M
    level = np.log2(np.clip(footprint, 1.0, 2.0 ** (_LEVELS - 1))).astype(np.int64)
    noise = _bilinear(_pyramid(world.seed), level, (at + 0.5) / (1 << level)[..., None] - 0.5)
    grey = shades[hits.surface] * (_GREY + world.contrast * CONTRAST_GREY * noise)
    return np.where(hits.surface == SKY, _SKY_GREY, grey)


@lru_cache(maxsize=4)
def _pyramid(seed: int) -> FloatArray:
    """A texture that repeats itself and its halvings, all in one row: wide shades, fine grain, sharp corners."""
    rng = np.random.default_rng(seed)
    texture = _GRAIN * rng.normal(0.0, 1.0, (_TEXELS, _TEXELS))
    for size, weight in _PATCHES:
        patches = rng.normal(0.0, weight, (_TEXELS // size, _TEXELS // size))
        texture += zoom(patches, size, order=1, mode="grid-wrap", grid_mode=True)
    for _ in range(_THINGS):
        across, up = rng.integers(0, _TEXELS, 2)
        width, height = rng.integers(*_THING_TEXELS, 2)
        columns, rows = (np.arange(across, across + width) % _TEXELS, np.arange(up, up + height) % _TEXELS)
        texture[np.ix_(columns, rows)] += rng.normal(0.0, 1.0)
    levels = [texture]
    for _ in range(_LEVELS - 1):
        last = levels[-1]
        levels.append(0.25 * (last[::2, ::2] + last[1::2, ::2] + last[::2, 1::2] + last[1::2, 1::2]))
    return np.concatenate([texture.ravel() for texture in levels])


def _bilinear(pyramid: FloatArray, level: npt.NDArray[np.int64], at: FloatArray) -> FloatArray:
    """Values of a texture's levels (m, r), which repeat themselves, at places (m, r, 2) in texels of the level."""
    size = _TEXELS >> level
    first = (4 * (_TEXELS**2 - size**2)) // 3  # texels of all larger levels: a geometric series
    low = np.floor(at).astype(np.int64)
    x, y = np.moveaxis(at - low, -1, 0)
    left, top = np.moveaxis(low, -1, 0)
    mask = size - 1  # sizes are powers of two
    column, next_column = first + (left & mask) * size, first + ((left + 1) & mask) * size
    row, next_row = top & mask, (top + 1) & mask
    above = (1.0 - x) * pyramid[column + row] + x * pyramid[next_column + row]
    below = (1.0 - x) * pyramid[column + next_row] + x * pyramid[next_column + next_row]
    return np.asarray((1.0 - y) * above + y * below)
