"""Heading over long walks: simulated walks of one boot, with and without its magnetometer.

No recording at hand is long and outdoors, so these are simulated: a gyro whose bias wanders as data sheets say, the
earth's field of the World Magnetic Model, iron on the boot, and steel under the way. They are kinder than feet are
(their stance is perfect), so what counts is the comparison, not the figure. The gates were chosen with other
seeds than these.

python -m proving_ground.evaluation.foot.long_walks
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.config import Origin
from bootprint.geomagnetism import earth_field
from pdr_engine.foot import FootSettings
from proving_ground.evaluation.foot.ablation import Variant, walked
from proving_ground.evaluation.scoring import score_track
from proving_ground.motion import FloatArray
from proving_ground.sensors.imu_quality import MagnetometerQuality
from proving_ground.sensors.magnetics import DeviceIron, Dipoles, Magnetics, measure_field
from proving_ground.sensors.randomness import gauss_markov, interpolated
from proving_ground.simulation.walker import (
    Gait,
    ImuQuality,
    Path3D,
    boot_imu,
    footfalls,
    walk_duration_s,
)
from sensor_gateway.recordings.run import ImuSeries, Truth

PLACE = Origin(latitude_deg=47.05, longitude_deg=8.31, height_m=450.0)
EARTH = earth_field(PLACE, 1_750_000_000 * 10**9)
MOUNTING = Rotation.from_euler("XYZ", [0.1, -0.4, 0.3])
WITHOUT = Variant("without the magnetometer", {"magnetometer": {"use": False}})
SEEDS = range(300, 308)
LENGTH_M = 900.0
_WANDER_S = 200.0  # correlation time of the gyro bias
_IRON_EVERY_M = 1.5
_IRON_SIZE_M = 0.05
_TRUTH_EVERY = 20  # samples
_UNIT = MagnetometerQuality(noise_ut=0.3, hard_iron_ut=0.0, soft_iron=0.0, resolution_ut=0.01, rate_hz=200.0)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Where a walk leads: the size of dipoles under the way, A·m², from one part of the time to another."""

    name: str
    iron_a_m2: float = 0.0
    between: tuple[float, float] = (0.0, 1.0)


SURROUNDINGS = (
    Surroundings("undisturbed field"),
    Surroundings("some iron under the way", 1.5),
    Surroundings("through a steel building for a third of it", 8.0, (0.33, 0.66)),
    Surroundings("above the steel of a floor all the way", 8.0),
)


@dataclass(frozen=True, slots=True)
class MagneticWalk:
    """The boot's samples with ``mag_ut``; where and which way it truly was: sole (n, 3) m, yaw (n,) rad."""

    imu: ImuSeries
    position_m: FloatArray
    yaw_rad: FloatArray

    @property
    def truth(self) -> Truth:
        """The sole's way, 10 Hz."""
        return Truth(self.imu.time_s[::_TRUTH_EVERY], self.position_m[::_TRUTH_EVERY])


@dataclass(frozen=True, slots=True)
class Comparison:
    """One walk's 2-D RMSE and heading drift without and with the magnetometer."""

    rmse_m: tuple[float, float]
    drift_deg_per_min: tuple[float, float]


def streets(length_m: float, rng: np.random.Generator) -> FloatArray:
    """Way-points (k, 3): legs of 30 to 90 m, with turns to either side between them."""
    points, yaw = [np.zeros(3)], rng.uniform(0.0, 2.0 * np.pi)
    while length_m > 0.0:
        leg = min(rng.uniform(30.0, 90.0), length_m)
        points.append(points[-1] + leg * np.array([np.cos(yaw), np.sin(yaw), 0.0]))
        yaw += rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.7)
        length_m -= max(leg, 1.0)
    return np.array(points)


