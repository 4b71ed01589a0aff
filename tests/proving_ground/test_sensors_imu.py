"""Inertial units on motions in closed form: what they must measure is worked out by hand."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch
from scipy.spatial.transform import Rotation

from bootprint.errors import ConfigError
from bootprint.geomagnetism import EarthField
from proving_ground.motion import Motion
from proving_ground.sensors import (
    IMU_CLASSES,
    DeviceIron,
    ImuClass,
    Magnetics,
    Mounting,
    imu_class,
    measure_imu,
)
from proving_ground.sensors.imu import GRAVITY_M_S2
from proving_ground.sensors.imu_quality import (
    CONSUMER,
    INDUSTRIAL,
    INDUSTRIAL_OLD,
    MagnetometerQuality,
    TriadQuality,
)
from proving_ground.sensors.randomness import flicker
from sensor_gateway.recordings.run import ImuSeries
from support.moving import Bouncing, Circling, Straight

PERFECT_TRIAD = TriadQuality(0.0, 0.0, 0.0, 0.0, 0.0, 1e6, 0.0, 0.0)
PERFECT = replace(
    INDUSTRIAL,
    accel=PERFECT_TRIAD,
    gyro=PERFECT_TRIAD,
    g_sensitivity=0.0,
    stamp_jitter_s=0.0,
    clock_ppm=0.0,
    loss_share=0.0,
)
STILL = Straight((100.0, -50.0, 3.0))
G = GRAVITY_M_S2


def measured(
    motion: Motion,
    quality: ImuClass,
    duration_s: float = 2.0,
    mounting: Mounting | None = None,
    seed: int = 1,
) -> ImuSeries:
    rng = np.random.default_rng(seed)
    return measure_imu(motion, duration_s, mounting or Mounting(), quality, None, rng)


def units(quality: ImuClass, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations and rates (count, 3) of so many units lying still, noise averaged away by having none."""
    series = [measured(STILL, quality, 0.02, seed=seed) for seed in range(count)]
    return (
        np.array([one.accel_m_s2[0] for one in series]),
        np.array([one.gyro_rad_s[0] for one in series]),
    )


def test_a_unit_at_rest_feels_gravity_in_its_own_axes() -> None:
    mounting = Mounting(np.array([0.1, 0.2, 0.3]), Rotation.from_euler("Y", -np.pi / 2.0))
    imu = measured(STILL, PERFECT, mounting=mounting)
    # Turned nose up: the sensor's x axis points up.
    np.testing.assert_allclose(imu.accel_m_s2, np.tile([G, 0.0, 0.0], (400, 1)), atol=1e-6)
    np.testing.assert_allclose(imu.gyro_rad_s, 0.0, atol=1e-9)
    np.testing.assert_allclose(imu.time_s, np.arange(400) / 200.0)


def test_on_a_circle_it_feels_the_pull_to_the_centre_where_it_is_mounted() -> None:
    """The left axis points to the centre. At (a, b, c) off the body −ω²·(place − centre) is −ω²a and ω²(r − b)."""
    turn = 1.5
    mounting = Mounting(np.array([0.3, 0.5, 0.2]))
    imu = measured(Circling(4.0, turn), PERFECT, mounting=mounting)
    np.testing.assert_allclose(
        imu.accel_m_s2, np.tile([-(turn**2) * 0.3, turn**2 * 3.5, G], (400, 1)), atol=1e-4
    )
    np.testing.assert_allclose(imu.gyro_rad_s, np.tile([0.0, 0.0, turn], (400, 1)), atol=1e-6)


def test_rates_are_told_in_the_axes_of_the_mounting() -> None:
    mounting = Mounting(rotation=Rotation.from_euler("X", np.pi / 2.0))  # the sensor's y axis points up
    imu = measured(Circling(4.0, 1.5), PERFECT, mounting=mounting)
    np.testing.assert_allclose(imu.gyro_rad_s[5], [0.0, 1.5, 0.0], atol=1e-6)
    np.testing.assert_allclose(imu.accel_m_s2[5], [0.0, G, -(1.5**2) * 4.0], atol=1e-4)


