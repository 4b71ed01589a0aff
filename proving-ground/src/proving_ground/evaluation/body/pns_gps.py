"""The PNS/GPS filter on 4 km through a town, GPS in three sections only (METHODS C4): how far off it ever is.

Streets with corners. Steps are those of the whole chain: a calibrated unit at the trunk, streets with iron, the
navigator without any fix. Or they are drawn (`drawn_steps`): lengths that a model misjudges by some percent,
differently as the walker tires; azimuths of a compass that was calibrated as worn (A5), with what that left and
iron along the streets, bridged by a gyro. GPS as a simulated receiver reports it in the open, and not at all
between. Settings and sections were chosen with seeds from 100 on.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import typer

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from pdr_engine.body import BodyNavigator
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.track.pns_gps import PnsGps
from proving_ground.evaluation.body.azimuth import CENTRAL_EUROPE, calibrated_unit
from proving_ground.evaluation.body.azimuth_chain import EARLY_S, through
from proving_ground.people import Itinerary, Leg, Person, PersonMotion, move
from proving_ground.sensors import (
    GNSS_CLASSES,
    GnssConditions,
    Magnetics,
    Mounting,
    measure_gnss,
    measure_imu,
    storey_iron,
)
from proving_ground.sensors.magnetics import Dipoles
from proving_ground.sensors.randomness import gauss_markov
from sensor_gateway.recordings.run import GnssSeries

LENGTH_M = 4000.0
SECTIONS_M = ((0.0, 700.0), (1500.0, 1950.0), (2750.0, 3200.0))  # of the way, where GPS is there
_ORIGIN = Origin(47.05, 8.31, 450.0)
_BLOCK_M = (60.0, 220.0)
# A third of the blocks have a stretch like the inside of a mall: an arcade, an underpass, a car park's ceiling.
_IRON_SHARE, _IRON_M, _IRON_HEIGHT_M = 1.0 / 3.0, 30.0, 3.5


@dataclass(frozen=True, slots=True)
class TownScore:
    """Errors over one walk, m: largest and median with the filter, largest by dead reckoning alone."""

    seed: int
    worst_m: float
    median_m: float
    dead_reckoning_m: float
    fixes: int


@dataclass(frozen=True, slots=True)
class Steps:
    """``times_s`` (n,) between steps, ``truth_m`` (n, 2) then; ``lengths_m``, ``azimuths`` (n − 1,) as told."""

    times_s: FloatArray
    truth_m: FloatArray
    lengths_m: FloatArray
    azimuths: FloatArray


Pacing = Callable[[PersonMotion, FloatArray, np.random.Generator], Steps]
"""From a motion along way-points (k, 3) to its steps."""


def town(seed: int, pacing: Pacing) -> TownScore:
    """One walk through a town, its steps by `chain_steps` or `drawn_steps`; the same for the same seed."""
    rng = np.random.default_rng(seed)
    person, streets = Person.drawn(rng), _streets(rng)
    motion = move(person, Itinerary((Leg("walk", streets),), start_s=40.0), seed)
    steps = pacing(motion, streets, rng)
    times_s, truth_m, lengths_m, azimuths = steps.times_s, steps.truth_m, steps.lengths_m, steps.azimuths
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


def chain_steps(motion: PersonMotion, streets_m: FloatArray, rng: np.random.Generator) -> Steps:
    """What the navigator makes of a unit at the trunk; it hears of no fixes."""
    magnetics = Magnetics(CENTRAL_EUROPE, _street_iron(streets_m, rng))
    imu = measure_imu(motion.torso, motion.duration_s, Mounting(), calibrated_unit(), magnetics, rng)
    navigator = BodyNavigator()
    navigator.know_earth_field(CENTRAL_EUROPE)
    steps = through(navigator, imu)
    times_s = np.array([steps[0].start_ns, *(step.time_ns for step in steps)]) * 1e-9 - EARLY_S
    azimuths = np.array([step.azimuth_rad for step in steps]) + CENTRAL_EUROPE.declination_rad
    lengths_m = np.array([step.length_m for step in steps])
    return Steps(times_s, motion.torso.at(times_s)[0][:, :2], lengths_m, azimuths)


def _street_iron(streets_m: FloatArray, rng: np.random.Generator) -> Dipoles:
    """Stretches of iron amid some blocks between way-points (k, 3)."""
    iron = Dipoles()
    for begin, end in itertools.pairwise(streets_m):
        if rng.uniform() < _IRON_SHARE:
            centre = begin + rng.uniform(0.3, 0.7) * (end - begin)
            apart = np.array([0.5 * _IRON_M, 0.5 * _IRON_M, 0.0])
            above = np.array([0.0, 0.0, _IRON_HEIGHT_M])
            iron += storey_iron(centre - apart, centre + apart + above, int(rng.integers(2**31)))
    return iron


def drawn_steps(motion: PersonMotion, streets_m: FloatArray, rng: np.random.Generator) -> Steps:
    """From footfall to footfall, lengths and azimuths with errors as a body-worn unit's may be."""
    begins_s = np.concatenate([foot.begin_s for foot in motion.footfalls.values()])
    times_s = np.sort(begins_s[np.isfinite(begins_s) & (begins_s > 0.0)])
    truth_m = motion.torso.at(times_s)[0][:, :2]
    way = np.diff(truth_m, axis=0)
    count = len(way)
    scale = 1.0 + rng.normal(0.0, 0.04) + gauss_markov(count, 1.0, 0.005, 600.0, rng)[:, 0]
    lengths = np.linalg.norm(way, axis=1) * scale + rng.normal(0.0, 0.03, count)
    azimuth = np.arctan2(way[:, 0], way[:, 1])
    iron = rng.normal(0.0, np.radians(0.5), 2)  # what calibration (A5) left, by where one goes
    bent = gauss_markov(count, 1.0, np.radians(1.5), 40.0, rng)[:, 0]  # what `azimuth` leaves of iron
    misaligned = rng.normal(0.0, np.radians(4.0))
    error = misaligned + iron[0] * np.sin(azimuth) + iron[1] * np.cos(azimuth) + bent
    azimuths = azimuth + error + rng.normal(0.0, np.radians(3.0), count)
    return Steps(times_s, truth_m, np.maximum(lengths, 0.0), azimuths)


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


PACINGS: dict[str, Pacing] = {"of the whole chain": chain_steps, "drawn": drawn_steps}


def town_table(seeds: range = range(20)) -> str:
    """Markdown: all seeds of a kind of steps in one row, and how many stayed below 20 m all along."""
    lines = [
        "| steps | walks of 4 km | median error m | largest error m: median | mean | worst "
        "| below 20 m all along | dead reckoning alone, largest: median | worst |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, pacing in PACINGS.items():
        scores = [town(seed, pacing) for seed in seeds]
        worst = np.array([score.worst_m for score in scores])
        drift = np.array([score.dead_reckoning_m for score in scores])
        median = np.median([score.median_m for score in scores])
        lines.append(
            f"| {name} | {len(scores)} | {median:.1f} | {np.median(worst):.1f} | {worst.mean():.1f} "
            f"| {worst.max():.1f} | {int((worst < 20.0).sum())} | {np.median(drift):.0f} | {drift.max():.0f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    typer.echo(town_table())
