"""Rendered stereo sequences for odometry, and the motion that truly lay between two of their pairs."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion, symmetric
from proving_ground.motion import Motion
from proving_ground.sensors import CameraWorld, StereoCamera, render_pair
from proving_ground.sensors.camera_render import Image
from sensor_gateway.stereo import StereoCalibration, StereoOdometry, Verdict

FloatArray = npt.NDArray[np.float64]
SMALL = StereoCamera(width_px=256, height_px=192, focal_px=160.0)


@dataclass(frozen=True)
class Sequence:
    """Pairs at a steady rate, and the body's places (n, 3) and attitudes."""

    pairs: tuple[tuple[Image, Image], ...]
    place_m: FloatArray
    attitude: Rotation

    def error(self, motion: CameraMotion, rate_hz: float) -> FloatArray:
        """Translation and rotation of a motion less the true ones, (6,), in the body's axes at its start."""
        first, last = (round(ns * rate_hz / 1e9) for ns in (motion.start_time_ns, motion.time_ns))
        back = self.attitude[first].inv()
        shift = back.apply(self.place_m[last] - self.place_m[first])
        turn = Rotation.from_rotvec(motion.rotation_rad) * (back * self.attitude[last]).inv()
        return np.concatenate([np.array(motion.translation_m) - shift, turn.as_rotvec()])


def render(
    world: CameraWorld, motion: Motion, seconds: float, camera: StereoCamera = SMALL, seed: int = 0
) -> Sequence:
    """What a camera sees that moves so."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, seconds, 1.0 / camera.rate_hz)
    place_m, attitude = motion.at(time_s)
    pairs = (
        render_pair(world, camera, float(when), place_m[number], attitude[number], rng)
        for number, when in enumerate(time_s)
    )
    return Sequence(tuple(pairs), place_m, attitude)


@lru_cache(maxsize=4)
def rendered(world: CameraWorld, motion: Motion, seconds: float) -> Sequence:
    """The same, kept for the next test."""
    return render(world, motion, seconds)


def calibration(camera: StereoCamera = SMALL) -> StereoCalibration:
    """Of a rendered camera."""
    x, y = camera.centre_px
    return StereoCalibration(camera.focal_px, camera.focal_px, x, y, x, camera.baseline_m)


def told(sequence: Sequence, camera: StereoCamera = SMALL) -> list[CameraMotion | Verdict]:
    """What odometry says to every pair."""
    odometry = StereoOdometry(calibration(camera))
    period_ns = round(1e9 / camera.rate_hz)
    return [odometry.feed(number * period_ns, *pair) for number, pair in enumerate(sequence.pairs)]


def nees(motion: CameraMotion, error: FloatArray) -> float:
    """An error (6,) in units of what a motion claims: 6 when honest."""
    assert motion.covariance is not None
    return float(error @ np.linalg.solve(symmetric(motion.covariance), error))