def test_an_integrating_unit_gives_the_mean_since_the_sample_before() -> None:
    """Mean of the acceleration over an interval is the change of the velocity over its length."""
    amplitude, frequency = 0.01, 20.0
    imu = measured(Bouncing(amplitude, frequency), PERFECT)
    omega = 2.0 * np.pi * frequency
    velocity = amplitude * omega * np.cos(omega * np.concatenate([[-0.005], imu.time_s]))
    mean = np.diff(velocity) / 0.005 + G
    np.testing.assert_allclose(imu.accel_m_s2[:, 2], mean, atol=1e-3 * amplitude * omega**2)


def test_a_low_passed_unit_loses_three_decibels_at_its_bandwidth() -> None:
    filtered = replace(PERFECT, integrates=False, bandwidth_hz=94.0)
    amplitude, omega = 1e-4, 2.0 * np.pi * 94.0
    imu = measured(Bouncing(amplitude, 94.0), filtered)
    swing = np.sqrt(2.0) * imu.accel_m_s2[20:, 2].std()
    # Followed at 800 Hz, 94 Hz lose 3 % in differences and means over a step.
    assert swing == pytest.approx(0.97 * amplitude * omega**2 / np.sqrt(2.0), rel=0.02)


def test_a_low_passed_unit_lags() -> None:
    """A second-order Butterworth filter delays slow signals by √2/(2π·bandwidth)."""
    filtered = replace(PERFECT, integrates=False, bandwidth_hz=20.0)
    amplitude, omega = 0.01, 2.0 * np.pi * 2.0
    imu = measured(Bouncing(amplitude, 2.0), filtered)
    late_s = imu.time_s[40:] - np.sqrt(2.0) / (2.0 * np.pi * 20.0)
    expected = G - amplitude * omega**2 * np.sin(omega * late_s)
    np.testing.assert_allclose(imu.accel_m_s2[40:, 2], expected, atol=0.03 * amplitude * omega**2)


def test_noise_has_the_stated_density_and_no_colour() -> None:
    noisy = replace(
        PERFECT,
        gyro=replace(PERFECT_TRIAD, noise_density=1e-3),
        accel=replace(PERFECT_TRIAD, noise_density=2e-3),
    )
    imu = measured(STILL, noisy, 120.0)
    for values, density in ((imu.gyro_rad_s, 1e-3), (imu.accel_m_s2, 2e-3)):
        frequency, power = welch(values, 200.0, nperseg=512, axis=0)
        inside = (frequency > 2.0) & (frequency < 98.0)
        np.testing.assert_allclose(np.sqrt(power[inside].mean(axis=0)), density, rtol=0.05)
        low, high = (
            np.sqrt(power[part].mean()) for part in (inside & (frequency < 30), inside & (frequency > 70))
        )
        assert high / low == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("quality", [INDUSTRIAL, INDUSTRIAL_OLD])
def test_integrating_classes_have_the_noise_of_their_sheet(quality: ImuClass) -> None:
    imu = measured(STILL, quality, 60.0)
    sigma = imu.gyro_rad_s.std(axis=0)
    np.testing.assert_allclose(sigma, quality.gyro.noise_density * 10.0, rtol=0.08)  # √(½·200 Hz)


