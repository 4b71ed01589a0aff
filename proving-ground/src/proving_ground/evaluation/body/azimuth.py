"""Azimuth with and without a bridge over disturbed fields (METHODS A6, A7, B7): compass alone, three bridges.

Simulated walks: outdoors, a building with iron in floors and ceilings, outdoors again; truth is the torso's.
Recorded ones: the magnetometers of phones in malls, with fields of dipoles and line currents added to what they
read; their truth is the gyro with the offset that fits the whole unaltered recording. (With a drift fitted to the
compass, too, the tracks of msindoor20 would miss their way-points by 1.93 m, without by 1.67 m.) Without anything
added they tell what a perfect detector would reach. Errors are taken step by step, the first `START_S` left out.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import typer
from scipy.optimize import least_squares

from bootprint.geomagnetism import EarthField
from pdr_engine.body.azimuth.bridges import BRIDGES, LONGEST_S
from pdr_engine.body.azimuth.disturbance import DisturbanceDetector, field_of
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.strides import levelled, step_spans
from proving_ground.motion import Motion
from proving_ground.people import Itinerary, Leg, Person, move
from proving_ground.sensors import ImuClass, Magnetics, Mounting, imu_class, measure_imu, storey_iron
from proving_ground.sensors.imu_quality import MagnetometerQuality
from sensor_gateway.recordings import load_runs
from sensor_gateway.recordings.run import ImuSeries

START_S = 15.0
CENTRAL_EUROPE = EarthField(1.1, 21.4, -43.2)
METHODS = ("compass", *BRIDGES)
_COMPASS_SIGMA_RAD = math.radians(
    10.0
)  # of one step's azimuth: errors last for steps, so it counts for little
_FIRST_SIGMA_RAD = math.radians(40.0)  # of the first step's: nobody knows yet what the field is like
_AHEAD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True)
class AzimuthScore:
    """RMS azimuth error in degrees by method, and the share of steps judged disturbed."""

    name: str
    rms_deg: dict[str, float]
    disturbed_pct: float
    steps: int


@dataclass(frozen=True, slots=True)
class Steps:
    """A walk step by step: ``end_s`` (n,); the gyro's ``turn_rad`` (n,) since the last step's end and its
    ``half_turn_rad`` (n,) in the second half of the step, clockwise; the samples of each, for the field."""

    end_s: FloatArray
    turn_rad: FloatArray
    half_turn_rad: FloatArray
    samples: tuple[slice, ...]


def steps_of(level: ImuSeries) -> Steps:
    """The steps of a levelled series."""
    spans = step_spans(level)
    turned = np.concatenate([[0.0], np.cumsum(-level.gyro_rad_s[1:, 2] * np.diff(level.time_s))])
    ends = np.array([end_s for _, end_s in spans])
    middles = np.array([0.5 * (start_s + end_s) for start_s, end_s in spans])
    at_end, at_middle = (np.interp(times, level.time_s, turned) for times in (ends, middles))
    borders = [np.searchsorted(level.time_s, span) for span in spans]
    return Steps(
        ends,
        np.diff(at_end, prepend=at_end[0]),
        at_end - at_middle,
        tuple(slice(*border) for border in borders),
    )


def azimuths(
    steps: Steps, mag_ut: FloatArray, method: str, earth: EarthField | None, blind_from_s: float = math.inf
) -> tuple[FloatArray, FloatArray]:
    """Azimuth from magnetic north amid each step (n,) by a method, and whether it was judged disturbed (n,).

    From ``blind_from_s`` on there is no compass.
    """
    fields = [field_of(mag_ut[chosen]) for chosen in steps.samples]
    if method == "compass":
        return np.array([field.azimuth_rad for field in fields]), np.zeros(len(fields))
    detector = DisturbanceDetector(earth)
    bridge = BRIDGES[method](fields[0].azimuth_rad, _FIRST_SIGMA_RAD)
    found, judged = np.zeros(len(fields)), np.zeros(len(fields))
    durations_s = np.diff(steps.end_s, prepend=steps.end_s[0] - 0.5)
    for k, field in enumerate(fields):
        turn, half = float(steps.turn_rad[k]), float(steps.half_turn_rad[k])
        count = steps.samples[k].stop - steps.samples[k].start
        bridge.advance(turn, float(durations_s[k]), count)
        verdict = detector.update(
            field, turn, float(durations_s[k]), (bridge.azimuth_rad - half, bridge.sigma_rad)
        )
        sigma = verdict.sigma_rad(_COMPASS_SIGMA_RAD)
        if (
            steps.end_s[k] < blind_from_s
            and sigma is not None
            and (method == "kalman" or not verdict.disturbed)
        ):
            bridge.compass(field.azimuth_rad + half, sigma)
        found[k], judged[k] = bridge.azimuth_rad - half, float(verdict.disturbed)
    return found, judged


def score(
    name: str, steps: Steps, mag_ut: FloatArray, truth_rad: FloatArray, earth: EarthField | None
) -> AzimuthScore:
    """All methods on one walk."""
    counted = steps.end_s > steps.end_s[0] + START_S
    rms, disturbed = {}, 0.0
    for method in METHODS:
        found, judged = azimuths(steps, mag_ut, method, earth)
        error = wrapped(found - truth_rad)[counted]
        rms[method] = float(np.degrees(np.sqrt(np.mean(error**2))))
        if method == "kalman":
            disturbed = 100.0 * float(judged[counted].mean())
    return AzimuthScore(name, rms, disturbed, int(counted.sum()))


def simulated(seed: int, iron: float, outside_m: float = 300.0) -> AzimuthScore:
    """A walk outdoors, about in a building, and on; ``iron`` 1 is what malls have, 0 none."""
    return _scored(f"iron {iron:g}", *walk_past_iron(seed, iron, outside_m))


def _scored(name: str, imu: ImuSeries, torso_azimuth: FloatArray) -> AzimuthScore:
    level = levelled(imu, _AHEAD)
    steps = steps_of(level)
    assert level.mag_ut is not None
    truth = _over_steps(torso_azimuth, steps) - CENTRAL_EUROPE.declination_rad
    return score(name, steps, level.mag_ut, truth, CENTRAL_EUROPE)


def walk_past_iron(
    seed: int, iron: float, outside_m: float = 300.0, person_seed: int | None = None
) -> tuple[ImuSeries, FloatArray]:
    """A unit at the trunk, and the torso's true azimuths (n,) at its samples; another person on the same way."""
    rng = np.random.default_rng(seed)
    person, way = Person.drawn(rng), _way(rng, outside_m)
    if person_seed is not None:
        rng = np.random.default_rng(person_seed)
        person = Person.drawn(rng)
    motion = move(person, Itinerary((Leg("walk", way),), start_s=3.0), seed)
    magnetics = Magnetics(CENTRAL_EUROPE)
    if iron > 0.0:
        low, high = np.array([outside_m, -30.0, 0.0]), np.array([outside_m + 60.0, 30.0, 3.5])
        magnetics = Magnetics(CENTRAL_EUROPE, storey_iron(low, high, seed, iron))
    imu = measure_imu(motion.torso, motion.duration_s, Mounting(), calibrated_unit(), magnetics, rng)
    return imu, torso_azimuths(motion.torso, imu.time_s)


