"""A simple simulated walker: footfalls along a path, foot motion between them, and what boot sensors measure.

Each foot stands still for most of its stride and swings to its next footfall on a minimum-jerk curve with
clearance and a pitching sole, so zero-velocity updates meet what they expect: real stance, strong swing. Frames
are local ENU; sensor axes are forward, left, up of the sole, turned by the mounting.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from sensor_gateway.recordings.run import GnssSeries, ImuSeries, Run, Truth

FloatArray = npt.NDArray[np.float64]
GRAVITY_M_S2 = 9.80665
_DIFFERENCE_S = 1e-3  # step of the central differences that turn motion into acceleration and rate


@dataclass(frozen=True)
class Gait:
    """How a person walks."""

    step_length_m: float = 0.70
    step_period_s: float = 0.55
    swing_share: float = 0.40  # of a stride (two steps) that a foot is in the air
    width_m: float = 0.20  # between the feet
    clearance_m: float = 0.10
    sole_pitch_rad: float = 0.9
    stand_before_s: float = 3.0
    stand_after_s: float = 3.0


@dataclass(frozen=True)
class ImuQuality:
    """White noise and constant bias of a tactical-grade MEMS unit, at the sampling rate."""

    rate_hz: float = 200.0
    accel_noise_m_s2: float = 0.02
    gyro_noise_rad_s: float = 0.004
    gyro_bias_rad_s: float = 0.003
    accel_limit_m_s2: float = 160.0
    gyro_limit_rad_s: float = 20.9


@dataclass(frozen=True)
class GnssQuality:
    """A receiver whose errors wander: first-order Gauss-Markov, until it is denied at the door."""

    period_s: float = 1.0
    sigma_m: float = 2.0
    correlation_s: float = 40.0
    until_s: float = np.inf


@dataclass(frozen=True)
class Path3D:
    """Way-points (n, 3) in ENU metres, walked in order; corners are rounded by the heading's smoothing."""

    points_m: FloatArray

    @property
    def _arc(self) -> FloatArray:
        legs = np.linalg.norm(np.diff(self.points_m[:, :2], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(legs)])

    @property
    def length_m(self) -> float:
        """Horizontal length."""
        return float(self._arc[-1])

    def at(self, arc_m: FloatArray) -> FloatArray:
        """Points (n, 3) at these arc lengths (n,)."""
        return np.column_stack([np.interp(arc_m, self._arc, self.points_m[:, axis]) for axis in range(3)])

    def yaw_at(self, arc_m: FloatArray, reach_m: float = 0.5) -> FloatArray:
        """Yaw (n,), counter-clockwise from east, of the chord ``reach_m`` back and ahead; unwrapped."""
        chord = self.at(np.minimum(arc_m + reach_m, self.length_m)) - self.at(
            np.maximum(arc_m - reach_m, 0.0)
        )
        return np.unwrap(np.arctan2(chord[:, 1], chord[:, 0]))


@dataclass(frozen=True)
class FootMotion:
    """One foot's footfalls: places (k, 3), yaws (k,), and the swing into each: start (k,) and length in s."""

    place_m: FloatArray
    yaw_rad: FloatArray
    swing_start_s: FloatArray
    swing_s: float
    gait: Gait

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """Sole position (n, 3) and attitude (sole to ENU) at these times (n,)."""
        before = np.clip(np.searchsorted(self.swing_start_s, time_s, side="right") - 1, 0, None)
        after = before
        before = np.maximum(before - 1, 0)
        share = np.clip((time_s - self.swing_start_s[after]) / self.swing_s, 0.0, 1.0)
        glide = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        lift = (4.0 * share * (1.0 - share)) ** 3
        step = self.place_m[after] - self.place_m[before]
        position = self.place_m[before] + glide[:, None] * step
        position[:, 2] += self.gait.clearance_m * lift
        yaw = self.yaw_rad[before] + glide * (self.yaw_rad[after] - self.yaw_rad[before])
        pitch = self.gait.sole_pitch_rad * lift * np.sin(2.0 * np.pi * share)
        return position, Rotation.from_euler("ZY", np.column_stack([yaw, pitch]))


def footfalls(path: Path3D, gait: Gait, side: int) -> FootMotion:
    """The footfalls of the left (``side`` +1) or right (−1) foot along a path, starting and ending side by side."""
    steps = max(2, round(path.length_m / gait.step_length_m))
    first = 1 if side > 0 else 2
    turns = np.unique(np.append(np.arange(first, steps + 1, 2), steps))
    # The foot that would be last but one closes up beside the other one.
    index = np.concatenate([[0], turns])
    arc = index * path.length_m / steps
    yaw = path.yaw_at(arc)
    aside = np.column_stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)]) * (side * gait.width_m / 2.0)
    swing_s = gait.swing_share * 2.0 * gait.step_period_s
    order = np.where(index == steps, steps + (steps % 2 != first % 2), index)
    start = gait.stand_before_s + (order - 1) * gait.step_period_s
    start[0] = -1e9
    return FootMotion(path.at(arc) + aside, yaw, start, swing_s, gait)


