"""Training of the learned stance detector: its gradients, what it learns, and the module it writes."""

from dataclasses import replace

import numpy as np
from scipy.optimize import approx_fprime
from scipy.spatial.transform import Rotation

from pdr_engine.foot.memory import FEATURES, HIDDEN
from proving_ground.evaluation.foot.stance_examples import Examples, marker_offset
from proving_ground.evaluation.foot.train_stance import (
    Network,
    fit_motion,
    loss,
    motion_loss,
    source_of,
    train,
)

SIZE = HIDDEN * (FEATURES + 2) + 1


def examples(count: int, seed: int = 1) -> Examples:
    """Feet that are slow where the first feature is low and fast where it is high; the slow ones sink by 2 σ."""
    rng = np.random.default_rng(seed)
    features = rng.normal(3.0, 2.0, (count, FEATURES))
    sigma = np.where(features[:, 0] > 3.0, 1.0, 0.05)
    velocity = sigma[:, None] * rng.normal(size=(count, 3))
    velocity[:, 2] -= np.where(features[:, 0] > 3.0, 0.0, 2.0 * sigma)
    return Examples(features, velocity, np.ones(count), rng.uniform(0.5, 1.5, count))


def test_the_gradient_is_that_of_the_loss() -> None:
    vector = 0.3 * np.random.default_rng(2).normal(size=SIZE)
    table = examples(50)
    numeric = approx_fprime(vector, lambda v: loss(v, table)[0], 1e-7)
    np.testing.assert_allclose(loss(vector, table)[1], numeric, atol=2e-5)


def test_the_gradient_of_the_motion_is_that_of_its_loss() -> None:
    rng = np.random.default_rng(5)
    net = Network.unpacked(0.3 * rng.normal(size=SIZE))
    table = replace(examples(50), way=rng.uniform(0.0, 1.0, 50))
    vector = rng.normal(size=2 * (HIDDEN + 1))
    numeric = approx_fprime(vector, lambda v: motion_loss(v, net, table)[0], 1e-7)
    np.testing.assert_allclose(motion_loss(vector, net, table)[1], numeric, atol=2e-5)


def test_it_learns_who_is_slow_and_how_slow_and_who_sinks() -> None:
    table = examples(4000)
    net = fit_motion(train(table), table)
    fresh = examples(1000, seed=9)
    found, hidden = net.sigma(fresh.features), net.hidden(fresh.features)
    sinking = found * (hidden @ net.motion[1] + net.motion_bias[1])
    along = found * (hidden @ net.motion[0] + net.motion_bias[0])
    slow = fresh.features[:, 0] < 2.5
    fast = fresh.features[:, 0] > 3.5
    # σ is that of the whole velocity: √(3 + 2²)/√3 = 1.5 times 0.05; Student's t has about 0.8 of the normal scale.
    assert 0.045 < np.median(found[slow]) < 0.09
    assert 0.6 < np.median(found[fast]) < 1.2
    assert -0.12 < np.median(sinking[slow]) < -0.08
    assert abs(np.median(along[slow])) < 0.01
    assert abs(np.median(sinking[fast])) < 0.15


def test_a_foot_without_a_way_teaches_no_motion_along_it() -> None:
    """Without a way there is no direction; that a resting foot does not rise is worth learning."""
    rng = np.random.default_rng(6)
    net, table = Network.unpacked(0.3 * rng.normal(size=SIZE)), replace(examples(50), way=np.zeros(50))
    gradient = motion_loss(np.zeros(2 * (HIDDEN + 1)), net, table)[1].reshape(2, HIDDEN + 1)
    assert not gradient[0].any()
    assert gradient[1].any()


def test_a_network_of_raw_features_equals_that_of_normal_ones() -> None:
    rng = np.random.default_rng(3)
    net = Network.unpacked(rng.normal(size=SIZE))
    mean, scale = rng.normal(size=FEATURES), rng.uniform(0.5, 2.0, FEATURES)
    raw = rng.normal(size=(20, FEATURES))
    np.testing.assert_allclose(net.behind(mean, scale).sigma(raw), net.sigma((raw - mean) / scale))


def test_the_module_it_writes_holds_the_weights() -> None:
    rng = np.random.default_rng(4)
    net = replace(
        Network.unpacked(rng.normal(size=SIZE)),
        motion=rng.normal(size=(2, HIDDEN)),
        motion_bias=rng.normal(size=2),
    )
    written: dict[str, object] = {}
    exec(source_of(net), written)
    names = ("inputs", "hidden_bias", "output", "motion", "motion_bias", "bias")
    for name in names:
        wanted = "INPUT" if name == "inputs" else name.upper()
        np.testing.assert_allclose(np.asarray(written[wanted]), getattr(net, name), rtol=1e-5)


def test_the_marker_beside_the_sensor_is_found_under_drift_and_glitches() -> None:
    rng = np.random.default_rng(7)
    time_s = np.arange(0.0, 20.0, 0.005)
    phases = np.array([0.0, 1.0, 2.0]) * np.pi / 3.0
    swing = np.array([0.4, 0.8, 0.3]) * np.sin(2.0 * np.pi * time_s[:, None] + phases)
    rotation = Rotation.from_rotvec(swing).as_matrix()
    offset = np.array([0.03, -0.05, 0.08])
    apart = rotation @ offset + 0.01 * time_s[:, None] + 0.001 * rng.normal(size=(len(time_s), 3))
    apart[1000:1010] += 1.0
    np.testing.assert_allclose(marker_offset(apart, rotation, 30), offset, atol=0.002)
