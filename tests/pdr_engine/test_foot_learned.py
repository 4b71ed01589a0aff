"""The learned detector: its features against plain NumPy, its network against the formula, and what it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pdr_engine.foot import FootSettings, weights
from pdr_engine.foot.features import MEMORY
from pdr_engine.foot.learned import SWING_M_S, sole_motion, tabulate
from pdr_engine.foot.memory import FEATURES, SAMPLE, fresh_state
from pdr_engine.foot.parameters import parameters
from support.foot_streams import Stream, navigate, still, turning, walk

INTERVAL_S = 0.005
AHEAD = 9  # samples in 41 ms
BIAS = np.array([0.01, -0.02, 0.03])


def table(stream: Stream, bias: np.ndarray = BIAS) -> np.ndarray:
    """Features of all samples, as the kernel makes them."""
    batch = np.zeros(len(stream.time_ns), SAMPLE)
    batch["time_ns"], batch["accel"], batch["gyro"] = stream.time_ns, stream.accel, stream.gyro
    rows = np.zeros((len(batch), FEATURES))
    foot = FootSettings()
    tabulate(fresh_state(foot), parameters(foot), batch, bias, AHEAD, rows)
    return rows


class Window:
    """Samples within ``half_s`` of ``centre_s`` after sample ``at``, as the text defines them."""

    def __init__(self, stream: Stream, at: int, centre_s: float, half_s: float) -> None:
        middle = at + np.floor(centre_s / INTERVAL_S + 0.5).astype(int)
        half = np.floor(half_s / INTERVAL_S + 0.5).astype(int)
        force = stream.accel[middle - half : middle + half + 1]
        rate = stream.gyro[middle - half : middle + half + 1] - BIAS
        self.force, self.rate = force.mean(axis=0), rate.mean(axis=0)
        self.length = np.linalg.norm(self.force)
        away = force - 9.81 * self.force / self.length  # SHOE: what gravity along the mean does not explain
        self.energies = [
            np.log((away**2).sum(axis=1).mean() + 3e-3),
            np.log((rate**2).sum(axis=1).mean() + 1e-4),
        ]

    @property
    def load(self) -> float:
        excess = (self.length - 9.81) / 3.0
        return excess / np.sqrt(1.0 + excess**2)


def unturned(a: Window, b: Window, rate: np.ndarray, span_s: float) -> float:
    """A force fixed in space turns by −ω×f in the sensor's axes."""
    left = b.force - a.force + np.cross(rate, 0.5 * (a.force + b.force)) * span_s
    return float(np.log(left @ left + 1e-3))


def by_hand(stream: Stream, at: int) -> np.ndarray:
    now, before, after = (Window(stream, at, centre, 0.01) for centre in (0.0, -0.03, 0.03))
    near, past = Window(stream, at, 0.0, 0.04), Window(stream, at, -0.15, 0.10)
    wide = [Window(stream, at, *window) for window in ((-0.5, 0.5), (-0.08, 0.02), (-0.35, 0.05))]
    energies = np.concatenate([w.energies for w in (now, before, after, near, past, *wide)])
    turns = unturned(before, after, near.rate, 0.06), unturned(past, near, past.rate, 0.15)
    return np.array([*energies, now.load, near.load, *turns])


def test_features_are_what_the_text_says() -> None:
    stream = walk(4)
    rows = table(stream)
    for at in range(250, len(stream.time_ns) - 20, 37):
        np.testing.assert_allclose(rows[at], by_hand(stream, at), rtol=1e-6, atol=1e-6)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_features_do_not_know_the_mounting(seed: int) -> None:
    mounting = Rotation.random(rng=np.random.default_rng(seed))
    stream = walk(2)
    turned = table(stream.mounted(mounting), mounting.apply(BIAS))
    np.testing.assert_allclose(turned, table(stream), rtol=1e-6, atol=1e-6)


def test_the_network_is_one_hidden_layer() -> None:
    state = fresh_state(FootSettings())[0]
    for features in np.random.default_rng(1).normal(-2.0, 2.0, (20, FEATURES)):
        state["features"] = features
        hidden = weights.INPUT @ features + weights.HIDDEN_BIAS
        bounded = hidden / (1.0 + np.abs(hidden))
        sigma = np.exp(np.clip(weights.BIAS + weights.OUTPUT @ bounded, -6.0, 2.0))
        mean = sigma * (weights.MOTION_BIAS + weights.MOTION @ bounded)
        assert sole_motion(state) == pytest.approx((sigma, *mean), rel=1e-9, abs=1e-12)


def sigma_of(stream: Stream) -> np.ndarray:
    """σ of every sample, from the features."""
    state = fresh_state(FootSettings())[0]
    out = []
    for features in table(stream, np.zeros(3)):
        state["features"] = features
        out.append(sole_motion(state)[0])
    return np.array(out)


def test_rest_is_centimetres_a_second_and_a_turn_is_not() -> None:
    rest, turn = sigma_of(still(2.0))[250:-20], sigma_of(turning(2.0, 1.5))[250:-20]
    assert rest.max() < 0.03
    assert turn.min() > 5.0 * rest.max()
    assert FootSettings().detector.learned_sigma_m_s < SWING_M_S


def test_the_interval_follows_the_stream() -> None:
    """At half the rate the same windows hold half the samples."""
    slow = still(3.0, rate_hz=100.0)
    state, foot = fresh_state(FootSettings()), FootSettings()
    batch = np.zeros(len(slow.time_ns), SAMPLE)
    batch["time_ns"], batch["accel"], batch["gyro"] = slow.time_ns, slow.accel, slow.gyro
    tabulate(state, parameters(foot), batch, BIAS, AHEAD, np.zeros((len(batch), FEATURES)))
    assert state["interval_s"][0] == pytest.approx(0.01, rel=1e-6)
    assert 0.0 < MEMORY < 0.1


def test_what_ends_sooner_than_a_stride_is_no_step() -> None:
    """Half a stride's stances do not become steps of their own."""
    steps = navigate(walk(6)).steps
    assert all(step.time_ns - step.start_time_ns >= 350_000_000 for step in steps[:-1])
