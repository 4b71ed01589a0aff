"""The simulated walker: its sensors must be consistent with its motion, by integration independent of it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from proving_ground.simulation.walker import (
    GRAVITY_M_S2,
    Gait,
    GnssQuality,
    ImuQuality,
    Path3D,
    boot_imu,
    footfalls,
    simulate_walk,
    walk_duration_s,
)

ORIGIN = Origin(latitude_deg=59.0, longitude_deg=18.0, height_m=20.0)
PERFECT = ImuQuality(rate_hz=1000.0, accel_noise_m_s2=0.0, gyro_noise_rad_s=0.0, gyro_bias_rad_s=0.0)
L_SHAPE = Path3D(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 8.0, 0.0]]))


def strapdown(time_s: np.ndarray, force: np.ndarray, rate: np.ndarray, attitude: Rotation) -> np.ndarray:
    """Midpoint integration of specific force and rate from rest at zero: position (n, 3)."""
    position, velocity = np.zeros(3), np.zeros(3)
    track = [position.copy()]
    for k in range(1, len(time_s)):
        dt = time_s[k] - time_s[k - 1]
        turned = attitude * Rotation.from_rotvec(0.5 * (rate[k] + rate[k - 1]) * dt)
        acceleration = 0.5 * (attitude.apply(force[k - 1]) + turned.apply(force[k]))
        acceleration[2] -= GRAVITY_M_S2
        position = position + velocity * dt + 0.5 * acceleration * dt**2
        velocity = velocity + acceleration * dt
        attitude = turned
        track.append(position.copy())
    return np.array(track)


@pytest.mark.parametrize("side", [+1, -1])
def test_integrated_sensors_follow_the_foot(side: int) -> None:
    motion = footfalls(L_SHAPE, Gait(), side)
    mounting = Rotation.from_euler("XYZ", [0.3, -0.4, 2.0])
    imu = boot_imu(motion, 8.0, mounting, PERFECT, np.random.default_rng(1))
    true_m, attitude = motion.at(imu.time_s)
    track = strapdown(imu.time_s, imu.accel_m_s2, imu.gyro_rad_s, attitude[0] * mounting)
    assert np.linalg.norm(true_m[-1] - true_m[0]) > 3.0
    np.testing.assert_allclose(track, true_m - true_m[0], atol=0.02)


def test_a_standing_foot_feels_gravity_and_nothing_else() -> None:
    imu = boot_imu(
        footfalls(L_SHAPE, Gait(), +1), 3.0, Rotation.identity(), PERFECT, np.random.default_rng(1)
    )
    np.testing.assert_allclose(imu.accel_m_s2[:2900], [[0.0, 0.0, GRAVITY_M_S2]] * 2900, atol=1e-6)
    np.testing.assert_allclose(imu.gyro_rad_s[:2900], 0.0, atol=1e-9)


def test_feet_start_and_end_side_by_side_and_never_stray_further_than_a_stride() -> None:
    gait = Gait()
    time_s = np.arange(0.0, walk_duration_s(L_SHAPE, gait), 0.01)
    left, right = (footfalls(L_SHAPE, gait, side).at(time_s)[0] for side in (+1, -1))
    apart = np.linalg.norm((left - right)[:, :2], axis=1)
    assert apart[0] == pytest.approx(gait.width_m)
    assert apart[-1] == pytest.approx(gait.width_m)
    assert apart.max() < 2.0 * gait.step_length_m
    np.testing.assert_allclose(0.5 * (left + right)[-1], [10.0, 8.0, 0.0], atol=1e-9)


def test_only_one_foot_is_in_the_air_at_a_time() -> None:
    gait = Gait()
    time_s = np.arange(0.0, walk_duration_s(L_SHAPE, gait), 0.01)
    heights = [footfalls(L_SHAPE, gait, side).at(time_s)[0][:, 2] for side in (+1, -1)]
    assert not np.logical_and(heights[0] > 1e-9, heights[1] > 1e-9).any()


def test_the_run_carries_truth_and_fixes_that_agree() -> None:
    quality = GnssQuality(sigma_m=2.0, until_s=15.0)
    run = simulate_walk("w", L_SHAPE.points_m, ORIGIN, seed=3, gnss=quality)
    truth = run.truth["body"]
    assert truth.time_s[-1] == pytest.approx(run.duration_s, abs=0.2)
    assert run.gnss is not None
    assert run.gnss.time_s[-1] < 15.0
    enu = np.array(
        [
            LocalFrame(ORIGIN).to_enu(*fix)
            for fix in zip(run.gnss.lat_deg, run.gnss.lon_deg, run.gnss.alt_m, strict=True)
        ]
    )
    true = np.column_stack([np.interp(run.gnss.time_s, truth.time_s, c) for c in truth.position_m.T])
    error = enu - true
    assert 0.0 < np.abs(error).max() < 5.0 * 3.0
    # The error wanders: neighbours are alike, unlike white noise.
    assert np.abs(np.diff(error[:, 0])).mean() < 1.0


def test_the_same_seed_gives_the_same_walk_and_another_does_not() -> None:
    one, same, other = (simulate_walk("w", L_SHAPE.points_m, ORIGIN, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.imus["left_foot"].accel_m_s2, same.imus["left_foot"].accel_m_s2)
    assert not np.array_equal(one.imus["left_foot"].accel_m_s2, other.imus["left_foot"].accel_m_s2)
