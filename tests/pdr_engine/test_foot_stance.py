"""Stance detectors on constructed signals whose statistics are known by hand."""

import numpy as np
import pytest

from pdr_engine.foot import METHODS, FootNavigator, FootSettings
from support.foot_streams import Stream, still, turning

GRAVITY = 9.81


def stance_of(method: str, *parts: Stream) -> tuple[np.ndarray, np.ndarray]:
    """Times in seconds since the start, and which of them are stance."""
    stream = Stream.joined(*parts)
    navigator = FootNavigator(FootSettings(method=method))
    outputs = [navigator.process(stream.time_ns, stream.accel, stream.gyro), navigator.finish()]
    time_ns = np.concatenate([output.time_ns for output in outputs])
    return (time_ns - stream.time_ns[0]) * 1e-9, np.concatenate([output.stance for output in outputs])


def shaken(duration_s: float, rate_hz: float = 200.0) -> Stream:
    """Swing-like: 5 rad/s about y, and a force that swings by 20 m/s² sixteen times a second."""
    stream = turning(duration_s, 5.0, axis=1, rate_hz=rate_hz)
    seconds = np.arange(len(stream.time_ns)) / rate_hz
    stream.accel[:, 0] += 20.0 * np.sin(2 * np.pi * 16.0 * seconds)
    return stream


@pytest.mark.parametrize("rate_hz", [60.0, 100.0, 200.0, 400.0])
@pytest.mark.parametrize("method", METHODS)
def test_every_method_tells_rest_from_swing_at_any_rate(method: str, rate_hz: float) -> None:
    time_s, stance = stance_of(
        method, still(1.0, rate_hz=rate_hz), shaken(0.4, rate_hz), still(1.0, rate_hz=rate_hz)
    )
    margin = 0.08  # the longest window and one sample of 60 Hz
    assert stance[(time_s > 0.1) & (time_s < 1.0 - margin)].all()
    assert not stance[(time_s > 1.0 + margin) & (time_s < 1.4 - margin)].any()
    assert stance[time_s > 1.4 + margin].all()


@pytest.mark.parametrize(("rate_rad_s", "expected"), [(0.28, True), (0.32, False)])
def test_the_gyro_method_has_its_threshold_at_0_3_rad_s(rate_rad_s: float, expected: bool) -> None:
    time_s, stance = stance_of("gyro", still(1.0), turning(1.0, rate_rad_s))
    assert stance[time_s > 1.1].all() == stance[time_s > 1.1].any() == expected


@pytest.mark.parametrize(("factor", "expected"), [(0.95, True), (1.05, False)])
def test_the_fixed_threshold_of_shoe(factor: float, expected: bool) -> None:
    rate = factor * np.sqrt(8.5e7) * 8.7e-5  # its statistic is (ω/σ)² while the force is gravity
    time_s, stance = stance_of("shoe", still(1.0), turning(1.0, rate))
    assert stance[time_s > 1.1].all() == stance[time_s > 1.1].any() == expected


@pytest.mark.parametrize(("factor", "expected"), [(0.9, True), (1.1, False)])
def test_the_differential_sums_the_force_s_changes(factor: float, expected: bool) -> None:
    moving = still(1.0, noise=0.0)
    change = factor * 1.5 / 9  # ten samples in 50 ms at 200 Hz: nine changes
    moving.accel[1::2, 0] += change
    time_s, stance = stance_of("differential", still(1.0, noise=0.0), moving)
    assert stance[(time_s > 1.1)].all() == stance[time_s > 1.1].any() == expected


def test_the_adaptive_threshold_waits_and_then_grows() -> None:
    """1e7·exp(3·(t − 0.5)) passes the statistic 5e7 of a steady turn at t = 0.5 + ln(5)/3 = 1.036 s."""
    rate = np.sqrt(5e7) * 8.7e-5
    time_s, stance = stance_of("adaptive", still(1.0, noise=0.0), turning(2.0, rate, noise=0.0))
    begins = time_s[(time_s > 1.1) & stance][0]
    assert begins == pytest.approx(1.0 + 1.036, abs=0.04)
