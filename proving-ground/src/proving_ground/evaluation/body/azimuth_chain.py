"""Azimuths of the whole chain on simulated walks past iron, and by the gyro alone after minutes of compass.

As `azimuth`, whose walks these are, but with the engine's own steps: compass alone is what every step's
``compass_azimuth_rad`` says, a method's azimuth what it publishes. Truth is the torso's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import typer

from pdr_engine.body import BodyNavigator, BodySettings, BodyStepEstimate
from pdr_engine.body.azimuth.deviation import Deviation
from pdr_engine.body.methods import settings_of
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.azimuth import (
    CENTRAL_EUROPE,
    START_S,
    long_walk,
    walk_past_iron,
    wrapped,
)
from sensor_gateway.recordings.run import ImuSeries

METHODS = ("default", "a7")
_BATCH = 200
EARLY_S = 10.0  # simulated time begins at zero, batches of a stream may not
CLEAN_S = 600.0


@dataclass(frozen=True, slots=True)
class Walked:
    """A chain's steps: their ends (n,) s, errors of published and compass azimuths (n,) rad, NaN without one."""

    end_s: FloatArray
    error_rad: FloatArray
    compass_error_rad: FloatArray


def walked(imu: ImuSeries, torso_azimuth: FloatArray, method: str, blind_from_s: float = np.inf) -> Walked:
    """A walk by a method; ``torso_azimuth`` (n,) true, at the samples; no magnetometer from some time on."""
    return scored(through(_navigator(method), imu, blind_from_s), imu, torso_azimuth)


def scored(steps: Sequence[BodyStepEstimate], imu: ImuSeries, torso_azimuth: FloatArray) -> Walked:
    """Steps (`through`) against the torso's azimuths (n,) at the samples."""
    starts_s, ends_s = np.array([(step.start_ns, step.time_ns) for step in steps]).T * 1e-9 - EARLY_S
    borders = np.searchsorted(imu.time_s, np.array([starts_s, ends_s]))
    summed = np.concatenate([[0.0], np.cumsum(np.unwrap(torso_azimuth))])
    truth = (summed[borders[1]] - summed[borders[0]]) / np.maximum(borders[1] - borders[0], 1)
    truth -= CENTRAL_EUROPE.declination_rad
    compass = [np.nan if step.compass_azimuth_rad is None else step.compass_azimuth_rad for step in steps]
    published = np.array([step.azimuth_rad for step in steps])
    return Walked(ends_s, wrapped(published - truth), wrapped(np.array(compass) - truth))


def _navigator(
    method: str, deviation_map: bool = False, deviations: tuple[Deviation, ...] = ()
) -> BodyNavigator:
    """The way back would be laid on the way out, steps aside be turned: here the azimuth alone counts."""
    settings = settings_of(method)
    navigator = BodyNavigator(
        BodySettings(
            azimuth=settings.azimuth,
            heading=settings.heading,
            retrace=False,
            classes=False,
            deviation_map=deviation_map,
            deviations=deviations,
        )
    )
    navigator.know_earth_field(CENTRAL_EUROPE)
    navigator.hear_fix(0, 0.0, 0.0, 2.0)
    return navigator


def through(navigator: BodyNavigator, imu: ImuSeries, blind_from_s: float = np.inf) -> list[BodyStepEstimate]:
    """The steps that a navigator makes of a series."""
    time_ns = np.round((imu.time_s + EARLY_S) * 1e9).astype(np.int64)
    assert imu.mag_ut is not None
    found = []
    for start in range(0, len(time_ns), _BATCH):
        part = slice(start, start + _BATCH)
        mag = None if imu.time_s[start] >= blind_from_s else imu.mag_ut[part]
        found += navigator.process(time_ns[part], imu.accel_m_s2[part], imu.gyro_rad_s[part], mag)
    return found


def repeated_deg(seed: int, iron: float = 1.0) -> tuple[float, float]:
    """RMS azimuth error of another person on a way walked before, without and with its deviation map (B5), degrees.

    Both begin at a satellite fix; the second walk's unit, gait and noise are its own.
    """
    first, _ = walk_past_iron(seed, iron)
    imu, torso_azimuth = walk_past_iron(seed, iron, person_seed=seed + 100)
    learner = _navigator("default", deviation_map=True)
    through(learner, first)
    errors = []
    for known in ((), learner.deviations):
        navigator = _navigator("default", deviation_map=bool(known), deviations=known)
        walk = scored(through(navigator, imu), imu, torso_azimuth)
        errors.append(rms_deg(walk.error_rad[walk.end_s > walk.end_s[0] + START_S]))
    return errors[0], errors[1]


def past_iron_deg(seed: int, iron: float) -> list[float]:
    """RMS azimuth error of compass alone and of `METHODS`, degrees, the first `START_S` left out."""
    imu, torso_azimuth = walk_past_iron(seed, iron)
    walks = [walked(imu, torso_azimuth, method) for method in METHODS]
    counted = [walk.end_s > walk.end_s[0] + START_S for walk in walks]
    errors = [rms_deg(walk.error_rad[chosen]) for walk, chosen in zip(walks, counted, strict=True)]
    return [rms_deg(walks[0].compass_error_rad[counted[0]]), *errors]


def drifted_deg(seed: int) -> list[float]:
    """By how much azimuths by `METHODS` grow wrong in two minutes without compass after ten with one, degrees."""
    imu, torso_azimuth = long_walk(seed, CLEAN_S)
    return [_grown_deg(walked(imu, torso_azimuth, method, CLEAN_S)) for method in METHODS]


def _grown_deg(walk: Walked) -> float:
    last = int(np.searchsorted(walk.end_s, CLEAN_S))
    return float(np.degrees(abs(walk.error_rad[-4:].mean() - walk.error_rad[last - 10 : last].mean())))


def chain_tables(seeds: range = range(1, 6, 2)) -> str:
    """Markdown: both tables."""
    heads = " | ".join(f"{method} °" for method in METHODS)
    lines = [f"| walks | n | compass ° | {heads} |", "|---|---|---|" + "---|" * len(METHODS)]
    for iron in (0.0, 1.0, 2.0):
        errors = np.array([past_iron_deg(seed, iron) for seed in seeds]).T
        cells = " | ".join(f"{error.mean():.1f} ({error.max():.1f})" for error in errors)
        lines.append(f"| iron {iron:g} | {len(seeds)} | {cells} |")
    lines += [
        "",
        "| two minutes without compass | walks | median ° | mean ° | worst ° |",
        "|---|---|---|---|---|",
    ]
    drifts = np.array([drifted_deg(seed) for seed in seeds]).T
    for method, drift in zip(METHODS, drifts, strict=True):
        figures = f"{np.median(drift):.1f} | {drift.mean():.1f} | {drift.max():.1f}"
        lines.append(f"| {method} | {len(seeds)} | {figures} |")
    again = np.array([repeated_deg(seed) for seed in seeds])
    lines += ["", "| a way walked again, iron 1 | walks | mean ° | worst ° |", "|---|---|---|---|"]
    for name, error in zip(("without", "with a map of deviations (B5)"), again.T, strict=True):
        lines.append(f"| {name} | {len(seeds)} | {error.mean():.1f} | {error.max():.1f} |")
    return "\n".join(lines) + "\n"


def rms_deg(error_rad: FloatArray) -> float:
    """Root mean square of errors (n,), NaN where there is none, degrees."""
    return float(np.degrees(np.sqrt(np.nanmean(error_rad**2))))


if __name__ == "__main__":
    typer.echo(chain_tables())
