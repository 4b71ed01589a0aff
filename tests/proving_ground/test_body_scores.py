"""The body module on simulated walks: heights, azimuths past iron, steps with GPS. Small, but real."""

from dataclasses import replace

import numpy as np
import pytest

from proving_ground.evaluation.body.azimuth import simulated
from proving_ground.evaluation.body.height_bound import stairs_errors_m, truth_of
from proving_ground.evaluation.body.heights import BUILDINGS, run_building, told_pct
from proving_ground.evaluation.body.pns_gps import chain_steps, drawn_steps, town
from proving_ground.people import Itinerary, Leg, Person, move


def test_a_building_s_heights_and_floors_through_the_whole_chain() -> None:
    score = run_building("office", "industrial", "belt", seed=1)
    assert len(score.stairs_error_m) == 4  # two storeys, both at once, and down again
    assert max(score.stairs_error_m) < 0.6
    assert len(score.lift_error_m) == 1
    assert score.lift_error_m[0] < 0.5
    assert told_pct([score.told], "slope", stairs=False) > 95.0
    assert told_pct([score.told], "stairs", stairs=True) > 80.0
    assert told_pct([score.settled], "stairs", stairs=True) > 90.0
    assert all(score.stays)
    assert np.mean(score.floors) > 0.95


def test_stairs_are_measured_as_well_as_the_weather_lets_one() -> None:
    """Told what was climbed, in still air all stairs are right; 300 Pa in √h, a front, are metres."""
    hall = BUILDINGS["hall"]
    told = truth_of(hall, seed=1)
    assert told.risers.sum() == pytest.approx(52.0)  # two climbs up, one down, of 52 risers of 15 cm
    still, front = (replace(hall, drift_pa_per_sqrt_h=drift, told=False) for drift in (0.0, 300.0))
    assert max(stairs_errors_m(told, still, 1, steps=False)) < 0.05
    first_m, *again_m = stairs_errors_m(told, still, 1, steps=True)
    assert max(again_m) < 0.15 < first_m < 0.3  # risers lower than most are learned
    assert max(stairs_errors_m(told, front, 1, steps=False)) > 0.8


def test_a_bridge_has_a_third_of_the_compass_s_error_past_iron() -> None:
    score = simulated(seed=1, iron=2.0, outside_m=150.0)
    assert score.rms_deg["compass"] > 6.0
    assert score.rms_deg["kalman"] < score.rms_deg["compass"] / 3.0
    assert 10.0 < score.disturbed_pct < 90.0


def test_gps_in_three_sections_is_enough() -> None:
    score = town(104, drawn_steps)
    assert score.worst_m < 20.0
    assert score.dead_reckoning_m > 2.0 * score.worst_m


def test_the_chain_s_steps_lead_along_the_streets() -> None:
    streets_m = np.array([[0.0, 0.0, 0.0], [70.0, 0.0, 0.0], [70.0, 50.0, 0.0]])
    motion = move(Person(), Itinerary((Leg("walk", streets_m),), start_s=5.0), 1)
    steps = chain_steps(motion, streets_m, np.random.default_rng(1))
    assert len(steps.times_s) == len(steps.truth_m) == len(steps.lengths_m) + 1 == len(steps.azimuths) + 1
    told, true = steps.lengths_m, np.linalg.norm(np.diff(steps.truth_m, axis=0), axis=1)
    assert (
        0.75 < told.sum() / true.sum() < 1.1
    )  # until a hundred steps tell trunk from hand they are too short
    first, second = np.degrees(steps.azimuths[10:70]), np.degrees(steps.azimuths[-40:-5])
    assert abs(np.median(first) % 360.0 - 90.0) < 12.0  # magnetometer and seat are not perfect
    assert abs((np.median(second) + 180.0) % 360.0 - 180.0) < 12.0
    np.testing.assert_allclose(steps.truth_m[-1], streets_m[-1, :2], atol=3.0)
