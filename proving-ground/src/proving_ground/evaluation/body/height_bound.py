"""How well stairs can be measured at all: the body module's height filter told all that was walked (METHODS A8).

The people of `body_heights` climb the same buildings in many weathers. Told by the truth are what was climbed when,
and each riser; the barometer has no noise but the air's. What is missed then is the weather's: 0.4 m are 4.8 Pa, as
much as a drift of 50 Pa in √h makes in half a minute. Without steps the filter has the pressure alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from pdr_engine.body.altitude.altimeter import pressure_height_m
from pdr_engine.body.altitude.climb import TICK_S, Way
from pdr_engine.body.altitude.height_filter import HeightFilter
from pdr_engine.body.pieces import FloatArray
from pdr_engine.body.settings import AltitudeSettings
from proving_ground.evaluation.body.heights import (
    BUILDINGS,
    MOST_ERROR_M,
    Building,
    building_air,
    building_legs,
    climb_error,
)
from proving_ground.evaluation.body.wearers import walked
from proving_ground.people import Person, PersonMotion
from proving_ground.people.gaits import stair_steps

_NOISE_M = 0.12  # as the altimeter takes it
_SLOPE_M = 0.01  # a tick: less is level
WEATHERS = range(1, 81, 2)  # their seeds: odd ones, as in all tables


@dataclass(frozen=True)
class Told:
    """A walk by ticks: their ends s, the ground there m, the way over each, and the risers climbed (all (n,))."""

    motion: PersonMotion
    end_s: FloatArray
    ground_m: FloatArray
    ways: list[Way]
    risers: FloatArray


def truth_of(building: Building, seed: int) -> Told:
    """What a person did in this building."""
    legs = list(building_legs(building))
    motion = walked(Person.drawn(np.random.default_rng(seed)), legs, seed, start_s=8.0)
    end_s = np.arange(TICK_S, motion.duration_s, TICK_S)
    ground_m = motion.torso.ground_m(end_s)
    rise_m = np.diff(ground_m, prepend=ground_m[:1])
    ways = [_way(motion, at_s, rise) for at_s, rise in zip(end_s.tolist(), rise_m.tolist(), strict=True)]
    first = next(leg for leg in legs if leg.gait == "stairs")
    riser_m = float(first.points_m[1, 2] - first.points_m[0, 2]) / float(stair_steps(first, 0.6)[0])
    return Told(motion, end_s, ground_m, ways, np.where(np.array(ways) == "stairs", rise_m / riser_m, 0.0))


def _way(motion: PersonMotion, end_s: float, rise_m: float) -> Way:
    for activity in motion.activities:
        if (
            activity.start_s < end_s
            and activity.end_s > end_s - TICK_S
            and activity.gait in ("stairs", "lift")
        ):
            return "stairs" if activity.gait == "stairs" else "lift"
    return "slope" if abs(rise_m) > _SLOPE_M else "level"


def stairs_errors_m(told: Told, building: Building, seed: int, steps: bool) -> Iterator[float]:
    """By how much each climb by stairs is misjudged in the weather of this seed; ``steps``: risers are told."""
    place_m = np.column_stack([np.zeros((len(told.end_s), 2)), told.ground_m])
    pressure_pa = building_air(building, seed).pressure_pa(told.end_s, place_m, np.zeros(len(told.end_s)))
    altitude = AltitudeSettings(building.storey_m, 0.2) if building.told else AltitudeSettings()
    kalman = HeightFilter(pressure_height_m(pressure_pa[0]), altitude.storey_m, altitude.storey_sigma_m)
    height_m = []
    for pressure, way, risers in zip(pressure_pa.tolist(), told.ways, told.risers.tolist(), strict=True):
        kalman.predict("lift" if way == "stairs" and not steps else way, risers if steps else 0.0, 0.0)
        kalman.pressure(pressure_height_m(pressure), _NOISE_M)
        kalman.follow_climb(way)
        height_m.append(kalman.height_m)
    error_m = np.array(height_m) - told.ground_m
    for activity in told.motion.activities:
        if activity.gait == "stairs":
            yield climb_error(told.end_s, error_m, activity.start_s, activity.end_s)


def bound_table() -> str:
    """Markdown: a row for each building."""
    lines = [
        "| building | climbs | every riser told: above 0.4 m % | worst m "
        "| by pressure alone: above 0.4 m % | worst m |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    untold = {
        f"{name}, storey not told": replace(one, told=False) for name, one in BUILDINGS.items() if one.told
    }
    for name, building in (BUILDINGS | untold).items():
        told = truth_of(building, 1)
        rows = [
            np.array([error for seed in WEATHERS for error in stairs_errors_m(told, building, seed, steps)])
            for steps in (True, False)
        ]
        figures = " | ".join(f"{100.0 * np.mean(row > MOST_ERROR_M):.1f} | {row.max():.2f}" for row in rows)
        lines.append(f"| {name} | {len(rows[0])} | {figures} |")
    return "\n".join(lines) + "\n"
