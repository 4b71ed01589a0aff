"""The velocity that is told: fresh where the way gone can be trusted, the fusion's where not."""

import pytest

from bootprint.messages import Position
from sa_hub.motion import Motion

S = 1_000_000_000
METRES_PER_DEG = 111_133.0


def position(time_s: float, north_m: float, north_m_s: float) -> Position:
    return Position(
        time_ns=round(time_s * S),
        mode="boots",
        latitude_deg=north_m / METRES_PER_DEG,
        longitude_deg=18.07,
        height_m=0.0,
        east_m=0.0,
        north_m=north_m,
        up_m=0.0,
        covariance_m2=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0),
        velocity_m_s=(0.0, north_m_s, 0.0),
        speed_m_s=abs(north_m_s),
    )


def test_who_stops_is_told_to_stand_before_the_fusions_velocity_says_so() -> None:
    motion = Motion()
    for tenths in range(0, 50, 2):
        motion.update(position(tenths / 10, 1.4 * tenths / 10, 1.4))
    told = [motion.update(position(5.0 + tenths / 10, 7.0, 1.4)) for tenths in range(0, 10, 2)]
    assert told[0][1] == pytest.approx(1.4, abs=0.02)
    assert told[2][1] == pytest.approx(0.7, abs=0.02)  # half of the last 0.8 s was a way
    assert told[4] == pytest.approx((0.0, 0.0), abs=0.02)


def test_a_position_that_a_fix_has_moved_is_no_way() -> None:
    motion = Motion()
    for tenths in range(0, 50, 2):
        motion.update(position(tenths / 10, 0.0, 0.0))
    assert motion.update(position(5.0, 8.0, 0.0)) == pytest.approx((0.0, 0.0))


@pytest.mark.parametrize("gap_s", [0.2, 3.0, -1.0])
def test_without_a_recent_way_the_fusion_is_believed(gap_s: float) -> None:
    motion = Motion()
    motion.update(position(10.0, 0.0, 1.0))
    assert motion.update(position(10.0 + gap_s, 0.0, 1.0)) == pytest.approx((0.0, 1.0))
