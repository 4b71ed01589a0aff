"""What an inertial unit on a moving body measures: specific force, rate and field in its own axes, with its errors.

The order is the hardware's: motion at the place of mounting, low-pass or integration with its noise, g-sensitivity,
scale and misalignment, bias, saturation, quantisation, then what the line does to samples and stamps.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import butter, lfilter
from scipy.spatial.transform import Rotation

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.imu_quality import ImuClass, TriadQuality
from proving_ground.sensors.magnetics import Magnetics, measure_field
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.randomness import coarse, flicker, interpolated
from sensor_gateway.recordings.run import ImuSeries

GRAVITY_M_S2 = 9.80665
_INNER_MEANS, _INNER_FILTERED = 2, 4  # samples of the motion a sample of the unit
_WIDEST = 0.45  # of the inner rate: a wider band than that cannot be told
_SETTLING_S = 0.05  # before time zero, for the low-pass
_BIAS_PERIOD_S = 1.0
_APART_S = 1e-6  # least distance of two stamps

_UP = np.array([0.0, 0.0, GRAVITY_M_S2])


def measure_imu(
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    quality: ImuClass,
    surroundings: Magnetics | None,
    rng: np.random.Generator,
) -> ImuSeries:
    """Samples from time zero to ``duration_s``; with a field where there are surroundings to have one."""
    inner = _followed(motion, duration_s, mounting, quality)
    instants_s, stamps_s = _times(duration_s, quality, rng)
    force = _sampled(
        inner.time_s, inner.velocity_steps, instants_s, quality, quality.accel.noise_density, rng
    )
    rate = _sampled(inner.time_s, inner.turn_steps, instants_s, quality, quality.gyro.noise_density, rng)
    rate += force @ rng.normal(0.0, quality.g_sensitivity, (3, 3))
    accel = _read_out(force, quality.accel, instants_s, rng)
    gyro = _read_out(rate, quality.gyro, instants_s, rng)
    mag = None
    if surroundings is not None:
        nodes = inner.nearest(instants_s)
        place_m, attitude = inner.place_m[nodes], inner.body[nodes] * mounting.rotation
        mag = measure_field(surroundings, instants_s, place_m, attitude, quality.magnetometer, rng)
    kept = _kept(len(instants_s), quality.loss_share, quality.loss_run, rng)
    return ImuSeries(stamps_s[kept], accel[kept], gyro[kept], None if mag is None else mag[kept])


@dataclass(frozen=True)
class _Inner:
    """The motion on a fine grid: ``time_s`` (n,), the sensor's place and the body's attitude.

    In the steps between, specific force and rate in sensor axes add up to ``velocity_steps`` m/s and ``turn_steps``
    rad (n - 1, 3).
    """

    time_s: FloatArray
    velocity_steps: FloatArray
    turn_steps: FloatArray
    place_m: FloatArray
    body: Rotation

    def nearest(self, time_s: FloatArray) -> npt.NDArray[np.int64]:
        """The numbers of the grid's times nearest to these (k,)."""
        number = (time_s - self.time_s[0]) / (self.time_s[1] - self.time_s[0])
        return np.asarray(np.clip(np.rint(number), 0, len(self.time_s) - 1), dtype=np.int64)


def _followed(motion: Motion, duration_s: float, mounting: Mounting, quality: ImuClass) -> _Inner:
    """Differences of the fourth order and a cubic rule between them: 1 % is lost at 50 Hz, 5 to 15 % at 100 Hz.

    An integrating unit's samples fall on the grid, a filtering one's, which are interpolated, in mid step.
    """
    step_s = 1.0 / (quality.rate_hz * (_INNER_MEANS if quality.integrates else _INNER_FILTERED))
    before = round(_SETTLING_S / step_s) + 3
    count = before + int(np.ceil(duration_s / step_s)) + 5
    number = np.arange(-before, count - before) + (0.0 if quality.integrates else 0.5)
    time_s = np.asarray(number * step_s, dtype=np.float64)
    place, body = motion.at(time_s)
    place = place + body.apply(mounting.offset_m)
    near, far = place[3:-1] + place[1:-3], place[4:] + place[:-4]
    acceleration = (16.0 * near - far - 30.0 * place[2:-2]) / (12.0 * step_s**2)
    to_sensor = mounting.rotation.as_matrix()  # for rows: sensor = body @ matrix
    force = body[2:-2].apply(acceleration + _UP, inverse=True) @ to_sensor
    velocity_steps = (13.0 * (force[1:-2] + force[2:-1]) - force[:-3] - force[3:]) * (step_s / 24.0)
    turn_steps = _turns(body.as_quat()[3:-3]) @ to_sensor
    return _Inner(time_s[3:-3], velocity_steps, turn_steps, place[3:-3], body[3:-3])


