"""The body module's heights through the whole chain: stairs of 7.8 m, lifts, slopes, floors (METHODS A8).

Every person goes up a building floor by floor, rides a lift down, goes over a ramp, climbs all of it at once and
comes back by the stairs, in weather that drifts, wind and doors that slam. Steps, classes and floors are those that
the navigator tells from the unit's samples and pressure.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdr_engine.body import BodySettings, BodyStepEstimate
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.settings import AltitudeSettings
from proving_ground.evaluation.body.recorded_run import settled_names, walk_body
from proving_ground.evaluation.body.wearers import PLACEMENTS, Way, walked, worn
from proving_ground.people import Leg, Person, PersonMotion
from proving_ground.sensors import BAROMETER_CLASSES, Air, Area, DoorSlam

STAIRS_M, MOST_ERROR_M = 7.8, 0.4
_NS_PER_S = 1e9
_ON_A_FLOOR = 0.05  # of a storey: the ramp's top is no floor
_SETTLING_S = 4.0  # before and after stairs: heights are known some seconds later
_CLIMBING_M_S, _AROUND_S = 0.1, 0.6  # of the truth around a step: less is a landing
_RAMP_M = 2.0


@dataclass(frozen=True, slots=True)
class Building:
    """Its storeys, stairs (riser, pitch) and ramp, its air, and whether the storey's height is told."""

    storey_m: float
    riser_m: float
    pitch: float
    ramp: float
    drift_pa_per_sqrt_h: float
    wind_m_s: float
    told: bool = False


BUILDINGS = {
    "house": Building(2.6, 0.19, 0.68, 0.08, 30.0, 0.0),
    "office": Building(3.9, 0.17, 0.58, 0.06, 50.0, 4.0),
    "hall": Building(7.8, 0.155, 0.5, 0.10, 50.0, 0.0, told=True),
}


@dataclass(slots=True)
class HeightScore:
    """A walk's stairs and lift errors, m, each over its whole climb; steps by what was climbed and was said."""

    stairs_error_m: list[float] = field(default_factory=list)
    lift_error_m: list[float] = field(default_factory=list)
    # By way, and whether it was taken for stairs up or down: at once, and as it was settled.
    told: Counter[tuple[str, bool]] = field(default_factory=Counter)
    settled: Counter[tuple[str, bool]] = field(default_factory=Counter)
    floors: list[bool] = field(default_factory=list)  # right, by step on a floor
    stays: list[bool] = field(default_factory=list)  # right, at the end of each level leg on a floor


def run_building(name: str, barometer: str, placement: str, seed: int) -> HeightScore:
    """One person's walk through a building; the same for the same seed."""
    building = BUILDINGS[name]
    person = Person.drawn(np.random.default_rng(seed))
    motion = walked(person, list(building_legs(building)), seed, start_s=8.0)
    doors = tuple(DoorSlam(at_s, motion.torso.at(np.array([at_s]))[0][0]) for at_s in (30.0, 75.0, 140.0))
    air = building_air(building, seed, doors)
    altitude = AltitudeSettings(building.storey_m, 0.2) if building.told else AltitudeSettings()
    run = worn(motion, placement, seed, barometer, air)
    return _scored(motion, building, walk_body(run, BodySettings(altitude=altitude)).steps)


def building_air(building: Building, seed: int, doors: tuple[DoorSlam, ...] = ()) -> Air:
    """Its weather and wind, felt indoors."""
    return Air(
        origin_height_m=420.0,
        drift_pa_per_sqrt_h=building.drift_pa_per_sqrt_h,
        wind_m_s=building.wind_m_s,
        indoors=(Area.box(-500.0, -500.0, 1000.0, 500.0),),
        doors=doors,
        seed=seed,
    )


def building_legs(building: Building) -> Iterator[Leg]:
    """Up floor by floor, lift down, over the ramp, up and down at once."""
    way = Way()
    storeys = round(STAIRS_M / building.storey_m)
    up = _flights(building, 1.0)
    down = _flights(building, -1.0)
    yield way.to("walk", (40.0, 0.0, 0.0))
    for _ in range(storeys):
        yield way.to("stairs", *up, riser_m=building.riser_m)
        yield way.to("walk", (25.0, 0.0, 0.0))
    yield way.to("lift", (0.0, 0.0, -STAIRS_M))
    yield way.to("walk", (30.0, 0.0, 0.0))
    yield way.to("walk", (_RAMP_M / building.ramp, 0.0, _RAMP_M))
    yield way.to("walk", (20.0, 0.0, 0.0))
    yield way.to("walk", (_RAMP_M / building.ramp, 0.0, -_RAMP_M))
    yield way.to("walk", (25.0, 0.0, 0.0))
    for flights in (up, down):
        yield way.to("stairs", *(storeys * flights), riser_m=building.riser_m)
        yield way.to("walk", (25.0, 0.0, 0.0))


def _flights(building: Building, sign: float) -> list[tuple[float, float, float]]:
    """One storey in flights of at most 2 m with landings between and behind."""
    flights = int(np.ceil(building.storey_m / 2.0))
    rise = building.storey_m / flights
    return [
        part for _ in range(flights) for part in ((rise / building.pitch, 0.0, sign * rise), (0.0, 1.2, 0.0))
    ]


