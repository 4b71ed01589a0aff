"""What the learned stance detector is trained on: features of a foot, and how the sole's still point truly moved.

The truth is a marker's track; where the marker sits beside the sensor is found from the track itself, attitude and
lever arm are the filter's own. So the examples tell what the filter's measurement leaves over: the velocity of the
point that the filter takes for still.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootEstimates, FootNavigator, FootSettings
from pdr_engine.foot.features import SWING_FORCE, SWING_RATE
from pdr_engine.foot.kernel import WAY_M
from pdr_engine.foot.learned import tabulate
from pdr_engine.foot.memory import FEATURES, SAMPLE, fresh_state
from pdr_engine.foot.parameters import parameters
from pdr_engine.foot.settings import FilterSettings
from proving_ground.evaluation.alignment import Track, compare, fit, interpolated
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import FEET, ImuSeries, Run

FloatArray = npt.NDArray[np.float64]
SETS = ("pyshoe-vicon", "gaitmap-example", "dualfoot-fgo")  # whose truth follows the foot
AHEAD_S = 0.041  # what the features look ahead, and a little
INTERVAL_S = 0.01  # neighbours tell the same
SPEED_EVERY, SPEED_SAMPLES = 3, 11  # at 200 Hz
VELOCITY_SPAN_S = 0.055  # of the truth's smoothed derivative
OFFSET_SPAN_S = 0.15  # over which drift does not count
OFFSET_NOISE_M = 0.01
# The detector as it is, but nothing expected of the sole: the lever arm would take part of that for its own.
WALKED_WITH = FootSettings(filter=FilterSettings(learned_motion=0.0))
STRIDE_RATE_FEATURE, STANDING_BELOW, STANDING_WEIGHT = 11, -6.0, 0.15


@dataclass(frozen=True, slots=True)
class Examples:
    """``features`` (n, FEATURES); ``velocity_m_s`` (n, 3) of the sole: along the step's way, across, up.

    ``way`` (n,): length of the step so far against the filter's `WAY_M`, 0 to 1; ``weight`` (n,).
    """

    features: FloatArray
    velocity_m_s: FloatArray
    way: FloatArray
    weight: FloatArray

    @staticmethod
    def joined(parts: Sequence["Examples"]) -> "Examples":
        """All in one table."""
        return Examples(
            *(
                np.concatenate([getattr(part, name) for part in parts])
                for name in ("features", "velocity_m_s", "way", "weight")
            )
        )


def training_feet(data: Path, name: str) -> list[tuple[Run, str]]:
    """The feet of a training set that know their own way; none if the set is not there."""
    runs = load_runs([data / name]) if (data / name).is_dir() else []
    return [(run, place) for run in runs for place in FEET if place in run.imus and place in run.truth]


def speed_examples_of(run: Run, place: str) -> Examples:
    """Features of every third sample of a foot and its true velocity there, nav axes; no way."""
    imu, truth = run.imus[place], run.truth[place]
    position = interpolated(imu.time_s, truth.time_s, truth.position_m)
    velocity = savgol_filter(
        position, SPEED_SAMPLES, 2, deriv=1, delta=float(np.median(np.diff(imu.time_s))), axis=0
    )
    navigator = FootNavigator(FootSettings(method="adaptive"))
    navigator.process(
        np.round((imu.time_s - imu.time_s[0]) * 1e9).astype(np.int64), imu.accel_m_s2, imu.gyro_rad_s
    )
    navigator.finish()
    features = features_of(imu, navigator.gyro_bias_rad_s)
    chosen = slice(None, None, SPEED_EVERY)
    return Examples(
        features[chosen], velocity[chosen], np.zeros(len(features))[chosen], _weights(features)[chosen]
    )


def _weights(features: FloatArray) -> FloatArray:
    """Long standing weighs less than motion."""
    return np.where(features[:, STRIDE_RATE_FEATURE] < STANDING_BELOW, STANDING_WEIGHT, 1.0)


def examples_of(run: Run, place: str) -> Examples:
    """Features and the sole's true motion wherever the foot is not beyond doubt in the air, every 10 ms."""
    imu, truth = run.imus[place], run.truth[place]
    navigator = FootNavigator(WALKED_WITH)
    time_ns = np.round(imu.time_s * 1e9).astype(np.int64)
    outputs = (navigator.process(time_ns, imu.accel_m_s2, imu.gyro_rad_s), navigator.finish())
    walk = FootEstimates(np.concatenate([o.rows for o in outputs]), [s for o in outputs for s in o.steps])
    used = np.searchsorted(time_ns, walk.time_ns)
    interval_s = float(np.median(np.diff(imu.time_s)))
    every = max(1, round(INTERVAL_S / interval_s))
    rate = imu.gyro_rad_s[used] - navigator.gyro_bias_rad_s
    rotation = Rotation.from_quat(walk.attitude, scalar_first=True).as_matrix()
    track = Track(walk.time_ns / 1e9, walk.position_m)
    true = interpolated(track.time_s, truth.time_s, truth.position_m)
    compared = compare(track, truth)
    true[:, :2] = (
        true[:, :2] @ fit(compared, "best-fit").rotation
    )  # into nav axes; the offset does not matter
    offset = marker_offset(true - track.position_m, rotation, round(OFFSET_SPAN_S / interval_s))
    turning = np.einsum("nij,nj->ni", rotation, np.cross(rate, navigator.lever_m))
    velocity = _derivative(true - rotation @ offset, interval_s) + turning
    ahead, way = _ways(walk)
    features = features_of(imu, navigator.gyro_bias_rad_s)[used]
    chosen = np.flatnonzero(~_swings(features))[::every]
    return Examples(
        features[chosen],
        np.column_stack([_turned(velocity, ahead), velocity[:, 2]])[chosen],
        way[chosen],
        _weights(features)[chosen] * every * interval_s,
    )


