"""The body module on simulated walks: heights, azimuths past iron, steps with GPS. Small, but real."""

import numpy as np

from proving_ground.evaluation.body_azimuth import simulated
from proving_ground.evaluation.body_heights import run_building, told_pct
from proving_ground.evaluation.body_pns_gps import chain_steps, drawn_steps, town
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
