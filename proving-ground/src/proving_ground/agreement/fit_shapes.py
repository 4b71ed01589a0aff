"""Fits the stride shapes of simulated people to recorded strides and writes them as a module.

python -m proving_ground.agreement.fit_shapes DATA FILE [--half even|odd]

Sources, all MIT: pyshoe-vicon (Wagstaff, Peretroukhin and Kelly, University of Toronto), foot-gcp (mtahakoroglu's
gait-driven-inertial-navigation-dataset), gaitmap-example (MaD Lab, FAU; the only one with stairs).
Strides are cut and rebuilt by `strides`; the lever arm from the sensor to the sole's still point is
fitted per foot and run. Each stride is warped so that lifting and landing meet, put on splines, and the splines'
mean, slope with speed and principal components are kept. How the still point creeps at mid-stance is what motion
capture saw of it (pyshoe-vicon, whose own noise is 2 mm/s). No sample of a recording is in the result.
"""

import argparse
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from proving_ground.agreement.strides import FloatArray, Stride, strides_of
from proving_ground.evaluation.alignment import is_dense
from proving_ground.people.shape import (
    ALONG,
    CHANNELS,
    COEFFICIENTS,
    CREEP_SHARE,
    FREE,
    HELD,
    MIRRORED,
    PITCH,
    ROLL,
    YAW,
    StrideShape,
    basis,
)
from proving_ground.people.shape_table import TABLE_UNIT
from proving_ground.people.smooth import bump
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import Run, Truth

SETS = ("pyshoe-vicon", "foot-gcp", "gaitmap-example")
MODES = 3
_GRID = np.linspace(0.0, 1.0, 301)
_LIFTED_SHARE = 0.25  # of the stride's greatest speed: faster is swing
_OUTLIER = 2.5  # times the median misfit
_AT_LEAST = 6
_CREEPS_AT_LEAST = 20
_WIDTH, _INDENT = 110, " " * 8
_HALF_WINDOW = 7  # samples of motion capture to each side, for its velocity


@dataclass(frozen=True, slots=True)
class Sample:
    """A stride, ready to be averaged: channels (6, FREE), lift and land as shares of its duration."""

    stride: Stride
    channels: FloatArray
    lift: float
    land: float
    creep: FloatArray


def _straight(stride: Stride) -> bool:
    forward, aside = stride.position_m[-1, :2]
    turn = abs(stride.euler_rad[-1, 0] - stride.euler_rad[0, 0])
    return bool(forward > 0.4 and abs(aside) < 0.7 * forward and turn < 0.9)


def _is_walk(stride: Stride) -> bool:
    return bool(
        _straight(stride)
        and abs(stride.rise_m) < 0.12
        and 0.6 < stride.length_m / stride.duration_s < 1.7
        and stride.standing_s > 0.25
        and 0.9 < stride.duration_s < 1.7
    )


def _is_run(stride: Stride) -> bool:
    return bool(
        _straight(stride)
        and stride.length_m / stride.duration_s > 1.4
        and stride.standing_s < 0.25
        and stride.duration_s < 0.98
    )


def _is_stair(stride: Stride, sign: float) -> bool:
    return bool(_straight(stride) and 0.2 < sign * stride.rise_m < 0.45 and stride.length_m < 0.95)


def _is_side_step(stride: Stride) -> bool:
    forward, aside = stride.position_m[-1, :2]
    return bool(abs(aside) > 0.25 and abs(forward) < 0.5 * abs(aside) and stride.duration_s < 1.3)


KINDS: dict[str, Callable[[Stride], bool]] = {
    "walk": _is_walk,
    "run": _is_run,
    "stairs_up": lambda stride: _is_stair(stride, 1.0),
    "stairs_down": lambda stride: _is_stair(stride, -1.0),
    "side_step": _is_side_step,
}


def runs_of(data: Path, half: str | None) -> list[Run]:
    """The runs to fit, or those of even or odd number in each set."""
    first, step = {"even": (0, 2), "odd": (1, 2), None: (0, 1)}[half]
    paths = [
        sorted((data / name).glob("imu_*.csv")) if name.startswith("gaitmap") else [data / name]
        for name in SETS
    ]
    found = [load_runs([path for path in group if "not_rotated" not in path.name]) for group in paths]
    return [run for group in found for run in (group if group[0].kind == "dual" else group[first::step])]


def samples_of(run: Run) -> Iterator[Sample]:
    """Every usable stride of a run's feet, as that of a right foot."""
    for place, imu in run.imus.items():
        strides = [stride for stride in strides_of(imu) if any(test(stride) for test in KINDS.values())]
        if len(strides) < _AT_LEAST:
            continue
        lever_m = lever_arm(strides)
        mirror = MIRRORED if place == "left_foot" else np.ones(len(CHANNELS))
        truth = run.truth.get(place)
        for stride in strides:
            seen = truth is not None and is_dense(truth) and not truth.at_stances
            velocity = _creep(stride, truth, lever_m) if truth is not None and seen else np.full(3, np.nan)
            creep = np.concatenate([velocity, stride.rate_rad_s[0] * mirror[[ROLL, PITCH, YAW]]])
            yield _sample(stride, lever_m, mirror, creep)