def calibrated_unit() -> ImuClass:
    """A consumer's MEMS unit whose magnetometer was calibrated as worn (A5), to half a microtesla."""
    return replace(imu_class("consumer"), magnetometer=MagnetometerQuality(0.8, 0.5, 0.01, 0.6, 50.0))


def bridged_deg(seed: int, clean_s: float = 600.0) -> dict[str, float]:
    """By how much the gyro alone errs 120 s after ``clean_s`` of walking outdoors with a compass, degrees."""
    imu, torso_azimuth = long_walk(seed, clean_s)
    level = levelled(imu, _AHEAD)
    steps = steps_of(level)
    assert level.mag_ut is not None
    truth = _over_steps(torso_azimuth, steps) - CENTRAL_EUROPE.declination_rad
    errors = {}
    for method in BRIDGES:
        found, _ = azimuths(steps, level.mag_ut, method, CENTRAL_EUROPE, blind_from_s=clean_s)
        errors[method] = float(np.abs(np.degrees(wrapped(found - truth))[-4:].mean()))
    return errors


def long_walk(seed: int, clean_s: float) -> tuple[ImuSeries, FloatArray]:
    """As `walk_past_iron`, outdoors for so long and `LONGEST_S` more."""
    rng = np.random.default_rng(seed)
    person = Person.drawn(rng)
    length_m = 1.02 * person.walk_speed_m_s * (clean_s + LONGEST_S)
    bends = np.array([[0.0, 0.0, 0.0], [0.3, 0.05, 0.0], [0.5, 0.2, 0.0], [0.8, 0.1, 0.0], [1.0, 0.3, 0.0]])
    motion = move(person, Itinerary((Leg("walk", length_m * bends),), start_s=3.0), seed)
    magnetics = Magnetics(CENTRAL_EUROPE)
    imu = measure_imu(motion.torso, clean_s + LONGEST_S + 3.0, Mounting(), calibrated_unit(), magnetics, rng)
    return imu, torso_azimuths(motion.torso, imu.time_s)