def test_bias_wanders_as_the_in_run_stability_says() -> None:
    """Allan deviation (IEEE Std 952) of 1/f noise is flat at 0.664 times the stability."""
    wander = flicker(100_000, 1.0, 3.0, np.random.default_rng(4), columns=6)
    for tau_s in (30, 100, 300):
        means = wander[: 100_000 // tau_s * tau_s].reshape(-1, tau_s, 6).mean(axis=1)
        deviation = np.sqrt(0.5 * np.mean(np.diff(means, axis=0) ** 2))
        assert deviation == pytest.approx(0.664 * 3.0, rel=0.12)


def test_each_constant_error_has_its_stated_size_and_place() -> None:
    """At rest: bias everywhere, scale on the axis that feels gravity, misalignment across it, g in the gyro."""
    biased, _ = units(replace(PERFECT, accel=replace(PERFECT_TRIAD, bias_start=0.03)))
    np.testing.assert_allclose((biased - [0.0, 0.0, G]).std(axis=0), 0.03, rtol=0.15)
    scaled, _ = units(replace(PERFECT, accel=replace(PERFECT_TRIAD, scale=0.01)))
    np.testing.assert_allclose((scaled / G).std(axis=0), [0.0, 0.0, 0.01], rtol=0.15, atol=1e-9)
    skewed, _ = units(replace(PERFECT, accel=replace(PERFECT_TRIAD, misalignment_rad=0.02)))
    np.testing.assert_allclose((skewed / G).std(axis=0), [0.02, 0.02, 0.0], rtol=0.15, atol=1e-9)
    _, pulled = units(replace(PERFECT, g_sensitivity=1e-3))
    np.testing.assert_allclose(pulled.std(axis=0), 1e-3 * G, rtol=0.15)
    exact, still = units(PERFECT, 3)
    np.testing.assert_allclose(exact, np.tile([0.0, 0.0, G], (3, 1)), atol=1e-6)
    np.testing.assert_allclose(still, 0.0, atol=1e-9)


def test_saturation_clips_each_axis_at_its_own_constant_limit() -> None:
    clipping = replace(PERFECT, gyro=replace(PERFECT_TRIAD, limit=2.0, limit_spread=0.03))
    spinning = Circling(0.0, 5.0)
    limits = []
    for roll in (0.0, np.pi / 2.0, -np.pi / 2.0):
        imu = measured(spinning, clipping, mounting=Mounting(rotation=Rotation.from_euler("X", roll)))
        axis = int(np.argmax(np.abs(imu.gyro_rad_s[0])))
        assert np.ptp(imu.gyro_rad_s[:, axis]) == 0.0
        limits.append(abs(imu.gyro_rad_s[0, axis]))
    np.testing.assert_allclose(limits, 2.0, rtol=0.12)
    assert limits[0] != limits[1]  # z and y axis
    assert limits[1] == limits[2]  # the y axis both ways


def test_readings_are_whole_steps_of_the_resolution() -> None:
    coarse = replace(PERFECT, accel=replace(PERFECT_TRIAD, resolution=0.5, noise_density=0.1))
    values = measured(STILL, coarse).accel_m_s2 / 0.5
    np.testing.assert_allclose(values, np.round(values), atol=1e-9)
    assert len(np.unique(values[:, 0])) > 2


def test_stamps_wobble_and_come_late_but_never_go_back() -> None:
    wobbling = replace(PERFECT, stamp_jitter_s=1e-4)
    stamps = measured(STILL, wobbling, 60.0).time_s
    assert (stamps - np.arange(len(stamps)) / 200.0).std() == pytest.approx(1e-4, rel=0.05)
    late = measured(STILL, replace(PERFECT, late_share=0.05, late_s=1e-3), 60.0).time_s
    lateness = late - np.arange(len(late)) / 200.0
    assert lateness.min() > -1e-9
    assert np.mean(lateness > 1e-3) == pytest.approx(0.05 * np.exp(-1.0), rel=0.2)
    held_up = measured(STILL, replace(PERFECT, late_share=0.05, late_s=20e-3), 60.0).time_s
    assert (np.diff(held_up) > 0.0).all()


def test_wobbling_instants_change_what_is_measured_and_not_the_stamps() -> None:
    wobbling = replace(PERFECT, integrates=False, bandwidth_hz=300.0, sample_jitter_s=5e-4)
    motion = Bouncing(0.01, 5.0)
    imu, exact = measured(motion, wobbling), measured(motion, replace(wobbling, sample_jitter_s=0.0))
    np.testing.assert_array_equal(imu.time_s, exact.time_s)
    jerk = 0.01 * (2.0 * np.pi * 5.0) ** 3
    error = (imu.accel_m_s2 - exact.accel_m_s2)[20:, 2]
    assert error.std() == pytest.approx(5e-4 * jerk / np.sqrt(2.0), rel=0.15)


def test_a_wrong_clock_takes_more_or_fewer_samples() -> None:
    counts = {
        len(measured(STILL, replace(PERFECT, clock_ppm=2e4), 10.0, seed=seed).time_s) for seed in range(6)
    }
    assert min(counts) < 2000 < max(counts)


def test_losses_come_in_runs() -> None:
    lossy = replace(PERFECT, loss_share=0.02, loss_run=4.0)
    stamps = measured(STILL, lossy, 300.0).time_s
    gaps = np.round(np.diff(stamps) * 200.0) - 1.0
    assert gaps.sum() / 60_000 == pytest.approx(0.02, rel=0.25)
    assert gaps[gaps > 0].mean() == pytest.approx(4.0, rel=0.25)


def test_the_integrated_rates_are_the_turn_that_was_made() -> None:
    imu = measured(Circling(2.0, 0.7), PERFECT, 10.0)
    assert imu.gyro_rad_s[1:, 2].sum() * 0.005 == pytest.approx(
        0.7 * (imu.time_s[-1] - imu.time_s[0]), abs=1e-6
    )


def test_tumbling_about_all_axes_agrees_with_rotation_vectors() -> None:
    class Tumbling:
        def at(self, time_s: np.ndarray) -> tuple[np.ndarray, Rotation]:
            angles = np.column_stack([3.0 * time_s, np.sin(4.0 * time_s), np.cos(5.0 * time_s)])
            return np.zeros((len(time_s), 3)), Rotation.from_euler("ZYX", angles)

    instant = replace(PERFECT, integrates=False, bandwidth_hz=399.0)
    imu = measured(Tumbling(), instant, 3.0)
    step = 1e-4
    behind, ahead = (Tumbling().at(imu.time_s + side)[1] for side in (-step, step))
    rate = (behind.inv() * ahead).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(imu.gyro_rad_s[10:], rate[10:], atol=0.05)


def test_the_same_seed_gives_the_same_unit_and_another_does_not() -> None:
    one, same, other = (measured(STILL, CONSUMER, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.accel_m_s2, same.accel_m_s2)
    np.testing.assert_array_equal(one.time_s, same.time_s)
    assert not np.array_equal(one.accel_m_s2[:300], other.accel_m_s2[:300])


def test_the_field_is_read_where_and_as_the_unit_lies_at_that_instant() -> None:
    """From facing north 2 rad/s to the left: north is ahead by the cosine, and to the right by the sine."""
    device = DeviceIron()
    surroundings = Magnetics(EarthField(0.0, 20.0, -40.0), device=device)
    exact = replace(PERFECT, magnetometer=MagnetometerQuality(0.0, 0.0, 0.0, 1e-9, 1000.0))
    mounting = Mounting(
        rotation=Rotation.from_euler("X", np.pi)
    )  # lying on its back: left is right, up is down
    imu = measure_imu(Circling(3.0, 2.0), 2.0, mounting, exact, surroundings, np.random.default_rng(1))
    turn = 2.0 * imu.time_s
    expected = np.column_stack([20.0 * np.cos(turn), 20.0 * np.sin(turn), np.full(len(turn), 40.0)])
    assert imu.mag_ut is not None
    np.testing.assert_allclose(imu.mag_ut, expected, atol=1e-6)


def test_classes_are_found_by_name_and_unknown_ones_are_told() -> None:
    assert set(IMU_CLASSES) >= {"tactical", "industrial", "consumer"}
    assert imu_class("consumer") is CONSUMER
    with pytest.raises(ConfigError, match=r"unknown quality class 'golden' .*tactical"):
        imu_class("golden")


def test_ten_minutes_take_less_than_a_second_and_a_half() -> None:
    def thirds_of_ten_minutes_s() -> float:
        start = time.process_time()
        measured(Circling(5.0, 0.3), INDUSTRIAL, 200.0)
        return time.process_time() - start

    assert 3.0 * min(thirds_of_ten_minutes_s() for _ in range(4)) < 1.5