def walk_duration_s(path: Path3D, gait: Gait) -> float:
    """How long the walk takes, standing before and after included."""
    steps = max(2, round(path.length_m / gait.step_length_m))
    return gait.stand_before_s + (steps + 2) * gait.step_period_s + gait.stand_after_s


def boot_imu(
    motion: FootMotion, duration_s: float, mounting: Rotation, quality: ImuQuality, rng: np.random.Generator
) -> ImuSeries:
    """What a unit on this foot measures: specific force and rate in its own axes, with noise, bias and limits."""
    time_s = np.arange(0.0, duration_s, 1.0 / quality.rate_hz)
    behind, attitude_behind = motion.at(time_s - _DIFFERENCE_S)
    here, attitude = motion.at(time_s)
    ahead, attitude_ahead = motion.at(time_s + _DIFFERENCE_S)
    acceleration = (ahead - 2.0 * here + behind) / _DIFFERENCE_S**2
    force = (attitude * mounting).inv().apply(acceleration + np.array([0.0, 0.0, GRAVITY_M_S2]))
    turn = (attitude_behind.inv() * attitude_ahead).as_rotvec() / (2.0 * _DIFFERENCE_S)
    rate = mounting.inv().apply(turn) + rng.normal(0.0, quality.gyro_bias_rad_s, 3)
    shape = (time_s.size, 3)
    return ImuSeries(
        time_s,
        np.clip(
            force + rng.normal(0.0, quality.accel_noise_m_s2, shape),
            -quality.accel_limit_m_s2,
            quality.accel_limit_m_s2,
        ),
        np.clip(
            rate + rng.normal(0.0, quality.gyro_noise_rad_s, shape),
            -quality.gyro_limit_rad_s,
            quality.gyro_limit_rad_s,
        ),
    )


def gnss_fixes(truth: Truth, origin: Origin, quality: GnssQuality, rng: np.random.Generator) -> GnssSeries:
    """Fixes along the truth with a wandering error; none after ``until_s`` (the receiver reports no fix)."""
    time_s = np.arange(0.0, min(quality.until_s, truth.time_s[-1]), quality.period_s)
    keep = np.exp(-quality.period_s / quality.correlation_s)
    error = np.empty((time_s.size, 3))
    state = rng.normal(0.0, quality.sigma_m, 3)
    for row in error:
        row[:] = state
        state = keep * state + rng.normal(0.0, quality.sigma_m * np.sqrt(1.0 - keep**2), 3)
    error[:, 2] *= 1.5
    enu = np.column_stack([np.interp(time_s, truth.time_s, column) for column in truth.position_m.T]) + error
    frame = LocalFrame(origin)
    geodetic = np.array([frame.to_geodetic(*point) for point in enu]).reshape(-1, 3)
    unknown = np.full(time_s.size, np.nan)
    return GnssSeries(
        time_s=time_s,
        lat_deg=geodetic[:, 0],
        lon_deg=geodetic[:, 1],
        alt_m=geodetic[:, 2],
        h_acc_m=np.full(time_s.size, quality.sigma_m * np.sqrt(2.0)),
        v_acc_m=np.full(time_s.size, quality.sigma_m * 1.5),
        satellites=np.full(time_s.size, 9.0),
        speed_m_s=unknown,
        course_deg=unknown,
    )


def simulate_walk(
    name: str,
    points_m: npt.ArrayLike,
    origin: Origin,
    *,
    seed: int,
    gait: Gait | None = None,
    imu: ImuQuality | None = None,
    gnss: GnssQuality | None = None,
) -> Run:
    """A walk along way-points (n, 3) ENU with both boots instrumented; truth is the middle of the feet, 10 Hz."""
    gait, imu = gait or Gait(), imu or ImuQuality()
    rng = np.random.default_rng(seed)
    path = Path3D(np.asarray(points_m, dtype=np.float64))
    duration_s = walk_duration_s(path, gait)
    feet = {"left_foot": footfalls(path, gait, +1), "right_foot": footfalls(path, gait, -1)}
    mountings = {
        "left_foot": Rotation.from_euler("XYZ", [0.1, -0.4, 0.3]),
        "right_foot": Rotation.from_euler("XYZ", [np.pi, 0.2, -0.5]),
    }
    time_s = np.arange(0.0, duration_s, 0.1)
    middle = 0.5 * (feet["left_foot"].at(time_s)[0] + feet["right_foot"].at(time_s)[0])
    truth = Truth(time_s, middle)
    return Run(
        name=name,
        kind="dual",
        path=Path(name),
        imus={
            place: boot_imu(motion, duration_s, mountings[place], imu, rng) for place, motion in feet.items()
        },
        truth={"body": truth},
        gnss=None if gnss is None else gnss_fixes(truth, origin, gnss, rng),
        origin=(origin.latitude_deg, origin.longitude_deg, origin.height_m),
        source="simulated",
    )
