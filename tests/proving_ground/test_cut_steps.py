"""A gyro's range made smaller: what the steps tell of it beside those of the recording as it was."""

import math

import numpy as np

from proving_ground.evaluation.foot.cut_steps import cut_foot, row
from sensor_gateway.recordings.run import ImuSeries
from support.foot_streams import START_NS, Stream, walk

WALK = walk(8)
PEAK_DEG_S = math.degrees(float(np.abs(WALK.gyro).max()))


def series(stream: Stream) -> ImuSeries:
    return ImuSeries((stream.time_ns - START_NS) * 1e-9, stream.accel, stream.gyro)


def test_steps_err_less_the_less_is_cut_off_and_own_up_to_the_turn_they_share() -> None:
    little, much = (cut_foot(series(WALK), part * PEAK_DEG_S) for part in (0.95, 0.8))
    assert little is not None
    assert much is not None
    assert len(little.turn_rad) == len(much.turn_rad) >= 8
    assert 0.0 < np.median(little.place_m) < np.median(much.place_m) < 0.05
    assert abs(much.turn_rad.mean()) < 2.0 * much.shared_rad.mean()
    assert row(400.0, [much, much]).startswith(f"| 400 | 2 | {2 * len(much.turn_rad)} |")


def test_a_range_that_cuts_nothing_tells_nothing() -> None:
    assert cut_foot(series(WALK), 1.01 * PEAK_DEG_S) is None
