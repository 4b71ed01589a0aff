"""Cuts what an inertial unit on a foot measured into strides and rebuilds each one's motion, recorded or simulated.

The foot INS tells where the foot stands. From mid-stance to mid-stance attitude and place are integrated anew:
level by gravity at both ends, at rest at both ends, what is left over spread evenly. The foot's own axes (forward,
left, up) come from the data: feet turn about their left-right axis, and the toe points down further than up.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootNavigator
from sensor_gateway.recordings.run import ImuSeries

FloatArray = npt.NDArray[np.float64]
GRAVITY_M_S2 = 9.80665
_MERGE_S = 0.1  # stances closer than this are one
_LONG_S = 0.8  # a stance longer than this is a stop: the stride begins or ends this far from its edge
_EDGE_S = 0.2
_STRIDE_S = (0.3, 2.5)
_LEVEL_S = 0.03  # gravity is read over this much at both sides of mid-stance
_ENERGY_S = 0.06


@dataclass(frozen=True, slots=True)
class Stride:
    """One stride, mid-stance to mid-stance, n samples at ``time_s`` (n,), zero at its begin.

    ``position_m`` and ``velocity_m_s`` (n, 3) of the sensor, level frame whose x axis is the foot's heading at the
    begin; ``attitude`` (n) foot to that frame; ``force_m_s2`` and ``rate_rad_s`` (n, 3) in the foot's axes;
    ``standing_s``: how long the stance was that the stride begins with, ``begin_s`` when it began in the recording;
    ``axes`` (3, 3): forward, left and up of the foot in the sensor's axes, as rows.
    """

    begin_s: float
    time_s: FloatArray
    position_m: FloatArray
    velocity_m_s: FloatArray
    attitude: Rotation
    force_m_s2: FloatArray
    rate_rad_s: FloatArray
    standing_s: float
    axes: FloatArray

    @property
    def duration_s(self) -> float:
        """Mid-stance to mid-stance."""
        return float(self.time_s[-1])

    @property
    def length_m(self) -> float:
        """Horizontal."""
        return float(np.hypot(*self.position_m[-1, :2]))

    @property
    def rise_m(self) -> float:
        """How much higher the foot stands afterwards."""
        return float(self.position_m[-1, 2])

    @property
    def euler_rad(self) -> FloatArray:
        """Yaw, pitch (toe down positive) and roll, (n, 3), unwrapped."""
        return np.unwrap(self.attitude.as_euler("ZYX"), axis=0)


@dataclass(frozen=True, slots=True)
class _Stance:
    """Indices: the still episode, and where the stride before ends and the one after begins."""

    first: int
    last: int
    arrive: int
    leave: int


def strides_of(imu: ImuSeries) -> list[Stride]:
    """All whole strides of one foot, in order; a stop ends one stride and begins another."""
    stances, bias = _stances(imu)
    rough = [
        (begin, _integrated(imu, bias, begin.leave, end.arrive))
        for begin, end in itertools.pairwise(stances)
        if _STRIDE_S[0] <= imu.time_s[end.arrive] - imu.time_s[begin.leave] <= _STRIDE_S[1]
    ]
    if not rough:
        return []
    axes = _foot_axes([track for _, track in rough])
    return [_in_foot_axes(imu, stance, track, axes) for stance, track in rough]


def _stances(imu: ImuSeries) -> tuple[list[_Stance], FloatArray]:
    """Where the foot INS found the foot at rest, and the gyro bias it ended with."""
    still, bias = _still(imu)
    interval_s = float(np.median(np.diff(imu.time_s)))
    width = max(3, round(_ENERGY_S / interval_s))
    energy = np.convolve(((imu.gyro_rad_s - bias) ** 2).sum(axis=1), np.ones(width) / width, "same")
    level = max(2, round(_LEVEL_S / interval_s))
    edge = round(_EDGE_S / interval_s)
    found = []
    for first, last in _merged(still, round(_MERGE_S / interval_s)):
        if imu.time_s[last] - imu.time_s[first] < _LONG_S:
            middle = first + int(np.argmin(energy[first : last + 1]))
            arrive = leave = middle
        else:
            arrive, leave = first + edge, last - edge
        if arrive >= level and leave < len(still) - level:
            found.append(_Stance(first, last, arrive, leave))
    return found, bias


def _still(imu: ImuSeries) -> tuple[npt.NDArray[np.bool_], FloatArray]:
    navigator = FootNavigator()
    time_ns = np.round((imu.time_s - imu.time_s[0]) * 1e9).astype(np.int64)
    outputs = [navigator.process(time_ns, imu.accel_m_s2, imu.gyro_rad_s), navigator.finish()]
    known_ns = np.concatenate([output.time_ns for output in outputs])
    stance = np.concatenate([output.stance for output in outputs]).astype(np.float64)
    return np.interp(time_ns, known_ns, stance) > 0.5, navigator.gyro_bias_rad_s


def _merged(still: npt.NDArray[np.bool_], gap: int) -> list[tuple[int, int]]:
    """First and last index of the episodes, those less than ``gap`` apart joined."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    episodes: list[tuple[int, int]] = []
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if episodes and first - episodes[-1][1] < gap:
            episodes[-1] = (episodes[-1][0], after - 1)
        else:
            episodes.append((first, after - 1))
    return episodes