def bridging_table(seeds: range = range(1, 12, 2)) -> str:
    """Markdown: a row a method, error after 120 s of gyro alone."""
    lines = ["| bridge | walks | error after 120 s: median ° | mean ° | worst ° |", "|---|---|---|---|---|"]
    walks = [bridged_deg(seed) for seed in seeds]
    for method in BRIDGES:
        errors = [walk[method] for walk in walks]
        figures = f"{np.median(errors):.1f} | {np.mean(errors):.1f} | {np.max(errors):.1f}"
        lines.append(f"| {method} | {len(errors)} | {figures} |")
    return "\n".join(lines) + "\n"


def _way(rng: np.random.Generator, outside_m: float) -> FloatArray:
    """Outdoors with some bends, rooms of a building up and down, outdoors again."""
    outside = [[0.0, 0.0], [0.4 * outside_m, 25.0], [0.7 * outside_m, -15.0], [outside_m, 0.0]]
    inside = [[outside_m + x, y] for x in (8.0, 22.0, 36.0, 50.0) for y in rng.permutation([-20.0, 18.0])]
    after = [[outside_m + 62.0, 0.0], [outside_m + 160.0, 20.0]]
    points = np.array(outside + inside + after)
    return np.column_stack([points, np.zeros(len(points))])


def torso_azimuths(torso: Motion, time_s: FloatArray) -> FloatArray:
    """The torso's azimuth from true north, unwrapped (n,)."""
    _, attitude = torso.at(time_s)
    east, north, _ = attitude.apply([1.0, 0.0, 0.0]).T
    return np.asarray(np.unwrap(np.arctan2(east, north)))


def _over_steps(azimuth: FloatArray, steps: Steps) -> FloatArray:
    """Mean over each step (k,) of azimuths (n,) at the samples."""
    return np.array([azimuth[chosen].mean() for chosen in steps.samples])


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded walk, as it is and levelled; its compass's azimuths as the gyro sees them."""

    name: str
    imu: ImuSeries
    level: ImuSeries
    steps: Steps
    truth_rad: FloatArray


def recorded_walks(paths: Sequence[Path]) -> Iterator[Recorded]:
    """Body-worn recordings with a magnetometer."""
    for run in load_runs(paths, "body"):
        imu = run.imus.get("body")
        if imu is None or imu.mag_ut is None:
            continue
        level = levelled(imu, _AHEAD)
        steps = steps_of(level)
        assert level.mag_ut is not None
        yield Recorded(run.name, imu, level, steps, _gyro_truth(steps, level.mag_ut))


def _gyro_truth(steps: Steps, mag_ut: FloatArray) -> FloatArray:
    """The gyro's azimuths with the offset that fits the whole compass best."""
    compass = np.array([field_of(mag_ut[chosen]).azimuth_rad for chosen in steps.samples])
    gyro = np.cumsum(steps.turn_rad) - steps.half_turn_rad
    return gyro + fitted_offset_rad(gyro, compass)


def fitted_offset_rad(gyro: FloatArray, compass: FloatArray) -> float:
    """What brings a gyro's azimuths (n,) onto a compass's best, outliers counting less."""
    usual = np.angle(np.mean(np.exp(1j * (compass - gyro))))

    def miss(offset: FloatArray) -> FloatArray:
        return wrapped(gyro + offset - compass)

    fit = least_squares(miss, np.array([usual]), loss="soft_l1", f_scale=0.2)
    return float(fit.x[0])


def injected(walk: Recorded, seed: int, kind: str) -> AzimuthScore:
    """A recorded walk with fields of a kind (`added_field`)."""
    assert walk.level.mag_ut is not None
    mag = walk.level.mag_ut + added_field(walk, seed, kind)
    return score(f"{walk.name} {kind}", walk.steps, mag, walk.truth_rad, None)


