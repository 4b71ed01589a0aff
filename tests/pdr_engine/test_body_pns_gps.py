"""The PNS/GPS filter: what fixes teach it, and which fixes it believes."""

import math

import numpy as np
import pytest

from pdr_engine.body.track.pns_gps import PnsGps, PnsGpsSettings

STEP_S, STEP_M = 0.5, 0.7
WAY = [0.3] * 300 + [1.8] * 300


def walk(
    pns: PnsGps, azimuths: list[float], scale: float, off_rad: float, fixes: bool, seed: int = 0
) -> np.ndarray:
    """Steps that are misjudged by a scale and an angle, with honest fixes each other step; the true place."""
    rng = np.random.default_rng(seed)
    true = np.zeros(2)
    for number, azimuth in enumerate(azimuths):
        true = true + STEP_M * np.array([math.sin(azimuth), math.cos(azimuth)])
        pns.step(STEP_M * scale, azimuth + off_rad, STEP_S)
        if fixes and number % 2:
            pns.fix(true + rng.normal(0.0, 1.0, 2), 1.5, 9)
    return true


def test_fixes_teach_scale_and_angle_and_these_last() -> None:
    """Steps 8 % too long, azimuth 6° too far right; without correction 210 m end 27 m off."""
    pns = PnsGps(np.zeros(2), 1.0)
    true = walk(pns, WAY, 1.08, math.radians(6.0), fixes=True)
    assert pns.length_factor == pytest.approx(1.0 / 1.08, abs=0.015)
    assert math.degrees(pns.azimuth_error_rad) == pytest.approx(-6.0, abs=1.0)
    for azimuth in [0.9] * 300:
        true = true + STEP_M * np.array([math.sin(azimuth), math.cos(azimuth)])
        pns.step(STEP_M * 1.08, azimuth + math.radians(6.0), STEP_S)
    assert np.hypot(*(pns.place_m - true)) < 6.0


def test_the_transition_is_the_derivative_of_the_step() -> None:
    """Against finite differences: a step's place by azimuth and by the share of the length."""
    azimuth, length = 0.7, 0.8
    pns = PnsGps(np.zeros(2), 1.0)
    along = np.array([math.sin(azimuth), math.cos(azimuth)])
    transition = pns._transition(length, along, STEP_S)
    small = 1e-6
    turned = length * np.array([math.sin(azimuth + small), math.cos(azimuth + small)])
    np.testing.assert_allclose(transition[:2, 4], (turned - length * along) / small, atol=1e-5)
    np.testing.assert_allclose(transition[:2, 5], length * along, atol=1e-12)


@pytest.mark.parametrize(("accuracy_m", "satellites"), [(40.0, 9), (3.0, 3)])
def test_poor_fixes_are_not_used(accuracy_m: float, satellites: int) -> None:
    pns = PnsGps(np.zeros(2), 1.0)
    assert not pns.fix(np.array([5.0, 5.0]), accuracy_m, satellites)
    assert np.array_equal(pns.place_m, np.zeros(2))


def test_a_fix_out_of_reach_is_refused_until_many_say_so() -> None:
    pns = PnsGps(np.zeros(2), 1.0, PnsGpsSettings(most_refused=5))
    far = np.array([200.0, 0.0])
    assert [pns.fix(far, 2.0, 9) for _ in range(5)] == [False] * 4 + [True]
    assert pns.refused == 5
    assert pns.place_m[0] > 150.0


def test_the_covariance_is_honest() -> None:
    """Errors of 40 walks after 200 m without GPS, over their sigma."""
    settings, scores = PnsGpsSettings(), []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        pns = PnsGps(np.zeros(2), 1.0)
        true = rng.normal(0.0, 1.0, 2)
        off, scale = rng.normal(0.0, settings.azimuth_rad), 1.0 + rng.normal(0.0, settings.length_share)
        for _ in range(300):
            true = true + STEP_M * np.array([0.0, 1.0])
            pns.step(STEP_M * scale, off, STEP_S)
        error = pns.place_m - true
        scores.append(float(error @ np.linalg.solve(pns.covariance_m2, error)) / 2.0)
    assert 0.5 < float(np.mean(scores)) < 1.4
