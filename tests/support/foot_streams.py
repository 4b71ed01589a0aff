"""Inertial streams of one foot, constructed: at rest, turning, walking, mounted any way."""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootEstimates, FootNavigator, FootSettings, FootStepEstimate
from support.walking_foot import walking_foot

GRAVITY = 9.81
START_NS = 1_700_000_000_000_000_000


@dataclass
class Stream:
    """``time_ns`` (n,), ``accel`` (n, 3) m/s², ``gyro`` (n, 3) rad/s."""

    time_ns: np.ndarray
    accel: np.ndarray
    gyro: np.ndarray

    @staticmethod
    def joined(*parts: "Stream") -> "Stream":
        """One after the other, each beginning one sample after the end of the one before."""
        times = parts[0].time_ns
        for part in parts[1:]:
            interval = part.time_ns[1] - part.time_ns[0]
            times = np.concatenate([times, part.time_ns - part.time_ns[0] + times[-1] + interval])
        return Stream(
            times, np.vstack([part.accel for part in parts]), np.vstack([part.gyro for part in parts])
        )

    def mounted(self, mounting: Rotation) -> "Stream":
        """The same motion felt by a sensor with other axes."""
        return Stream(self.time_ns.copy(), mounting.apply(self.accel), mounting.apply(self.gyro))

    def only(self, chosen: np.ndarray) -> "Stream":
        """Some of the samples."""
        return Stream(self.time_ns[chosen], self.accel[chosen], self.gyro[chosen])


def turning(
    duration_s: float,
    rate_rad_s: float,
    axis: int = 2,
    rate_hz: float = 200.0,
    noise: float = 1.0,
    seed: int = 3,
) -> Stream:
    """A steady turn about one axis, gravity always along z."""
    count = round(duration_s * rate_hz)
    rng = np.random.default_rng(seed)
    accel = rng.normal(size=(count, 3)) * 0.02 * noise + [0.0, 0.0, GRAVITY]
    gyro = rng.normal(size=(count, 3)) * 0.001 * noise
    gyro[:, axis] += rate_rad_s
    return Stream(START_NS + np.round(np.arange(count) * 1e9 / rate_hz).astype(np.int64), accel, gyro)


def still(duration_s: float, rate_hz: float = 200.0, noise: float = 1.0, seed: int = 5) -> Stream:
    """A sensor at rest, z up."""
    return turning(duration_s, 0.0, rate_hz=rate_hz, noise=noise, seed=seed)


def walk(strides: int = 8, seed: int = 0) -> Stream:
    """Two seconds of rest, strides of 1.3 m with a quarter turn to the left at every fifth, two seconds of rest."""
    foot = walking_foot(strides, seed)
    return Stream(START_NS + np.round(foot.time_s * 1e9).astype(np.int64), foot.imu[:, :3], foot.imu[:, 3:])


@dataclass
class Track:
    """All that a navigator made of a stream."""

    time_ns: np.ndarray
    position_m: np.ndarray
    yaw_rad: np.ndarray
    stance: np.ndarray
    steps: list[FootStepEstimate]
    counters: dict[str, int]


def navigate(stream: Stream, cuts: list[int] | None = None, foot: FootSettings | None = None) -> Track:
    """Run a stream through a fresh navigator in batches cut at these indexes."""
    navigator = FootNavigator(foot)
    bounds = [0, *sorted(cuts or []), len(stream.time_ns)]
    outputs = [
        navigator.process(stream.time_ns[a:b], stream.accel[a:b], stream.gyro[a:b])
        for a, b in itertools.pairwise(bounds)
    ]
    return gathered([*outputs, navigator.finish()], navigator)


def gathered(outputs: list[FootEstimates], navigator: FootNavigator) -> Track:
    """Outputs in a row as one track."""
    return Track(
        *(
            np.concatenate([getattr(output, name) for output in outputs])
            for name in ("time_ns", "position_m", "yaw_rad", "stance")
        ),
        steps=[step for output in outputs for step in output.steps],
        counters=navigator.counters(),
    )