def _scored(motion: PersonMotion, building: Building, steps: Sequence[BodyStepEstimate]) -> HeightScore:
    score = HeightScore()
    at_s = np.array([step.time_ns / _NS_PER_S for step in steps])
    height_m = np.array([np.nan if step.height is None else step.height.height_m for step in steps])
    floor = np.array([0 if step.height is None else step.height.floor for step in steps])
    stairs = [step.motion == "stairs" for step in steps]
    names = settled_names(steps)
    later = [
        names[step.time_ns].startswith("stairs") if step.time_ns in names else said
        for step, said in zip(steps, stairs, strict=True)
    ]
    truth_m, rate_m_s = _truth(motion, at_s)
    for activity in motion.activities:
        inside = np.flatnonzero((at_s >= activity.start_s) & (at_s < activity.end_s))
        way = _way(activity.gait, truth_m[inside])
        if way in ("stairs", "lift"):
            errors = score.stairs_error_m if way == "stairs" else score.lift_error_m
            errors.append(climb_error(at_s, height_m - truth_m, activity.start_s, activity.end_s))
        for k in inside.tolist():
            if way != "stairs" or abs(rate_m_s[k]) > _CLIMBING_M_S:
                score.told[way, stairs[k]] += 1
                score.settled[way, later[k]] += 1
        true_floor = truth_m[inside] / building.storey_m
        if way == "level" and len(inside) and abs(true_floor[-1] - round(true_floor[-1])) < _ON_A_FLOOR:
            right = (floor[inside] == round(true_floor[-1])).tolist()
            score.floors += right
            score.stays.append(right[-1])
    return score


def _truth(motion: PersonMotion, at_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Height of the ground (n,) and how fast it rises there (n,)."""
    ground = motion.torso.ground_m
    return ground(at_s), (ground(at_s + _AROUND_S) - ground(at_s - _AROUND_S)) / (2.0 * _AROUND_S)


def climb_error(at_s: FloatArray, error_m: FloatArray, start_s: float, end_s: float) -> float:
    """By how much a climb is misjudged, from the steps before it to those some seconds after."""
    before = max(int(np.searchsorted(at_s, start_s)) - 1, 0)
    after = min(int(np.searchsorted(at_s, end_s + _SETTLING_S)), len(error_m) - 1)
    return float(abs(error_m[after] - error_m[before]))


def _way(gait: str, height_m: FloatArray) -> str:
    if gait in ("stairs", "lift"):
        return gait
    return "slope" if len(height_m) and float(np.ptp(height_m)) > 0.5 else "level"


def heights_table(seeds: range = range(1, 2)) -> str:
    """Markdown: a row for each building and barometer, over all placements and these seeds."""
    lines = [
        "| building | riser m | drift Pa/√h | barometer | walks | stairs: error m, median "
        "| mean | worst | above 0.4 m | lift: error m, worst | stairs told % | slope not taken for stairs % "
        "| level not taken for stairs % | steps on the right floor % | floors right |",
        "|---|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for name, building in BUILDINGS.items():
        for barometer in BAROMETER_CLASSES:
            scores = [run_building(name, barometer, one, seed) for one in PLACEMENTS for seed in seeds]
            known = (name, f"{building.riser_m:g}", f"{building.drift_pa_per_sqrt_h:g}", barometer)
            lines.append(f"| {' | '.join(known)} | {len(scores)} | {_figures(scores)} |")
    return "\n".join(lines) + "\n"


def _figures(scores: Sequence[HeightScore]) -> str:
    stairs = np.array([error for score in scores for error in score.stairs_error_m])
    lift = max(error for score in scores for error in score.lift_error_m)
    right = [right for score in scores for right in score.floors]
    stays = [right for score in scores for right in score.stays]
    return (
        f"{np.median(stairs):.2f} | {stairs.mean():.2f} | {stairs.max():.2f} "
        f"| {int(np.sum(stairs > MOST_ERROR_M))} of {len(stairs)} | {lift:.2f} "
        f"| {_both(scores, 'stairs', stairs=True)} | {_both(scores, 'slope', stairs=False)} "
        f"| {_both(scores, 'level', stairs=False)} | {100.0 * np.mean(right):.1f} "
        f"| {sum(stays)} of {len(stays)}"
    )


def _both(scores: Sequence[HeightScore], way: str, stairs: bool) -> str:
    """Percent of the steps on a way that were taken for stairs, or that were not: at once, and settled."""
    return ", ".join(
        f"{told_pct([getattr(score, when) for score in scores], way, stairs):.1f}"
        for when in ("told", "settled")
    )


def told_pct(told: Sequence[Counter[tuple[str, bool]]], way: str, stairs: bool) -> float:
    """Percent of the steps on a way that were taken for stairs, or that were not."""
    right, wrong = (sum(one[way, said] for one in told) for said in (stairs, not stairs))
    return 100.0 * right / max(right + wrong, 1)