def lever_arm(strides: Sequence[Stride]) -> FloatArray:
    """From the sensor to the point of the sole that stands still, foot axes (3,), metres.

    Least squares over the samples in which the foot stands or rolls: v + ω × l = 0 with v and ω in foot axes.
    """
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for stride in strides:
        rolling = (
            (np.abs(stride.euler_rad[:, 1]) < 0.35)
            & (np.linalg.norm(stride.rate_rad_s, axis=1) < 3.0)
            & ((stride.time_s < 0.3) | (stride.time_s > stride.duration_s - 0.12))
        )
        velocity = stride.attitude.inv().apply(stride.velocity_m_s)[rolling]
        cross = np.array([_skew(rate) for rate in stride.rate_rad_s[rolling]]).reshape(-1, 3)
        normal += cross.T @ cross
        right -= cross.T @ velocity.ravel()
    return np.asarray(np.linalg.solve(normal, right), dtype=np.float64)


def _skew(rate: FloatArray) -> FloatArray:
    x, y, z = rate
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _sample(stride: Stride, lever_m: FloatArray, mirror: FloatArray, creep: FloatArray) -> Sample:
    raw, lift, land = _channels(stride, lever_m)
    return Sample(stride, raw * mirror[:, None], lift, land, creep)


def _channels(stride: Stride, lever_m: FloatArray) -> tuple[FloatArray, float, float]:
    """Channels (6, n) over the stride's own samples, and when it lifts and lands."""
    arm = stride.attitude.apply(lever_m)
    point = stride.position_m + arm - arm[0]
    chord = point[-1, :2]
    length = float(np.hypot(*chord))
    ahead = chord / length
    along = point[:, :2] @ ahead / length
    across = point[:, 1] * ahead[0] - point[:, 0] * ahead[1]
    euler = stride.euler_rad
    common = euler[0] + along[:, None] * (euler[-1] - euler[0])
    angles = (euler - common)[:, ::-1]
    for index, since_s in ((0, stride.time_s), (-1, stride.time_s - stride.duration_s)):
        creep = bump(since_s, np.full(len(since_s), CREEP_SHARE * stride.duration_s))
        angles = angles - creep[:, None] * stride.rate_rad_s[index]
    roll, pitch, yaw = angles.T
    speed = np.linalg.norm(np.gradient(point, stride.time_s, axis=0), axis=1)
    moving = np.flatnonzero(speed > _LIFTED_SHARE * speed.max())
    lift, land = stride.time_s[[moving[0], moving[-1]]] / stride.duration_s
    height = point[:, 2] - along * point[-1, 2]
    return np.array([along, across, height, pitch, roll, yaw]), float(lift), float(land)


def _creep(stride: Stride, truth: Truth, lever_m: FloatArray) -> FloatArray:
    """Velocity of the still point (forward, left, up) by motion capture, at mid-stance."""
    interval_s = float(np.median(np.diff(truth.time_s)))
    here, there = (
        int(np.argmin(np.abs(truth.time_s - time_s)))
        for time_s in (stride.begin_s, stride.begin_s + stride.duration_s)
    )
    first = min(max(0, here - _HALF_WINDOW), len(truth.time_s) - 2 * _HALF_WINDOW - 1)
    near = truth.position_m[first : first + 2 * _HALF_WINDOW + 1]
    velocity = savgol_filter(near, 2 * _HALF_WINDOW + 1, 2, deriv=1, delta=interval_s, axis=0)[here - first]
    true, own = truth.position_m[there] - truth.position_m[here], stride.position_m[-1]
    turn = np.arctan2(own[1], own[0]) - np.arctan2(true[1], true[0])
    cosine, sine = np.cos(turn), np.sin(turn)
    level = np.array(
        [cosine * velocity[0] - sine * velocity[1], sine * velocity[0] + cosine * velocity[1], velocity[2]]
    )
    return np.asarray(level + np.cross(stride.rate_rad_s[0], lever_m))


