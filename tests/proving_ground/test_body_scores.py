"""The body module's parts on simulated walks: heights, azimuths past iron, steps with GPS. Small, but real."""

import numpy as np

from proving_ground.evaluation.body_azimuth import simulated
from proving_ground.evaluation.body_heights import STAIRS_M, apart_pct, run_building
from proving_ground.evaluation.body_pns_gps import town


def test_a_building_s_heights_and_floors() -> None:
    scores = [run_building("mall", "industrial", seed) for seed in (1, 3)]
    errors = np.concatenate([score.stairs_error_m for score in scores])
    assert len(errors) == 6  # up, down, up
    assert float(np.median(errors)) < 0.4 < 0.1 * STAIRS_M
    assert apart_pct(scores, "lift", ("stairs",)) > 95.0
    assert apart_pct(scores, "slope", ("stairs",)) > 95.0
    assert sum(score.floors_right for score in scores) >= sum(score.floors for score in scores) - 1


def test_a_bridge_has_a_third_of_the_compass_s_error_past_iron() -> None:
    score = simulated(seed=1, iron=2.0, outside_m=150.0)
    assert score.rms_deg["compass"] > 6.0
    assert score.rms_deg["kalman"] < score.rms_deg["compass"] / 3.0
    assert 10.0 < score.disturbed_pct < 90.0


def test_gps_in_three_sections_is_enough() -> None:
    score = town(seed=104)
    assert score.worst_m < 20.0
    assert score.dead_reckoning_m > 2.0 * score.worst_m
