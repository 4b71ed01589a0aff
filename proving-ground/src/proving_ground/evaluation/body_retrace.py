"""Out and back (METHODS B6): the final error with and without the strategy for the way back.

The way is that of the library's forest march: 1.2 km out, a turn on the spot, back the same way. Azimuths are a
worn compass's with its leftover iron, alone or with the gyro; steps have one length, so that azimuth decides.
"""

from dataclasses import dataclass

import numpy as np

from pdr_engine.body.length.turns import stride_share
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.track.retrace import Retrace
from proving_ground.evaluation.body_azimuth import CENTRAL_EUROPE, azimuths, steps_of
from proving_ground.evaluation.body_strides import levelled
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import Magnetics, Mounting, imu_class, measure_imu

OUTWARD_M = np.array(
    [[0, 0, 0], [180, 70, 0], [390, 20, 0], [580, 40, 0], [740, 50, 0], [880, 90, 0], [1152, 237, 0]],
    dtype=np.float64,
)
AZIMUTHS = ("compass", "kalman")
_AHEAD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class RetraceScore:
    """Distance walked, and final errors with and without the strategy, m; ``left``: disagreements seen."""

    azimuth: str
    distance_m: float
    plain_m: float
    retraced_m: float
    left: int


def out_and_back(seed: int) -> list[RetraceScore]:
    """One person's march, by compass alone and by compass and gyro."""
    rng = np.random.default_rng(seed)
    back = OUTWARD_M[::-1]
    facing = float(np.arctan2(*(back[1] - back[0])[1::-1]))
    legs = (
        Leg("walk", OUTWARD_M),
        Leg("stand", back[:1], duration_s=15.0),
        Leg("turn", back[:1], facing_rad=facing),
        Leg("walk", back),
    )
    motion = move(Person.drawn(rng), Itinerary(legs, start_s=3.0), seed)
    imu = measure_imu(
        motion.torso, motion.duration_s, Mounting(), imu_class("consumer"), Magnetics(CENTRAL_EUROPE), rng
    )
    level = levelled(imu, _AHEAD)
    steps = steps_of(level)
    assert level.mag_ut is not None
    distance_m = 2.0 * float(np.linalg.norm(np.diff(OUTWARD_M, axis=0), axis=1).sum())
    durations_s = np.diff(steps.end_s, prepend=steps.end_s[0] - 0.5)
    shares = np.array(
        [stride_share(t, d) for t, d in zip(steps.turn_rad.tolist(), durations_s.tolist(), strict=True)]
    )
    lengths = distance_m * shares / shares.sum()
    mag_ut = level.mag_ut
    return [_scored(name, azimuths(steps, mag_ut, name, CENTRAL_EUROPE)[0], lengths) for name in AZIMUTHS]


def _scored(name: str, azimuth_rad: FloatArray, length_m: FloatArray) -> RetraceScore:
    plain = np.array([(length_m * np.sin(azimuth_rad)).sum(), (length_m * np.cos(azimuth_rad)).sum()])
    retrace = Retrace()
    for length, azimuth in zip(length_m.tolist(), azimuth_rad.tolist(), strict=True):
        retrace.step(length, azimuth)
    final = float(np.hypot(*retrace.place_m))
    return RetraceScore(name, float(length_m.sum()), float(np.hypot(*plain)), final, retrace.left)


def retrace_table(seeds: range = range(1, 12, 2)) -> str:
    """Markdown: a row an azimuth, over these seeds."""
    walks = [out_and_back(seed) for seed in seeds]
    lines = [
        "| azimuth | walks of 2.4 km | plain: final error m, mean | worst | way back laid on way out: m, mean "
        "| worst | % of distance, mean | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for number, name in enumerate(AZIMUTHS):
        scores = [walk[number] for walk in walks]
        plain = np.array([score.plain_m for score in scores])
        laid = np.array([score.retraced_m for score in scores])
        share = 100.0 * laid / scores[0].distance_m
        lines.append(
            f"| {name} | {len(scores)} | {plain.mean():.1f} | {plain.max():.1f} | {laid.mean():.1f} "
            f"| {laid.max():.1f} | {share.mean():.2f} | {share.max():.2f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(retrace_table())  # noqa: T201
