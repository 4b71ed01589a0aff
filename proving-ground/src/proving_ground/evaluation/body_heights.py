"""The body module's altimeter in simulated buildings: stairs of 7.8 m, lifts, slopes, floors (METHODS A8).

Every person walks on the level, climbs stairs of 7.8 m with landings, rides a lift down, goes over a ramp and
comes back by the stairs, in weather that drifts and doors that slam. Steps are the simulator's own footfalls, so
that this scores heights and not step detection.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pdr_engine.body.altitude.altimeter import LAG_S, Altimeter
from pdr_engine.body.altitude.climb import Way
from pdr_engine.body.altitude.floors import FloorCounter
from pdr_engine.body.pieces import FloatArray
from proving_ground.people import GaitName, Itinerary, Leg, Person, PersonMotion, move
from proving_ground.sensors import BAROMETER_CLASSES, Air, Area, DoorSlam, Mounting, measure_pressure

STAIRS_M = 7.8
_NS_PER_S = 1_000_000_000
_STAY_S, _ON_A_FLOOR = 12.0, 0.05  # share of a storey: the ramp's top is no floor
_CLIMBING_M_S = 0.1
_SETTLING_S = 1.5  # of a stretch at its ends, in which nobody could tell


@dataclass(frozen=True, slots=True)
class Building:
    """Height of its storeys and the pitch of its stairs, grade of its ramp, and its air."""

    storey_m: float
    pitch: float
    ramp: float
    drift_pa_per_sqrt_h: float
    wind_m_s: float


BUILDINGS = {
    "house": Building(2.6, 0.63, 0.08, 30.0, 0.0),
    "office": Building(3.9, 0.58, 0.06, 50.0, 4.0),
    "mall": Building(7.8, 0.5, 0.10, 50.0, 0.0),
}


@dataclass(frozen=True, slots=True)
class HeightScore:
    """One walk: errors of each 7.8 m of stairs (m), how much time each way was told right, floors."""

    building: str
    barometer: str
    stairs_error_m: tuple[float, ...]
    told: dict[tuple[Way, Way], float]  # seconds, by truth and by what was said
    floors_right: int
    floors: int
    end_error_m: float


def run_building(name: str, barometer: str, seed: int) -> HeightScore:
    """One walk through a building; the same for the same seed."""
    building = BUILDINGS[name]
    rng = np.random.default_rng(seed)
    motion = move(Person.drawn(rng), Itinerary(tuple(_legs(building)), start_s=8.0), seed)
    air = Air(
        origin_height_m=420.0,
        drift_pa_per_sqrt_h=building.drift_pa_per_sqrt_h,
        wind_m_s=building.wind_m_s,
        indoors=(Area.box(-500.0, -500.0, 1000.0, 500.0),),
        doors=(DoorSlam(30.0, np.array([20.0, 0.0, 0.0])),),
        seed=seed,
    )
    series = measure_pressure(
        motion.torso, motion.duration_s, Mounting(), BAROMETER_CLASSES[barometer], air, rng
    )
    times_s, heights_m, ways, floors = _followed(motion, building, series.time_s, series.pressure_pa)
    return _scored(name, barometer, motion, building, times_s, heights_m, ways, floors)


def _legs(building: Building) -> Iterator[Leg]:
    """Level, up the stairs, level, lift down, level, ramp up, level, ramp down, level, up again, level."""
    place = np.zeros(3)

    def to(gait: GaitName, *moves: tuple[float, float, float]) -> Leg:
        nonlocal place
        points = place + np.vstack([np.zeros(3), np.cumsum(moves, axis=0)])
        place = points[-1]
        return Leg(gait, points)

    flights = round(STAIRS_M / min(building.storey_m, 3.9))
    flight = (STAIRS_M / flights / building.pitch, 0.0, STAIRS_M / flights)
    landing = (0.0, 1.2, 0.0)
    stairs = [part for _ in range(flights) for part in (flight, landing)][:-1]
    down = [(-ahead, aside, -up) for ahead, aside, up in stairs]
    for way in (stairs, down, stairs):
        yield to("walk", (40.0, 0.0, 0.0))
        yield to("stairs", *way)
    yield to("walk", (25.0, 0.0, 0.0))
    yield to("lift", (0.0, 0.0, -STAIRS_M))
    yield to("walk", (30.0, 0.0, 0.0))
    ramp = (2.0 / building.ramp, 0.0, 2.0)
    yield to("walk", ramp)
    yield to("walk", (20.0, 0.0, 0.0))
    yield to("walk", (ramp[0], 0.0, -2.0))
    yield to("walk", (40.0, 0.0, 0.0))


def _followed(
    motion: PersonMotion, building: Building, time_s: FloatArray, pressure_pa: FloatArray
) -> tuple[FloatArray, FloatArray, list[Way], FloatArray]:
    """What the altimeter says at each sample, settled: times, heights, ways and floors."""
    altimeter, floors = Altimeter(), FloorCounter(storey_m=building.storey_m, storey_sigma_m=0.2)
    begins_s = np.concatenate([foot.begin_s for foot in motion.footfalls.values()])
    steps_s = np.sort(begins_s[np.isfinite(begins_s)])
    told: list[tuple[float, float, Way, int]] = []
    done = 0
    for at_s, value in zip(time_s, pressure_pa, strict=True):
        while done < len(steps_s) and steps_s[done] <= at_s:
            altimeter.step(round(steps_s[done] * _NS_PER_S))
            done += 1
        altimeter.pressure(round(at_s * _NS_PER_S), float(value))
        way = altimeter.climbing.way
        floors.update(round(at_s * _NS_PER_S), altimeter.settled_height_m, altimeter.sigma_m, way == "level")
        told.append((at_s - LAG_S, altimeter.settled_height_m, way, floors.floor))
    times, heights, ways, numbers = zip(*told, strict=True)
    return np.array(times), np.array(heights), list(ways), np.array(numbers, dtype=np.float64)


def _scored(
    name: str,
    barometer: str,
    motion: PersonMotion,
    building: Building,
    times_s: FloatArray,
    heights_m: FloatArray,
    ways: list[Way],
    floors: FloatArray,
) -> HeightScore:
    truth_m = motion.torso.ground_m(times_s)
    errors, told, right, stays = [], dict[tuple[Way, Way], float](), 0, 0
    period_s = float(np.median(np.diff(times_s)))
    for activity in motion.activities:
        inside = (times_s >= activity.start_s + _SETTLING_S) & (times_s <= activity.end_s - _SETTLING_S)
        if not inside.any():
            continue
        way = _way(activity.gait, truth_m[inside])
        if way == "stairs":  # a landing is none
            inside &= np.abs(np.gradient(truth_m, times_s)) > _CLIMBING_M_S
        for k in np.flatnonzero(inside):
            pair = (way, ways[int(k)])
            told[pair] = told.get(pair, 0.0) + period_s
        if way == "stairs":
            before, after = np.searchsorted(times_s, [activity.start_s, activity.end_s + LAG_S])
            climbed = heights_m[after] - heights_m[before]
            errors.append(float(abs(climbed - (truth_m[after] - truth_m[before]))))
        if way == "level" and activity.end_s - activity.start_s > _STAY_S:
            last = np.flatnonzero(inside)[-1]
            floor = truth_m[last] / building.storey_m
            if abs(floor - round(floor)) < _ON_A_FLOOR:
                stays += 1
                right += int(floors[last] == round(floor))
    return HeightScore(
        name, barometer, tuple(errors), told, right, stays, float(abs(heights_m[-1] - truth_m[-1]))
    )


def _way(gait: str, height_m: FloatArray) -> Way:
    if gait in ("stairs", "lift"):
        return "stairs" if gait == "stairs" else "lift"
    return "slope" if float(np.ptp(height_m)) > 0.5 else "level"


def heights_table(seeds: range = range(1, 10, 2)) -> str:
    """Markdown: a row for each building and barometer, over these seeds."""
    lines = [
        "| building | drift Pa/√h | barometer | walks | stairs of 7.8 m: error m, median | mean | worst "
        "| slope not taken for stairs % | lift % | stairs not for slope or lift % | floors right |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, building in BUILDINGS.items():
        for barometer in BAROMETER_CLASSES:
            scores = [run_building(name, barometer, seed) for seed in seeds]
            errors = np.concatenate([score.stairs_error_m for score in scores])
            shares = " | ".join(
                f"{apart_pct(scores, *pair):.1f}"
                for pair in (("slope", ("stairs",)), ("lift", ("stairs",)), ("stairs", ("slope", "lift")))
            )
            floors = f"{sum(s.floors_right for s in scores)} of {sum(s.floors for s in scores)}"
            lines.append(
                f"| {name} | {building.drift_pa_per_sqrt_h:g} | {barometer} | {len(scores)} "
                f"| {np.median(errors):.2f} | {errors.mean():.2f} | {errors.max():.2f} | {shares} | {floors} |"
            )
    return "\n".join(lines) + "\n"


def apart_pct(scores: list[HeightScore], truth: Way, others: tuple[Way, ...]) -> float:
    """Percent of the time on one way that was not taken for one of the others."""
    spent = [
        (said, seconds) for score in scores for (way, said), seconds in score.told.items() if way == truth
    ]
    wrong = sum(seconds for said, seconds in spent if said in others)
    return 100.0 * (1.0 - wrong / sum(seconds for _, seconds in spent))


if __name__ == "__main__":
    print(heights_table())  # noqa: T201
