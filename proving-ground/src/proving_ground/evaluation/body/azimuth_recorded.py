"""Azimuths of the whole chain on recorded walks with fields of iron and cables added (METHODS A6, A7, B7).

As `azimuth`, whose fields and truth these are, with the engine's own steps. What is off without anything added
is the building's own iron, which a perfect detector of the added fields would be left with, too.

python -m proving_ground.evaluation.body.azimuth_recorded DATA
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import typer

from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from pdr_engine.body.methods import settings_of
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.azimuth import (
    START_S,
    Recorded,
    added_field,
    fitted_offset_rad,
    recorded_walks,
    wrapped,
)
from proving_ground.evaluation.body.azimuth_chain import rms_deg, through
from proving_ground.evaluation.body.strides import level_frames
from sensor_gateway.recordings.run import ImuSeries

METHODS = ("default", "a7")
KINDS = ("none", "dipole", "cable")
_AHEAD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class ChainScore:
    """RMS azimuth errors, degrees: of each step's compass, and of what a method publishes."""

    compass_deg: float
    published_deg: float


def chain_scores(walk: Recorded, seed: int, method: str) -> dict[str, ChainScore]:
    """A walk by a method, with each of `KINDS` of field added."""
    unaltered = _steps(walk.imu, method)
    truth = _truth(unaltered)
    scores = {}
    for kind in KINDS:
        altered = kind != "none"
        steps = _steps(_with_field(walk, added_field(walk, seed, kind)), method) if altered else unaltered
        scores[kind] = _score(steps, truth)
    return scores


def _score(steps: Sequence[BodyStepEstimate], truth: FloatArray) -> ChainScore:
    """Steps against their true azimuths (n,)."""
    ends_s = np.array([step.time_ns for step in steps]) * 1e-9
    counted = ends_s > ends_s[0] + START_S
    compass = np.array([step.compass_azimuth_rad for step in steps], dtype=np.float64)
    published = np.array([step.azimuth_rad for step in steps])
    return ChainScore(*(rms_deg(wrapped(azimuth - truth)[counted]) for azimuth in (compass, published)))


def _with_field(walk: Recorded, level_ut: FloatArray) -> ImuSeries:
    """The recording with fields (n, 3), ahead, left, up, added to what its magnetometer read."""
    assert walk.imu.mag_ut is not None
    device_ut = np.einsum("nji,nj->ni", level_frames(walk.imu, _AHEAD), level_ut)
    return replace(walk.imu, mag_ut=walk.imu.mag_ut + device_ut)


def _steps(imu: ImuSeries, method: str) -> list[BodyStepEstimate]:
    """The chain's steps; azimuths are those of the unit's x axis, whichever way its bearer goes."""
    chosen = settings_of(method)
    navigator = BodyNavigator(
        BodySettings(
            azimuth=chosen.azimuth, heading=chosen.heading, retrace=False, classes=False, forward="x"
        )
    )
    return through(navigator, imu)


def _truth(unaltered: Sequence[BodyStepEstimate]) -> FloatArray:
    """The true azimuth of each step (n,): the gyro's, with the offset that fits the unaltered compass."""
    gyro = np.array([step.gyro_azimuth_rad for step in unaltered])
    compass = np.array([step.compass_azimuth_rad for step in unaltered], dtype=np.float64)
    return gyro + fitted_offset_rad(gyro, compass)


def recorded_table(walks: Sequence[Recorded], name: str) -> str:
    """Markdown: a row for each kind of field, mean (worst) over the walks; the mean as a share of the compass's."""
    heads = " | ".join(f"{method} ° | of compass" for method in METHODS)
    lines = [f"| walks | n | compass ° | {heads} |", "|---|---|---" + "|---|---" * len(METHODS) + "|"]
    found = {method: [chain_scores(walk, k, method) for k, walk in enumerate(walks)] for method in METHODS}
    for kind in KINDS:
        compass = np.array([scores[kind].compass_deg for scores in found[METHODS[0]]])
        cells = []
        for method in METHODS:
            ours = np.array([scores[kind].published_deg for scores in found[method]])
            cells.append(f"{ours.mean():.1f} ({ours.max():.1f}) | {ours.mean() / compass.mean():.2f}")
        figures = f"{compass.mean():.1f} ({compass.max():.1f}) | {' | '.join(cells)}"
        lines.append(f"| {name}, {kind} | {len(walks)} | {figures} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    typer.echo(recorded_table(list(recorded_walks([folder])), folder.name))
