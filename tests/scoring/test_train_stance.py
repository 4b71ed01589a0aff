"""Training of the learned stance detector: its gradient, what it learns, and the module it writes."""

import numpy as np
from scipy.optimize import approx_fprime

from pdr_engine.foot.memory import FEATURES, HIDDEN
from proving_ground.evaluation.train_stance import Examples, Network, loss, source_of, train

SIZE = HIDDEN * (FEATURES + 2) + 1


def examples(count: int, seed: int = 1) -> Examples:
    """Feet that are slow where the first feature is low, and fast where it is high."""
    rng = np.random.default_rng(seed)
    features = rng.normal(3.0, 2.0, (count, FEATURES))
    sigma = np.where(features[:, 0] > 3.0, 1.0, 0.05)
    speed = sigma * np.linalg.norm(rng.normal(size=(count, 3)), axis=1)
    return Examples(features, speed, rng.uniform(0.5, 1.5, count))


def log_sigma(net: Network, features: np.ndarray) -> np.ndarray:
    u = features @ net.inputs.T + net.hidden_bias
    return (u / (1.0 + np.abs(u))) @ net.output + net.bias


def test_the_gradient_is_that_of_the_loss() -> None:
    vector = 0.3 * np.random.default_rng(2).normal(size=SIZE)
    table = examples(50)
    numeric = approx_fprime(vector, lambda v: loss(v, table)[0], 1e-7)
    np.testing.assert_allclose(loss(vector, table)[1], numeric, atol=2e-5)


def test_it_learns_who_is_slow_and_how_slow() -> None:
    net = train(examples(4000))
    fresh = examples(1000, seed=9)
    found = np.exp(log_sigma(net, fresh.features))
    slow = fresh.features[:, 0] < 2.5
    fast = fresh.features[:, 0] > 3.5
    # Student's t with 3 degrees has a smaller scale than the normal law of the same speeds: about 0.8 of it.
    assert 0.03 < np.median(found[slow]) < 0.06
    assert 0.6 < np.median(found[fast]) < 1.2


def test_a_network_of_raw_features_equals_that_of_normal_ones() -> None:
    rng = np.random.default_rng(3)
    net = Network.unpacked(rng.normal(size=SIZE))
    mean, scale = rng.normal(size=FEATURES), rng.uniform(0.5, 2.0, FEATURES)
    raw = rng.normal(size=(20, FEATURES))
    np.testing.assert_allclose(log_sigma(net.behind(mean, scale), raw), log_sigma(net, (raw - mean) / scale))


def test_the_module_it_writes_holds_the_weights() -> None:
    net = Network.unpacked(np.random.default_rng(4).normal(size=SIZE))
    written: dict[str, object] = {}
    exec(source_of(net), written)
    for name, values in (("INPUT", net.inputs), ("HIDDEN_BIAS", net.hidden_bias), ("OUTPUT", net.output)):
        np.testing.assert_allclose(np.asarray(written[name]), values, rtol=1e-5)