def _turns(quaternion: FloatArray) -> FloatArray:
    """Rotation vectors (n - 1, 3) from each attitude (n, 4: x, y, z, w) to the next, in body axes.

    As ``(R[:-1].inv() * R[1:]).as_rotvec()``, at a tenth of the time.
    """
    v, w = quaternion[:-1, :3], quaternion[:-1, 3:]
    next_v, next_w = quaternion[1:, :3], quaternion[1:, 3:]
    sine = w * next_v - next_w * v - np.cross(v, next_v)
    cosine = w * next_w + (v * next_v).sum(axis=1, keepdims=True)
    size = np.linalg.norm(sine, axis=1, keepdims=True)
    half = np.arctan2(size, np.abs(cosine)) * np.sign(np.where(cosine == 0.0, 1.0, cosine))
    return np.asarray(np.where(size > 1e-12, 2.0 * half / np.maximum(size, 1e-300), 2.0) * sine)


def _times(duration_s: float, quality: ImuClass, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """When samples are taken, and what their stamps say, (n,) each."""
    period_s = (1.0 + rng.normal(0.0, quality.clock_ppm * 1e-6)) / quality.rate_hz
    nominal = np.arange(0.0, duration_s, period_s)
    count = len(nominal)
    instants = nominal + np.clip(rng.normal(0.0, 1.0, count), -3.0, 3.0) * quality.sample_jitter_s
    stamps = nominal + rng.normal(0.0, quality.stamp_jitter_s, count)
    stamps += np.where(rng.random(count) < quality.late_share, rng.exponential(quality.late_s, count), 0.0)
    apart = np.arange(count) * _APART_S
    return np.clip(instants, 0.0, duration_s), np.maximum.accumulate(stamps - apart) + apart


def _sampled(
    inner_s: FloatArray,
    steps: FloatArray,
    instants_s: FloatArray,
    quality: ImuClass,
    noise_density: float,
    rng: np.random.Generator,
) -> FloatArray:
    """What the unit outputs at its instants (n, 3), with white noise: means since the one before, or low-passed."""
    inner_hz = 1.0 / (inner_s[1] - inner_s[0])
    if quality.integrates:
        means = _means(inner_s, steps, instants_s, 1.0 / quality.rate_hz)
        return means + rng.normal(0.0, noise_density * np.sqrt(0.5 * quality.rate_hz), means.shape)
    signal = steps * inner_hz
    noisy = signal + rng.normal(0.0, noise_density * np.sqrt(0.5 * inner_hz), signal.shape)
    b, a = butter(2, min(quality.bandwidth_hz, _WIDEST * inner_hz), fs=inner_hz)
    filtered, _ = lfilter(b, a, noisy, axis=0, zi=np.outer(_settled(b, a), signal[0]))
    return interpolated(instants_s, 0.5 * (inner_s[1:] + inner_s[:-1]), filtered)


def _means(inner_s: FloatArray, steps: FloatArray, instants_s: FloatArray, period_s: float) -> FloatArray:
    """Means (n, 3) since the instant before; the first over a period."""
    integral = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    edges_s = np.concatenate([[instants_s[0] - period_s], instants_s])
    return np.asarray(np.diff(interpolated(edges_s, inner_s, integral), axis=0) / np.diff(edges_s)[:, None])


def _settled(b: FloatArray, a: FloatArray) -> FloatArray:
    """State of a second-order filter (direct form II transposed) that has seen a constant 1 for ever."""
    last = b[2] - a[2]
    return np.array([b[1] - a[1] + last, last])


def _read_out(
    signal: FloatArray, triad: TriadQuality, instants_s: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Scale, misalignment, bias, saturation and quantisation of three axes."""
    matrix = np.eye(3) + rng.normal(0.0, triad.misalignment_rad, (3, 3))
    np.fill_diagonal(matrix, 1.0 + rng.normal(0.0, triad.scale, 3))
    limit = triad.limit * (1.0 + rng.normal(0.0, triad.limit_spread, 3))
    value = signal @ matrix.T + rng.normal(0.0, triad.bias_start, 3)
    grid_s = coarse(instants_s, _BIAS_PERIOD_S)
    wander = flicker(len(grid_s), _BIAS_PERIOD_S, triad.bias_instability, rng)
    value += interpolated(instants_s, grid_s, wander)
    value = np.clip(value, -limit, limit)
    return np.asarray(np.round(value / triad.resolution) * triad.resolution) if triad.resolution else value


def _kept(count: int, share: float, run: float, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Which samples arrive, (n,): losses come in runs of geometric length; the first sample is always there."""
    lost = np.zeros(count, dtype=np.bool_)
    for start in np.flatnonzero(rng.random(count) < share / run):
        lost[start : start + rng.geometric(1.0 / run)] = True
    lost[:1] = False
    return ~lost
