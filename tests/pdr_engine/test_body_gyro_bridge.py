"""Bridging by gyro: the source's formulas by hand, and what they promise by Monte Carlo."""

import math

import numpy as np
import pytest

from pdr_engine.body.azimuth.bridges import (
    BRIDGES,
    BridgeSettings,
    ExponentialBridge,
    KalmanBridge,
    PlainBridge,
)

DEG = math.radians(1.0)
STEP_S, SAMPLES = 0.5, 50


def carry(bridge: PlainBridge | KalmanBridge, seconds: float, bias_rad_s: float) -> None:
    """Straight on, with a gyro of this bias."""
    for _ in range(round(seconds / STEP_S)):
        bridge.advance(bias_rad_s * STEP_S, STEP_S, SAMPLES)


def test_the_plain_update_is_the_source_s() -> None:
    """40 s straight ahead, gyro 4° ahead of the compass: Δb = 0.1 °/s; σ_b² = 2·3²/40² + 0.15²/4000 (°/s)²."""
    bridge = PlainBridge(1.0, 3.0 * DEG, BridgeSettings(gyro_noise_rad_s=0.15 * DEG))
    carry(bridge, 40.0, 0.1 * DEG)
    assert bridge.azimuth_rad == pytest.approx(1.0 + 4.0 * DEG)
    bridge.compass(1.0, 3.0 * DEG)
    assert bridge.bias_rad_s == pytest.approx(0.1 * DEG)
    assert bridge.azimuth_rad == pytest.approx(1.0)
    assert bridge.bias_variance == pytest.approx((2 * 9.0 / 1600.0 + 0.0225 / 4000.0) * DEG**2)
    # m = 1000 samples of 0.01 s later: 3² + 1000·0.01²·0.15² + 1000²·0.01²·σ_b²
    carry(bridge, 10.0, 0.1 * DEG)
    sigma_b2 = 2 * 9.0 / 1600.0 + 0.0225 / 4000.0
    assert bridge.sigma_rad == pytest.approx(math.sqrt(9.0 + 0.1 * 0.0225 + 100.0 * sigma_b2) * DEG)
    assert bridge.azimuth_rad == pytest.approx(1.0)  # the bias is taken off now


def test_the_exponential_update_counts_by_its_share() -> None:
    settings = BridgeSettings(gyro_noise_rad_s=0.15 * DEG, bias_sigma_rad_s=0.2 * DEG, alpha=0.25)
    bridge = ExponentialBridge(0.0, 3.0 * DEG, settings)
    carry(bridge, 40.0, 0.1 * DEG)
    bridge.compass(0.0, 3.0 * DEG)
    assert bridge.bias_rad_s == pytest.approx(0.025 * DEG)
    assert bridge.azimuth_rad == pytest.approx(3.0 * DEG)
    new = 2 * 9.0 / 1600.0 + 0.0225 / 4000.0
    assert bridge.bias_variance == pytest.approx((0.75**2 * 0.04 + 0.25**2 * new) * DEG**2)


def test_an_update_at_once_after_another_is_left_out() -> None:
    bridge = PlainBridge(0.0, 3.0 * DEG)
    carry(bridge, 2.0, 0.0)
    bridge.compass(1.0, 3.0 * DEG)
    assert bridge.azimuth_rad == 0.0


def test_azimuths_meet_across_north() -> None:
    for kind in BRIDGES.values():
        bridge = kind(math.pi - 0.02, 3.0 * DEG)
        carry(bridge, 40.0, 0.0)
        bridge.compass(-math.pi + 0.02, 3.0 * DEG)
        assert abs(math.remainder(bridge.azimuth_rad - math.pi, math.tau)) < 0.03
        assert abs(bridge.bias_rad_s) < 0.1 * DEG


@pytest.mark.parametrize("name", ["kalman", "exponential", "plain"])
def test_a_turn_unseen_is_doubt(name: str) -> None:
    bridge = BRIDGES[name](0.0, 3.0 * DEG)
    carry(bridge, 20.0, 0.0)
    before = bridge.sigma_rad
    bridge.lose(1.0)
    assert bridge.sigma_rad == pytest.approx(math.hypot(before, 1.0))


def test_ten_clean_minutes_carry_two_blind_ones() -> None:
    """Kalman: a bias of 0.5 °/s, compass errors of 3° that last for some 10 s."""
    rng = np.random.default_rng(1)
    bridge = KalmanBridge(0.0, 10.0 * DEG)
    bend = 0.0
    for _ in range(1200):
        bridge.advance(0.5 * DEG * STEP_S + rng.normal(0.0, 0.02 * DEG), STEP_S, SAMPLES)
        bend = 0.95 * bend + rng.normal(0.0, 3.0 * math.sqrt(1.0 - 0.95**2) * DEG)
        bridge.compass(bend, 10.0 * DEG)
    assert bridge.bias_rad_s == pytest.approx(0.5 * DEG, abs=0.03 * DEG)
    carry(bridge, 120.0, 0.5 * DEG)
    assert abs(bridge.azimuth_rad) < 4.0 * DEG
    assert bridge.since_s == pytest.approx(120.0)


def test_the_kalman_sigma_is_honest() -> None:
    """Errors over their sigma after a bridge of 60 s, 60 walks whose biases wander as the filter believes."""
    settings, scores = BridgeSettings(), []
    keep = math.exp(-settings.decay)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        mean = rng.normal(0.0, settings.bias_sigma_rad_s)
        wander, truth_bias = rng.normal(0.0, math.sqrt(settings.drive_rad2_s2 / (2.0 * settings.decay))), 0.0
        bridge = KalmanBridge(rng.normal(0.0, 5.0 * DEG), 5.0 * DEG)
        for step in range(360):
            truth_bias = mean + wander
            white = settings.gyro_noise_rad_s * STEP_S / math.sqrt(SAMPLES)
            bridge.advance(truth_bias * STEP_S + rng.normal(0.0, white), STEP_S, SAMPLES)
            wander = keep * wander + rng.normal(0.0, math.sqrt(settings.drive_rad2_s2))
            if step < 240:
                bridge.compass(rng.normal(0.0, 5.0 * DEG), 5.0 * DEG)
        scores.append(bridge.azimuth_rad / bridge.sigma_rad)
    assert 0.75 < float(np.std(scores)) < 1.25