def fitted(samples: Sequence[Sample]) -> StrideShape:
    """The shape of these strides, after those unlike all others are left out."""
    lift, land = (float(np.median([getattr(s, end) for s in samples])) for end in ("lift", "land"))
    free = np.array([_spline(sample, lift, land) for sample in samples])
    misfit = np.sqrt(((free - np.median(free, axis=0)) ** 2).sum(axis=(1, 2)))
    kept = misfit < _OUTLIER * np.median(misfit)
    free = free[kept]
    strides = [sample.stride for sample, keep in zip(samples, kept, strict=True) if keep]
    speeds = np.array([stride.length_m / stride.duration_s for stride in strides])
    mean, slope = free.mean(axis=0), np.zeros_like(free[0])
    if np.std(speeds) > 0.1:
        faster = speeds - speeds.mean()
        slope = np.tensordot(faster, free - mean, axes=1) / (faster @ faster)
    residual = (free - mean - (speeds - speeds.mean())[:, None, None] * slope).reshape(len(free), -1)
    _, strengths, directions = np.linalg.svd(residual, full_matrices=False)
    sigmas = strengths[:MODES] / np.sqrt(len(free))
    usual, spread = _robust(np.array([sample.creep for sample in samples]))
    return StrideShape(
        speed_m_s=float(speeds.mean()),
        slowest_m_s=float(np.percentile(speeds, 5)),
        fastest_m_s=float(np.percentile(speeds, 95)),
        rise_m=float(np.median([stride.rise_m for stride in strides])),
        length_m=float(np.median([stride.length_m for stride in strides])),
        lift_share=lift,
        land_share=land,
        mean=mean,
        by_speed=slope,
        modes=(directions[:MODES] * sigmas[:, None]).reshape(-1, len(CHANNELS), FREE),
        creep=usual,
        creep_sigma=spread,
    )


def _spline(sample: Sample, lift: float, land: float) -> FloatArray:
    """Free coefficients (6, FREE) of a stride whose lifting and landing are moved to these phases."""
    own = np.interp(_GRID, [0.0, lift, land, 1.0], [0.0, sample.lift, sample.land, 1.0])
    time_s = own * sample.stride.duration_s
    values = np.array([np.interp(time_s, sample.stride.time_s, channel) for channel in sample.channels])
    first, weights = basis(_GRID)
    design = np.zeros((len(_GRID), COEFFICIENTS))
    for offset in range(4):
        design[np.arange(len(_GRID)), first + offset] = weights[:, offset]
    values[ALONG] -= design[:, -HELD:].sum(axis=1)
    return np.asarray(np.linalg.lstsq(design[:, HELD:-HELD], values.T, rcond=None)[0].T)


def _robust(creep: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Median, and sigma by the median absolute deviation, of what was seen often enough; else zeros."""
    seen = np.isfinite(creep).sum(axis=0) >= _CREEPS_AT_LEAST
    usual, spread = np.zeros(6), np.zeros(6)
    usual[seen] = np.nanmedian(creep[:, seen], axis=0)
    spread[seen] = 1.4826 * np.nanmedian(np.abs(creep - usual)[:, seen], axis=0)
    return usual, spread


def source_of(shapes: dict[str, tuple[StrideShape, int]], half: str | None) -> str:
    """The shapes as a module."""
    lines = [
        '"""Shapes of recorded strides, made by `proving_ground.agreement.fit_shapes`, which names the sources.',
        "",
        f"Fitted to {half or 'all'} runs. Each table: the figures of `StrideShape`, creep and its sigma, then",
        "mean, slope with speed and modes.",
        '"""',
        "",
        "from proving_ground.people.shape_table import parsed",
        "",
        "SHAPES = {",
    ]
    for name, (shape, count) in shapes.items():
        lines += [
            f"    # {count} strides",
            f'    "{name}": parsed(',
            '        """',
            _table(shape),
            '        """',
            "    ),",
        ]
    return "\n".join([*lines, "}", ""])


def _table(shape: StrideShape) -> str:
    figures = (
        shape.speed_m_s,
        shape.slowest_m_s,
        shape.fastest_m_s,
        shape.rise_m,
        shape.length_m,
        shape.lift_share,
        shape.land_share,
    )
    tables = (shape.creep, shape.creep_sigma, shape.mean, shape.by_speed, shape.modes)
    numbers = [*figures, *np.concatenate([table.ravel() for table in tables])]
    text = " ".join(f"{value / TABLE_UNIT:.0f}" for value in numbers).replace("-0 ", "0 ")
    return textwrap.fill(text, _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT)


def main(data: Path, file: Path, half: str | None) -> None:
    """Fit all kinds and write the module (`proving_ground.people.stride_shapes`)."""
    samples = [sample for run in runs_of(data, half) for sample in samples_of(run)]
    shapes = {}
    for name, test in KINDS.items():
        chosen = [sample for sample in samples if test(sample.stride)]
        shapes[name] = (fitted(chosen), len(chosen))
    file.write_text(source_of(shapes, half), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Fit stride shapes to recorded strides.")
    parser.add_argument("data", type=Path)
    parser.add_argument("file", type=Path)
    parser.add_argument("--half", choices=("even", "odd"))
    options = parser.parse_args()
    main(options.data, options.file, options.half)