@dataclass(frozen=True, slots=True)
class _RoughTrack:
    """A stride in the sensor's axes."""

    span: slice
    attitude: Rotation
    position_m: FloatArray
    velocity_m_s: FloatArray
    rate_rad_s: FloatArray
    force_m_s2: FloatArray
    up: FloatArray  # in sensor axes, at the begin


def _integrated(imu: ImuSeries, bias: FloatArray, begin: int, end: int) -> _RoughTrack:
    span = slice(begin, end + 1)
    time_s = imu.time_s[span]
    step_s = np.diff(time_s)
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    rate = imu.gyro_rad_s[span] - bias
    up, up_after = (_up(imu, index) for index in (begin, end))
    attitude = _attitudes(rate, step_s, Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])[0])
    tilt_error = np.cross(attitude[-1].apply(up_after), [0.0, 0.0, 1.0])
    attitude = Rotation.from_rotvec(share[:, None] * tilt_error) * attitude
    level = 0.5 * (np.linalg.norm(_force(imu, begin)) + np.linalg.norm(_force(imu, end)))
    force = imu.accel_m_s2[span] * (GRAVITY_M_S2 / level)
    velocity = _cumulated(attitude.apply(force) - [0.0, 0.0, GRAVITY_M_S2], step_s)
    velocity -= share[:, None] * velocity[-1]
    return _RoughTrack(span, attitude, _cumulated(velocity, step_s), velocity, rate, force, up)


def _force(imu: ImuSeries, index: int) -> FloatArray:
    reach = max(2, round(_LEVEL_S / float(np.median(np.diff(imu.time_s)))))
    return np.asarray(imu.accel_m_s2[index - reach : index + reach + 1].mean(axis=0))


def _up(imu: ImuSeries, index: int) -> FloatArray:
    force = _force(imu, index)
    return np.asarray(force / np.linalg.norm(force))


def _attitudes(rate_rad_s: FloatArray, step_s: FloatArray, start: Rotation) -> Rotation:
    """The attitude at every sample, trapezoidal."""
    turns = Rotation.from_rotvec(0.5 * (rate_rad_s[1:] + rate_rad_s[:-1]) * step_s[:, None]).as_matrix()
    matrices = [start.as_matrix()]
    for turn in turns:
        matrices.append(matrices[-1] @ turn)
    return Rotation.from_matrix(np.array(matrices))


def _cumulated(values: FloatArray, step_s: FloatArray) -> FloatArray:
    """Trapezoidal integral from zero, (n, 3)."""
    pieces = 0.5 * (values[1:] + values[:-1]) * step_s[:, None]
    return np.vstack([np.zeros(3), np.cumsum(pieces, axis=0)])


def _foot_axes(tracks: Sequence[_RoughTrack]) -> FloatArray:
    """Rows: forward, left, up of the foot in sensor axes, (3, 3)."""
    up = np.mean([track.up for track in tracks], axis=0)
    up /= np.linalg.norm(up)
    rates = np.concatenate([track.rate_rad_s for track in tracks])
    left = np.linalg.eigh(rates.T @ rates)[1][:, -1]
    left = left - up * (left @ up)
    left /= np.linalg.norm(left)
    axes = np.array([np.cross(left, up), left, up])
    pitches = [np.arcsin(np.clip(-_in_level(track, axes)[:, 2, 0], -1.0, 1.0)) for track in tracks]
    down, upwards = (np.median([getattr(pitch, end)() for pitch in pitches]) for end in ("max", "min"))
    return axes if down > -upwards else axes * [[-1.0], [-1.0], [1.0]]


def _in_level(track: _RoughTrack, axes: FloatArray) -> FloatArray:
    return np.asarray((track.attitude * Rotation.from_matrix(axes.T)).as_matrix())


def _in_foot_axes(imu: ImuSeries, stance: _Stance, track: _RoughTrack, axes: FloatArray) -> Stride:
    attitude = track.attitude * Rotation.from_matrix(axes.T)
    forward = attitude[0].as_matrix()[:, 0]
    level = Rotation.from_euler("z", -np.arctan2(forward[1], forward[0]))
    time_s = imu.time_s[track.span]
    return Stride(
        begin_s=float(time_s[0]),
        time_s=time_s - time_s[0],
        position_m=level.apply(track.position_m),
        velocity_m_s=level.apply(track.velocity_m_s),
        attitude=level * attitude,
        force_m_s2=track.force_m_s2 @ axes.T,
        rate_rad_s=track.rate_rad_s @ axes.T,
        standing_s=float(imu.time_s[stance.last] - imu.time_s[stance.first]),
        axes=axes,
    )
