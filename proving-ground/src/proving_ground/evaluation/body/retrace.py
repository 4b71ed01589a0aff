"""Out and back (METHODS B6): the whole chain's final error with and without the strategy for the way back.

The way is that of the library's forest march: 1.2 km out, a turn on the spot, back the same way. The unit is a
consumer's at the trunk; its magnetometer has iron of its own, so that azimuths err differently out and back. Errors
are of all steps added up, against where the trunk really went.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import typer

from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.azimuth import CENTRAL_EUROPE
from proving_ground.evaluation.body.azimuth_chain import through
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import Magnetics, Mounting, imu_class, measure_imu
from sensor_gateway.recordings.run import ImuSeries

OUTWARD_M = np.array(
    [[0, 0, 0], [180, 70, 0], [390, 20, 0], [580, 40, 0], [740, 50, 0], [880, 90, 0], [1152, 237, 0]],
    dtype=np.float64,
)


@dataclass(frozen=True, slots=True)
class RetraceScore:
    """Distance walked, and final errors with and without the strategy, m."""

    distance_m: float
    plain_m: float
    retraced_m: float


def out_and_back(
    seed: int, outward_m: FloatArray = OUTWARD_M, back_m: FloatArray | None = None
) -> RetraceScore:
    """One person's march out (n, 3) and back, on the same way if no other is told."""
    back = outward_m[::-1] if back_m is None else back_m
    facing = float(np.arctan2(*(back[1] - back[0])[1::-1]))
    legs = (
        Leg("walk", outward_m),
        Leg("stand", back[:1], duration_s=15.0),
        Leg("turn", back[:1], facing_rad=facing),
        Leg("walk", back),
    )
    rng = np.random.default_rng(seed)
    motion = move(Person.drawn(rng), Itinerary(legs, start_s=3.0), seed)
    imu = measure_imu(
        motion.torso, motion.duration_s, Mounting(), imu_class("consumer"), Magnetics(CENTRAL_EUROPE), rng
    )
    way = motion.torso.at(imu.time_s)[0][:, :2]
    distance_m = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    errors = [_final_error_m(_steps(imu, retrace), way[-1] - way[0]) for retrace in (False, True)]
    return RetraceScore(distance_m, errors[0], errors[1])


def _steps(imu: ImuSeries, retrace: bool) -> list[BodyStepEstimate]:
    """The chain's steps, of a navigator that knows the earth's field."""
    navigator = BodyNavigator(BodySettings(retrace=retrace))
    navigator.know_earth_field(CENTRAL_EUROPE)
    return through(navigator, imu)


def _final_error_m(steps: Sequence[BodyStepEstimate], true_m: FloatArray) -> float:
    """Of steps whose azimuths are magnetic, against a way (2,) east, north."""
    azimuths = np.array([step.azimuth_rad for step in steps]) + CENTRAL_EUROPE.declination_rad
    lengths = np.array([step.length_m for step in steps])
    east, north = (lengths * np.sin(azimuths)).sum(), (lengths * np.cos(azimuths)).sum()
    return math.hypot(east - true_m[0], north - true_m[1])


def retrace_table(seeds: range = range(1, 12, 2)) -> str:
    """Markdown: with and without the strategy, over these seeds."""
    scores = [out_and_back(seed) for seed in seeds]
    lines = [
        "| way back | walks of 2.4 km | final error m: median | mean | worst | % of distance: mean | worst |",
        "|---|---|---|---|---|---|---|",
    ]
    errors = {
        "by dead reckoning alone": np.array([score.plain_m for score in scores]),
        "laid on way out": np.array([score.retraced_m for score in scores]),
    }
    distance = np.array([score.distance_m for score in scores])
    for name, error in errors.items():
        share = 100.0 * error / distance
        lines.append(
            f"| {name} | {len(scores)} | {np.median(error):.1f} | {error.mean():.1f} | {error.max():.1f} "
            f"| {share.mean():.2f} | {share.max():.2f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    typer.echo(retrace_table())
