"""The PNS/GPS filter on 4 km through a town, GPS in three sections only (METHODS C4): how far off it ever is.

Streets with corners; steps whose lengths a model misjudges by some percent, differently as the walker tires;
azimuths of a compass that was calibrated as worn (A5), with what that left and iron along the streets, bridged by a
gyro. GPS as a simulated receiver reports it in the open, and not at all between. Settings and sections were chosen
with seeds from 100 on.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import typer

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.track.pns_gps import PnsGps
from proving_ground.people import Itinerary, Leg, Person, PersonMotion, move
from proving_ground.sensors import GNSS_CLASSES, GnssConditions, Mounting, measure_gnss
from proving_ground.sensors.randomness import gauss_markov
from sensor_gateway.recordings.run import GnssSeries

LENGTH_M = 4000.0
SECTIONS_M = ((0.0, 700.0), (1500.0, 1950.0), (2750.0, 3200.0))  # of the way, where GPS is there
_ORIGIN = Origin(47.05, 8.31, 450.0)
_BLOCK_M = (60.0, 220.0)


@dataclass(frozen=True, slots=True)
class TownScore:
    """Errors over one walk, m: largest and median with the filter, largest by dead reckoning alone."""

    seed: int
    worst_m: float
    median_m: float
    dead_reckoning_m: float
    fixes: int


def town(seed: int) -> TownScore:
    """One walk through a town; the same for the same seed."""
    rng = np.random.default_rng(seed)
    motion = move(Person.drawn(rng), Itinerary((Leg("walk", _streets(rng)),), start_s=40.0), seed)
    times_s, truth_m = _steps(motion)
    lengths_m, azimuths = _reckoned(truth_m, times_s, rng)
    gnss = measure_gnss(
        motion.torso,
        motion.duration_s,
        Mounting(),
        GNSS_CLASSES["honest"],
        GnssConditions(),
        _ORIGIN,
        rng,
    )
    arcs_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(truth_m, axis=0), axis=1))])
    fixes = _fixes(gnss, np.interp(gnss.time_s, times_s, arcs_m))
    found, taken = filtered(times_s, truth_m[0], lengths_m, azimuths, fixes)
    alone, _ = filtered(times_s, truth_m[0], lengths_m, azimuths, [])
    error, drift = (np.linalg.norm(track - truth_m[1:], axis=1) for track in (found, alone))
    return TownScore(seed, float(error.max()), float(np.median(error)), float(drift.max()), taken)


def _streets(rng: np.random.Generator) -> FloatArray:
    """Way-points (k, 3) of 4 km along blocks, with turns to the left, to the right and straight on."""
    points, heading, length = [np.zeros(2)], rng.uniform(0.0, 2.0 * np.pi), 0.0
    while length < LENGTH_M:
        block = min(rng.uniform(*_BLOCK_M), LENGTH_M - length + 1.0)
        points.append(points[-1] + block * np.array([np.cos(heading), np.sin(heading)]))
        length += block
        heading += rng.choice([-0.5, 0.0, 0.5]) * np.pi + rng.normal(0.0, 0.15)
    return np.column_stack([np.array(points), np.zeros(len(points))])


def _steps(motion: PersonMotion) -> tuple[FloatArray, FloatArray]:
    """Times of footfalls (n,) and the ground between the feet then (n, 2)."""
    begins_s = np.concatenate([foot.begin_s for foot in motion.footfalls.values()])
    times_s = np.sort(begins_s[np.isfinite(begins_s) & (begins_s > 0.0)])
    return times_s, motion.torso.at(times_s)[0][:, :2]


def _reckoned(
    truth_m: FloatArray, times_s: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Lengths (n − 1,) and azimuths (n − 1,) of steps as a body-worn unit tells them."""
    way = np.diff(truth_m, axis=0)
    count = len(way)
    scale = 1.0 + rng.normal(0.0, 0.04) + gauss_markov(count, 1.0, 0.005, 600.0, rng)[:, 0]
    lengths = np.linalg.norm(way, axis=1) * scale + rng.normal(0.0, 0.03, count)
    azimuth = np.arctan2(way[:, 0], way[:, 1])
    iron = rng.normal(0.0, np.radians(0.5), 2)  # what calibration (A5) left, by where one goes
    bent = gauss_markov(count, 1.0, np.radians(1.5), 40.0, rng)[:, 0]  # what `body_azimuth` leaves of iron
    misaligned = rng.normal(0.0, np.radians(4.0))
    error = misaligned + iron[0] * np.sin(azimuth) + iron[1] * np.cos(azimuth) + bent
    return np.maximum(lengths, 0.0), azimuth + error + rng.normal(0.0, np.radians(3.0), count)


def _fixes(gnss: GnssSeries, arc_m: FloatArray) -> list[tuple[float, FloatArray, float, int]]:
    """Time, place (2,), accuracy and satellites of the fixes in the sections."""
    local = LocalFrame(_ORIGIN)
    found = []
    for k, at_s in enumerate(gnss.time_s.tolist()):
        inside = any(begin <= arc_m[k] <= end for begin, end in SECTIONS_M)
        if not inside or not np.isfinite(gnss.lat_deg[k]):
            continue
        place = local.to_enu(float(gnss.lat_deg[k]), float(gnss.lon_deg[k]), float(gnss.alt_m[k]))
        found.append((at_s, np.array(place[:2]), float(gnss.h_acc_m[k]), int(gnss.satellites[k])))
    return found


def filtered(
    times_s: FloatArray,
    start_m: FloatArray,
    lengths_m: FloatArray,
    azimuths: FloatArray,
    fixes: Sequence[tuple[float, FloatArray, float, int | None]],
) -> tuple[FloatArray, int]:
    """Places after each step (n − 1, 2), and how many fixes were taken."""
    pns = PnsGps(start_m, 2.0)
    track, waiting = [], list(fixes)
    for k, (length, azimuth) in enumerate(zip(lengths_m.tolist(), azimuths.tolist(), strict=True)):
        duration_s = float(times_s[k + 1] - times_s[k])
        before = pns.place_m
        pns.step(length, azimuth, duration_s)
        while waiting and waiting[0][0] <= times_s[k + 1]:
            at_s, place, accuracy, satellites = waiting.pop(0)
            # A fix amid a step is brought to its end by what was walked since.
            share = min(max((float(times_s[k + 1]) - at_s) / duration_s, 0.0), 1.0)
            pns.fix(place + share * (pns.place_m - before), accuracy, satellites)
        track.append(pns.place_m)
    return np.array(track), pns.taken


def town_table(seeds: range = range(20)) -> str:
    """Markdown: all seeds in one row, and how many stayed below 20 m all along."""
    scores = [town(seed) for seed in seeds]
    worst = np.array([score.worst_m for score in scores])
    drift = np.array([score.dead_reckoning_m for score in scores])
    median = np.median([score.median_m for score in scores])
    return (
        "| walks of 4 km | median error m | largest error m: median | mean | worst | below 20 m all along "
        "| dead reckoning alone, largest: median | worst |\n|---|---|---|---|---|---|---|---|\n"
        f"| {len(scores)} | {median:.1f} | {np.median(worst):.1f} | {worst.mean():.1f} | {worst.max():.1f} "
        f"| {int((worst < 20.0).sum())} | {np.median(drift):.0f} | {drift.max():.0f} |\n"
    )


if __name__ == "__main__":
    typer.echo(town_table())
