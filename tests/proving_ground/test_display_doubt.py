"""The doubt that displays show, held to its word on walks that it was not fitted to."""

import numpy as np
import numpy.typing as npt
import pytest

from bootprint.display import RADIUS_95, free_sigma_m
from bootprint.prediction import moved_m
from proving_ground.people import move
from proving_ground.scenario.loading import load_scenario, play

PERIOD_S = 0.2
SMOOTHED_S = 1.5
AGES_S = (2, 5, 15, 40, 90)
FloatArray = npt.NDArray[np.float64]


def walks(name: str, people: int = 6, seed: int = 7) -> list[FloatArray]:
    """Ways (T, 2) of some people of a library scenario that had no part in choosing the growth."""
    scenario = load_scenario(name)
    played = play(scenario, seed)
    return [
        move(played.persons[soldier.id], played.timetables[soldier.id].itinerary, seed)
        .truth(PERIOD_S)
        .position_m[:, :2]
        for soldier in scenario.cast.soldiers[:people]
    ]


def errors_m(place_m: FloatArray, age_s: int) -> FloatArray:
    """How wrong the prediction is after ``age_s``, from reports at every other second with smoothed velocity."""
    velocity = np.gradient(place_m, PERIOD_S, axis=0)
    for index in range(1, len(velocity)):
        gain = -np.expm1(-PERIOD_S / SMOOTHED_S)
        velocity[index] = velocity[index - 1] + gain * (velocity[index] - velocity[index - 1])
    steps = round(age_s / PERIOD_S)
    at = np.arange(0, len(place_m) - steps, 10)
    reach_s = moved_m(1.0, 0.0, age_s)[0]
    return np.linalg.norm(place_m[at + steps] - place_m[at] - reach_s * velocity[at], axis=1)


@pytest.mark.parametrize("name", ["closed-loops", "stairs-and-lift", "platoon-raid"])
def test_people_are_inside_the_circle_that_says_95_percent(name: str) -> None:
    ways = walks(name)
    inside, half = [], []
    for age_s in AGES_S:
        errors = np.concatenate([errors_m(way, age_s) for way in ways])
        inside.append(float(np.mean(errors <= RADIUS_95 * free_sigma_m(age_s))))
        half.append(float(np.mean(errors <= 0.5 * RADIUS_95 * free_sigma_m(age_s))))
    # Who walks straight on for a minute and then turns back is farther off than most.
    assert min(inside) > 0.8
    assert np.mean(inside) > 0.9
    # Nor is it so wide that it says nothing.
    assert np.mean(half) < 0.9
