"""Attitude of a body-worn unit: known rotations, tilt by gravity, bias by rest; intake and grid."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pdr_engine.body.settings import AttitudeSettings
from pdr_engine.body.steps.attitude import Attitude, levelling, rows_of, turned_by
from pdr_engine.body.steps.grid import CELL_NS, Grid
from pdr_engine.body.steps.intake import CLOCK_PATIENCE, Intake, Sample

G = 9.80665
UP = (0.0, 0.0, G)
STILL = (0.0, 0.0, 0.0)
ANGLE = st.floats(-3.0, 3.0)


@given(st.tuples(ANGLE, ANGLE, ANGLE).filter(lambda v: math.hypot(*v) > 1e-3))
def test_levelling_turns_a_force_upright(force: tuple[float, float, float]) -> None:
    rows = np.array(rows_of(levelling(force)))
    np.testing.assert_allclose(rows @ force, [0.0, 0.0, math.hypot(*force)], atol=1e-6)
    np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-9)


@given(st.tuples(ANGLE, ANGLE, ANGLE), st.tuples(ANGLE, ANGLE, ANGLE))
def test_turning_composes_as_rotations_do(first: tuple[float, ...], second: tuple[float, ...]) -> None:
    start = turned_by((1.0, 0.0, 0.0, 0.0), *first)
    rows = np.array(rows_of(turned_by(start, *second)))
    expected = (Rotation.from_rotvec(first) * Rotation.from_rotvec(second)).as_matrix()
    np.testing.assert_allclose(rows, expected, atol=1e-9)


def feed(attitude: Attitude, seconds: float, accel=UP, gyro=STILL, rate_hz: float = 100.0) -> np.ndarray:
    rows = attitude.rows
    for _ in range(round(seconds * rate_hz)):
        rows = attitude.follow(Sample(0, 1.0 / rate_hz, accel, gyro, None, False))
    return np.array(rows)


def test_a_quarter_turn_about_the_vertical_is_a_quarter_turn() -> None:
    attitude = Attitude(AttitudeSettings())
    before = feed(attitude, 2.0)
    after = feed(attitude, 1.0, gyro=(0.0, 0.0, 0.5 * math.pi))
    np.testing.assert_allclose(after @ before.T, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-6)


def test_tilt_follows_gravity_at_the_set_rate() -> None:
    attitude = Attitude(AttitudeSettings(bias_sigma_rad_s=1e-9))
    feed(attitude, 2.0)
    tilt_rad = 0.1
    leaning = (G * math.sin(tilt_rad), 0.0, G * math.cos(tilt_rad))
    up = feed(attitude, 10.0, accel=leaning)[2]
    left = math.acos(np.dot(up, leaning) / G)
    # x'' + k x' + k²/4 x = 0 with k = 0.1/s, from x = 1, x' = −k: (1 − kt/2)·e^(−kt/2) after 10 s
    assert left == pytest.approx(tilt_rad * 0.5 * math.exp(-0.5), rel=0.02)


def test_gravity_tells_the_bias_of_a_unit_that_never_rests() -> None:
    """0.01 rad/s about a level axis leans a filter without integral part by 0.1 rad; rest tells nothing here."""
    attitude = Attitude(AttitudeSettings(bias_sigma_rad_s=1e-9))
    rows = feed(attitude, 200.0, gyro=(0.01, 0.0, 0.0))
    assert attitude.bias_rad_s[0] == pytest.approx(0.01, rel=0.02)
    assert math.acos(min(1.0, rows[2][2])) < 0.005


def test_standing_still_tells_the_bias_and_a_slow_turn_does_not() -> None:
    attitude = Attitude(AttitudeSettings())
    bias = (0.004, -0.003, 0.006)
    feed(attitude, 20.0, gyro=bias)
    np.testing.assert_allclose(attitude.bias_rad_s, bias, rtol=0.15)
    assert attitude.bias_sigma_rad_s < 0.003
    before = np.array(attitude.rows)
    turned = feed(attitude, 30.0, gyro=bias) @ before.T
    assert abs(math.atan2(turned[1, 0], turned[0, 0])) < 0.1 * 0.006 * 30.0
    turning = Attitude(AttitudeSettings())
    feed(turning, 20.0, gyro=(0.0, 0.0, 0.1))
    assert turning.bias_rad_s == (0.0, 0.0, 0.0)


def test_intake_refuses_what_cannot_be_and_forgives_a_clock() -> None:
    intake = Intake()
    assert intake.judge(1_000_000_000, UP, STILL, None) is not None
    assert intake.judge(1_010_000_000, (math.nan, 0.0, 0.0), STILL, None) is None
    assert intake.judge(1_010_000_000, UP, (0.0, 1e5, 0.0), None) is None
    assert intake.judge(990_000_000, UP, STILL, None) is None
    sample = intake.judge(1_010_000_000, UP, STILL, (math.inf, 0.0, 0.0))
    assert sample is not None
    assert sample.step_s == pytest.approx(0.01)
    assert sample.field_ut is None
    gap = intake.judge(3_000_000_000, UP, STILL, None)
    assert gap is not None
    assert (gap.breaks, gap.step_s) == (True, 0.0)
    assert intake.counters == {"accepted": 3, "dropped": 3, "gaps": 1, "fields_dropped": 1}
    back = [intake.judge(1_000_000 * k, UP, STILL, None) for k in range(CLOCK_PATIENCE + 1)]
    assert [sample is not None for sample in back] == [False] * CLOCK_PATIENCE + [True]


@pytest.mark.parametrize("rate_hz", [25.0, 50.0, 90.0, 400.0])
def test_cells_hold_the_mean_of_the_signal_whatever_the_rate(rate_hz: float) -> None:
    grid = Grid(2)
    cells = []
    for k in range(round(rate_hz)):
        at_ns = 7_000_000 + round(k * 1e9 / rate_hz)
        cells += grid.add(at_ns, (3.0, 2.0 * at_ns * 1e-9))
    middles = [(cell.time_ns + CELL_NS / 2) * 1e-9 for cell in cells]
    assert np.diff([cell.time_ns for cell in cells]).tolist() == [CELL_NS] * (len(cells) - 1)
    np.testing.assert_allclose([cell.values[0] for cell in cells], 3.0)
    np.testing.assert_allclose([cell.values[1] for cell in cells[1:]], 2.0 * np.array(middles[1:]))


def test_a_break_begins_a_new_cell() -> None:
    grid = Grid(1)
    assert not list(grid.add(0, (1.0,)))
    grid.restart()
    assert not list(grid.add(10 * CELL_NS, (5.0,)))
    (cell,) = grid.add(11 * CELL_NS, (5.0,))
    assert cell == (10 * CELL_NS, (5.0,))


def test_levelling_does_not_leak_into_the_bias_about_the_vertical() -> None:
    """A trunk that rolls by 0.1 rad in step with a surge of 2 m/s²: pull times roll is 0.1 m/s² about z on average,
    which in 200 s would make 0.25 · 0.1² / G · 0.1 · 200 s = 0.005 rad/s."""
    attitude = Attitude(AttitudeSettings())
    feed(attitude, 2.0)
    omega, roll_rad, surge_m_s2 = 2.0 * math.pi, 0.1, 2.0
    for k in range(20_000):
        swing = math.sin(omega * 0.01 * k)
        up = (0.0, math.sin(roll_rad * swing), math.cos(roll_rad * swing))
        rate = roll_rad * omega * math.cos(omega * 0.01 * k)
        accel = (surge_m_s2 * swing, G * up[1], G * up[2])
        attitude.follow(Sample(0, 0.01, accel, (rate, 0.0, 0.0), None, False))
    assert abs(attitude.bias_rad_s[2]) < 5e-4


def test_what_rests_take_off_about_the_vertical_is_told() -> None:
    attitude = Attitude(AttitudeSettings())
    feed(attitude, 60.0, gyro=(0.0, 0.0, 0.01))
    assert attitude.rest_turn_rad_s == pytest.approx(0.01, rel=0.02)
    assert attitude.rest_turn_rad_s == pytest.approx(attitude.bias_rad_s[2], rel=1e-3)