def added_field(walk: Recorded, seed: int, kind: str) -> FloatArray:
    """Of three strong dipoles, or along three cables, ahead, left, up (n, 3) µT; ``kind`` none is none."""
    rng = np.random.default_rng(seed)
    added = np.zeros((len(walk.level.time_s), 3))
    azimuth = np.interp(walk.level.time_s, walk.steps.end_s, np.unwrap(walk.truth_rad))
    count = len(walk.steps.end_s)
    for k in () if kind == "none" else rng.choice(np.arange(count // 6, count), 3, replace=False):
        since_m = 1.3 * (walk.level.time_s - walk.steps.end_s[k])
        added += _dipole(since_m, rng) if kind == "dipole" else _cable(since_m, rng)
    return _into_frame(added, azimuth)


def _dipole(along_m: FloatArray, rng: np.random.Generator) -> FloatArray:
    """East, north, up field (n, 3) µT of a piece of iron 1 to 2 m aside of the way."""
    apart = np.column_stack(
        [along_m, np.full_like(along_m, rng.uniform(1.0, 2.0)), np.full_like(along_m, 0.5)]
    )
    square = (apart**2).sum(axis=1)
    moment = rng.normal(0.0, 300.0, 3)
    along = 3.0 * (apart @ moment)[:, None] * apart / square[:, None] ** 2.5
    return np.asarray(0.1 * (along - moment / square[:, None] ** 1.5))


def _cable(along_m: FloatArray, rng: np.random.Generator) -> FloatArray:
    """East, north, up field (n, 3) µT of a direct current of 60 to 150 A along 15 m of the way, 1 m off."""
    current_a, aside_m = rng.choice([-1.0, 1.0]) * rng.uniform(60.0, 150.0), rng.uniform(0.8, 1.5)
    strength = 0.2 * current_a / aside_m  # µ₀I/2πr
    near = 0.5 * (np.tanh(along_m + 7.5) - np.tanh(along_m - 7.5))
    towards = rng.uniform(0.0, 2.0 * np.pi)
    return np.asarray(
        strength * near[:, None] * np.array([0.8 * np.cos(towards), 0.8 * np.sin(towards), 0.6])
    )


def _into_frame(enu_ut: FloatArray, azimuth: FloatArray) -> FloatArray:
    """East, north, up (n, 3) to ahead, left, up of these azimuths (n,)."""
    east, north, up = enu_ut.T
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    return np.column_stack([east * sine + north * cosine, -east * cosine + north * sine, up])


def wrapped(angle: FloatArray) -> FloatArray:
    """Angles in [−π, π), rad."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def azimuth_table(rows: dict[str, list[AzimuthScore]]) -> str:
    """Markdown: a row for each kind of walk, mean and worst RMS error over its walks."""
    heads = " | ".join(f"{method} °" for method in METHODS)
    lines = [f"| walks | n | {heads} | judged disturbed % |", "|---|---|" + "---|" * (len(METHODS) + 1)]
    for name, scores in rows.items():
        cells = [_cell([one.rms_deg[method] for one in scores]) for method in METHODS]
        judged = np.mean([one.disturbed_pct for one in scores])
        lines.append(f"| {name} | {len(scores)} | {' | '.join(cells)} | {judged:.0f} |")
    return "\n".join(lines) + "\n"


def _cell(values: Sequence[float]) -> str:
    return f"{np.mean(values):.1f} ({np.max(values):.1f})"


def all_rows(data: Path | None, seeds: range = range(1, 12, 2)) -> dict[str, list[AzimuthScore]]:
    """Simulated buildings, and recorded walks where there is a folder of them."""
    rows = {
        f"simulated, iron {iron:g}": [simulated(seed, iron) for seed in seeds] for iron in (0.0, 1.0, 2.0)
    }
    if data is None:
        return rows
    walks = list(recorded_walks([data]))
    for kind in ("none", "dipole", "cable"):
        rows[f"{data.name}, {kind}"] = [injected(walk, number, kind) for number, walk in enumerate(walks)]
    return rows


if __name__ == "__main__":
    typer.echo(bridging_table())
    typer.echo(azimuth_table(all_rows(Path(sys.argv[1]) if len(sys.argv) > 1 else None)))