def iron_under(path_m: FloatArray, moment_a_m2: float, rng: np.random.Generator) -> Dipoles:
    """Dipoles of random direction, 0.2 to 0.6 m below a path (n, 3) and up to a metre aside of it."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path_m, axis=0), axis=1))])
    place = interpolated(np.arange(0.0, arc[-1], _IRON_EVERY_M), arc, path_m)
    place += rng.uniform([-1.0, -1.0, -0.6], [1.0, 1.0, -0.2], place.shape)
    return Dipoles(place, rng.normal(0.0, moment_a_m2, place.shape), np.array([_IRON_SIZE_M]))


def magnetic_walk(
    length_m: float,
    seed: int,
    *,
    device: DeviceIron | None = None,
    surroundings: Surroundings = SURROUNDINGS[0],
    bias_instability_deg_per_h: float = 30.0,
) -> MagneticWalk:
    """A walk through streets, at 200 Hz."""
    rng = np.random.default_rng(seed)
    path, gait = Path3D(streets(length_m, rng)), Gait()
    motion = footfalls(path, gait, +1)
    imu = boot_imu(motion, walk_duration_s(path, gait), MOUNTING, ImuQuality(), rng)
    iron = iron_under(path.points_m, surroundings.iron_a_m2, rng)
    begin, end = (share * imu.time_s[-1] for share in surroundings.between)
    amid = ((imu.time_s >= begin) & (imu.time_s <= end))[:, None]
    place, attitude = motion.at(imu.time_s)
    clean, disturbed = (
        measure_field(Magnetics(EARTH, dipoles, device), imu.time_s, place, attitude * MOUNTING, _UNIT, rng)
        for dipoles in (Dipoles(), iron)
    )
    seconds = np.arange(0.0, imu.time_s[-1] + 1.0)
    instability = np.radians(bias_instability_deg_per_h / 3600.0)
    wander = gauss_markov(
        len(seconds), 1.0, instability, _WANDER_S, np.random.default_rng([seed, 1]), columns=3
    )
    return MagneticWalk(
        replace(
            imu,
            gyro_rad_s=imu.gyro_rad_s + interpolated(imu.time_s, seconds, wander),
            mag_ut=np.where(amid, disturbed, clean),
        ),
        place,
        np.unwrap(attitude.as_euler("ZYX")[:, 0]),
    )


def compared(walk: MagneticWalk) -> Comparison:
    """Score the walk without and with its magnetometer."""
    scores = [
        score_track(walked(walk.imu, settings), walk.truth, "best-fit", None).score
        for settings in (WITHOUT.settings(), FootSettings())
    ]
    errors, drifts = (
        [getattr(score, name) for score in scores] for name in ("rmse_m", "heading_drift_deg_per_min")
    )
    return Comparison((errors[0], errors[1]), (drifts[0], drifts[1]))


def compare_all(seeds: Sequence[int] = SEEDS) -> dict[str, list[Comparison]]:
    """Every walk of every surroundings."""
    return {
        where.name: [compared(magnetic_walk(LENGTH_M, seed, surroundings=where)) for seed in seeds]
        for where in SURROUNDINGS
    }


def long_walks_table(found: Mapping[str, Sequence[Comparison]]) -> list[str]:
    """Lines of a Markdown table: without → with."""
    lines = [
        "| walk | n | RMSE m, median | mean | worst | drift °/min, mean size | walks that got worse |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, comparisons in found.items():
        errors = np.array([comparison.rmse_m for comparison in comparisons])
        drifts = np.abs([comparison.drift_deg_per_min for comparison in comparisons])
        figures = (np.median(errors, axis=0), errors.mean(axis=0), errors.max(axis=0), drifts.mean(axis=0))
        cells = " | ".join(f"{before:.2f} → {after:.2f}" for before, after in figures)
        worse = int((errors[:, 1] > errors[:, 0]).sum())
        lines.append(f"| {name} | {len(errors)} | {cells} | {worse} |")
    return lines


if __name__ == "__main__":
    sys.stdout.write("\n".join(long_walks_table(compare_all())) + "\n")
