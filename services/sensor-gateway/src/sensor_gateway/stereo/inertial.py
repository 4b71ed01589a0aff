"""Stereo odometry with a co-located inertial unit: it levels the motions, bridges moments, and sees through crowds.

What the camera tells is compared with what the unit foretells since the key frame: a view that moves by itself
moves without any acceleration. Where the camera tells nothing the unit carries on, for half a second.
"""

from collections import deque
from dataclasses import dataclass, field

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.messages import CameraMotion, symmetric, upper_triangle
from sensor_gateway.stereo.calibration import FloatArray
from sensor_gateway.stereo.health import WORDS, Verdict
from sensor_gateway.stereo.images import Pixels
from sensor_gateway.stereo.inertial_filter import THETA, InertialFilter, P, UnitQuality, cross
from sensor_gateway.stereo.odometry import StereoOdometry

_GATE = 33.1  # chi-square of six numbers, 0.99999
_BRIDGED_NS = 500_000_000
_LEVEL_SAMPLES, _MOST_SAMPLES = 20, 4000
_BLIND_CONFIDENCE_PCT = 10.0


@dataclass(frozen=True, slots=True)
class Sample:
    """Specific force m/s² and rate rad/s (3,) in the camera body's axes."""

    time_ns: int
    force: FloatArray
    rate: FloatArray


@dataclass
class _Key:
    """The filter's attitude at the camera's key frame, how sure its tilt was, and the newest time with sight."""

    time_ns: int
    attitude: Rotation
    tilt: FloatArray
    seen_ns: int = field(init=False)

    def __post_init__(self) -> None:
        self.seen_ns = self.time_ns


class InertialOdometry:
    """As `StereoOdometry`, with samples of an inertial unit fed in between, in order of time."""

    def __init__(self, odometry: StereoOdometry, quality: UnitQuality | None = None) -> None:
        self._odometry = odometry
        self._quality = UnitQuality() if quality is None else quality
        self._waiting: deque[Sample] = deque(maxlen=_MOST_SAMPLES)
        self._newest: Sample | None = None
        self._filter: InertialFilter | None = None
        self._key: _Key | None = None
        self._bridges = 0

    def feed_sample(self, sample: Sample) -> None:
        """A sample of the unit; what is not finite is left out."""
        if np.isfinite(sample.force).all() and np.isfinite(sample.rate).all():
            self._waiting.append(sample)

    def feed(self, time_ns: int, left: Pixels, right: Pixels) -> CameraMotion | Verdict:
        """Take the next pair, after all samples up to it."""
        told = self._odometry.feed(time_ns, left, right)
        self._go_on(time_ns)
        if self._filter is None:
            return told
        if isinstance(told, Verdict):
            return self._blind(told, self._filter)
        return self._checked(told, self._filter)

    def _go_on(self, time_ns: int) -> None:
        """Predict up to the pair; begin when there are samples enough to level by."""
        due: list[Sample] = []
        while self._waiting and self._waiting[0].time_ns <= time_ns:
            due.append(self._waiting.popleft())
        if self._filter is None and len(due) >= _LEVEL_SAMPLES:
            self._filter = InertialFilter(np.mean([one.force for one in due], axis=0), self._quality)
            self._newest, due = due[-1], []
        for sample in due:
            if self._filter is not None and self._newest is not None:
                seconds = (sample.time_ns - self._newest.time_ns) / 1e9
                self._filter.predict(seconds, sample.force, sample.rate)
            self._newest = sample

    def _checked(self, motion: CameraMotion, inertial: InertialFilter) -> CameraMotion | Verdict:
        """The camera's motion, levelled, if the unit has felt as much."""
        key = self._key
        if key is None or key.time_ns != motion.start_time_ns:
            self._begin_key(motion.time_ns, inertial)
            return motion
        residual, noise = _compared(motion, key, inertial)
        if inertial.surprise(residual, noise) > _GATE:
            self._odometry.restart()
            self._key = None
            return Verdict(motion.time_ns, "crowd", WORDS["crowd"])
        key.seen_ns = motion.time_ns
        up = key.attitude.inv().apply([0.0, 0.0, 1.0])
        levelled = msgspec.structs.replace(motion, up=(float(up[0]), float(up[1]), float(up[2])))
        if self._odometry.key_time_ns == motion.time_ns:
            inertial.correct(residual, noise)
            self._begin_key(motion.time_ns, inertial)
        return levelled

    def _begin_key(self, time_ns: int, inertial: InertialFilter) -> None:
        """Follow the camera's key frame, if it is here and now."""
        if self._odometry.key_time_ns != time_ns:
            return
        inertial.begin_key()
        self._key = _Key(time_ns, inertial.attitude, inertial.covariance[THETA, THETA].copy())

    def _blind(self, verdict: Verdict, inertial: InertialFilter) -> CameraMotion | Verdict:
        """The unit alone, for a moment."""
        key = self._key
        if verdict.condition == "starting":
            self._key = None
            self._begin_key(verdict.time_ns, inertial)
        bridged = key is not None and verdict.time_ns - key.seen_ns <= _BRIDGED_NS
        if key is None or not bridged or self._odometry.key_time_ns != key.time_ns:
            return verdict
        return _foretold(verdict.time_ns, key, inertial)


def _compared(motion: CameraMotion, key: _Key, inertial: InertialFilter) -> tuple[FloatArray, FloatArray]:
    """Residual (6,) of position and attitude, level axes, and its noise (6, 6).

    The key frame's own tilt is not the filter's to know better by this: its doubt counts as noise.
    """
    matrix = key.attitude.as_matrix()
    shift = matrix @ np.array(motion.translation_m)
    seen = key.attitude * Rotation.from_rotvec(motion.rotation_rad)
    turn = (seen * inertial.attitude.inv()).as_rotvec()
    assert motion.covariance is not None
    turned = np.kron(np.eye(2), matrix)
    noise = turned @ symmetric(motion.covariance) @ turned.T
    tilted = np.vstack([-cross(shift), np.eye(3)])
    noise += tilted @ key.tilt @ tilted.T
    return np.concatenate([shift - inertial.position, turn]), noise


def _foretold(time_ns: int, key: _Key, inertial: InertialFilter) -> CameraMotion:
    """The motion since the key frame by the unit alone."""
    back = key.attitude.inv()
    shift, turn = back.apply(inertial.position), (back * inertial.attitude).as_rotvec()
    turned = np.kron(np.eye(2), back.as_matrix())
    pose = [*range(P.start, P.stop), *range(THETA.start, THETA.stop)]
    covariance = turned @ inertial.covariance[np.ix_(pose, pose)] @ turned.T
    up = back.apply([0.0, 0.0, 1.0])
    return CameraMotion(
        time_ns=time_ns,
        start_time_ns=key.time_ns,
        translation_m=(float(shift[0]), float(shift[1]), float(shift[2])),
        rotation_rad=(float(turn[0]), float(turn[1]), float(turn[2])),
        covariance=upper_triangle(covariance + 1e-12 * np.eye(6)),
        confidence_pct=_BLIND_CONFIDENCE_PCT,
        up=(float(up[0]), float(up[1]), float(up[2])),
    )
