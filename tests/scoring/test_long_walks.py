"""The table of long walks tells what was compared, and a walk's surroundings are where they should be."""

import numpy as np

from proving_ground.evaluation.foot.heading_page import heading
from proving_ground.evaluation.foot.long_walks import (
    EARTH,
    MOUNTING,
    Comparison,
    Surroundings,
    long_walks_table,
    magnetic_walk,
)


def test_the_table_s_figures_by_hand() -> None:
    found = [
        Comparison((1.0, 0.5), (0.4, -0.1)),
        Comparison((2.0, 2.5), (-0.8, 0.3)),
        Comparison((6.0, 3.0), (0.0, 0.2)),
    ]
    lines = long_walks_table({"a street": found})
    assert lines[2] == "| a street | 3 | 2.00 → 2.50 | 3.00 → 2.00 | 6.00 → 3.00 | 0.40 → 0.20 | 1 |"
    assert lines[2] in heading({"a street": found})


def test_iron_lies_only_where_it_should() -> None:
    amid = Surroundings("amid", 20.0, (0.4, 0.7))
    walked = magnetic_walk(60.0, seed=5, surroundings=amid)
    assert walked.imu.mag_ut is not None
    strength = np.linalg.norm(walked.imu.mag_ut, axis=1)
    share = walked.imu.time_s / walked.imu.time_s[-1]
    disturbed = (share >= 0.4) & (share <= 0.7)
    assert np.abs(strength[~disturbed] - EARTH.strength_ut).max() < 2.0  # five sigmas of its noise
    assert np.abs(strength[disturbed] - EARTH.strength_ut).max() > 10.0


def test_the_field_is_the_earth_s_in_the_sensor_s_axes() -> None:
    walked = magnetic_walk(20.0, seed=6)
    assert walked.imu.mag_ut is not None
    still = walked.imu.mag_ut[:400].mean(axis=0)
    east, north, up = MOUNTING.apply(still)  # now forward, left, up of the sole
    yaw = walked.yaw_rad[0]
    ahead = np.array([np.cos(yaw) * east - np.sin(yaw) * north, np.sin(yaw) * east + np.cos(yaw) * north, up])
    np.testing.assert_allclose(ahead, [EARTH.east_ut, EARTH.north_ut, EARTH.up_ut], atol=0.1)