def marker_offset(apart_m: FloatArray, rotation: FloatArray, span: int) -> FloatArray:
    """Where the marker sits beside the sensor, (3,), sensor axes.

    ``apart_m`` (n, 3): marker less estimate, both in nav axes; ``rotation`` (n, 3, 3) sensor to nav. While the
    foot turns within ``span`` samples, what is apart changes by C·offset and little else. Robust least squares.
    """
    moved = (apart_m[span:] - apart_m[:-span]).reshape(-1)
    turned = (rotation[span:] - rotation[:-span]).reshape(-1, 3)
    offset: npt.NDArray[np.floating] = np.zeros(3)
    weight: FloatArray = np.ones(len(apart_m) - span)
    for _ in range(8):
        rows = np.repeat(weight, 3)
        offset = np.linalg.lstsq(turned * rows[:, None], moved * rows, rcond=None)[0]
        left = np.linalg.norm((moved - turned @ offset).reshape(-1, 3), axis=1)
        weight = 1.0 / np.sqrt(1.0 + (left / OFFSET_NOISE_M) ** 2)
    return np.asarray(offset, np.float64)


def _derivative(position_m: FloatArray, interval_s: float) -> FloatArray:
    samples = max(5, round(VELOCITY_SPAN_S / interval_s) // 2 * 2 + 1)
    return np.asarray(savgol_filter(position_m, samples, 2, deriv=1, delta=interval_s, axis=0))


def _ways(walk: FootEstimates) -> tuple[FloatArray, FloatArray]:
    """The direction from the last step's end, (n, 2), and how sure it is, (n,) from 0 to 1."""
    ends = np.array([step.time_ns for step in walk.steps], np.int64)
    last = np.searchsorted(walk.time_ns, ends)
    since = np.concatenate([[0], last])[np.searchsorted(ends, walk.time_ns, side="left")]
    way = walk.position_m[:, :2] - walk.position_m[since, :2]
    length = np.linalg.norm(way, axis=1)
    return way / np.maximum(length, 1e-9)[:, None], length / np.hypot(length, WAY_M)


def _turned(velocity: FloatArray, ahead: FloatArray) -> FloatArray:
    """Horizontal velocity along and across a direction, (n, 2)."""
    x, y = velocity[:, 0], velocity[:, 1]
    return np.column_stack([ahead[:, 0] * x + ahead[:, 1] * y, ahead[:, 0] * y - ahead[:, 1] * x])


def _swings(features: FloatArray) -> npt.NDArray[np.bool_]:
    """Where the kernel does not ask the network."""
    return np.asarray((features[:, 0] > np.log(SWING_FORCE)) | (features[:, 1] > np.log(SWING_RATE)))


def features_of(imu: ImuSeries, bias_rad_s: FloatArray) -> FloatArray:
    """What the kernel sees at every sample with this gyro bias, (n, FEATURES)."""
    settings = WALKED_WITH
    batch = np.zeros(len(imu.time_s), SAMPLE)
    batch["time_ns"] = np.round((imu.time_s - imu.time_s[0]) * 1e9)
    batch["accel"], batch["gyro"] = imu.accel_m_s2, imu.gyro_rad_s
    rows = np.zeros((len(batch), FEATURES))
    ahead = int(np.ceil(AHEAD_S / np.median(np.diff(imu.time_s))))
    tabulate(fresh_state(settings), parameters(settings), batch, bias_rad_s, ahead, rows)
    return rows
