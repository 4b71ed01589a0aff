"""The compiled filter against the NumPy oracle, and the oracle's Jacobians against finite differences."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pdr_engine.foot import kernel
from pdr_engine.foot.memory import fresh_state
from pdr_engine.foot.parameters import parameters
from pdr_engine.foot.settings import AlignmentSettings, FilterSettings, FootSettings
from support.foot_oracle import Noise, Oracle

quick = settings(max_examples=30, deadline=None)
seeds = st.integers(0, 2**32 - 1)


def random_oracle(rng: np.random.Generator) -> Oracle:
    root = rng.normal(size=(12, 12)) * 0.05
    return Oracle(
        attitude=Rotation.from_quat(rng.normal(size=4)),
        position=rng.normal(size=3),
        velocity=rng.normal(size=3) * 0.1,
        lever=rng.normal(size=3) * 0.1,
        step_position=rng.normal(size=3),
        P=root @ root.T,
    )


def record_of(oracle: Oracle, foot: FootSettings) -> np.record:
    state = fresh_state(foot)[0]
    x, y, z, w = oracle.attitude.as_quat()
    state["attitude"] = [w, x, y, z]
    for name in ("position", "velocity", "lever", "step_position", "P"):
        state[name] = getattr(oracle, name)
    state["gravity"], state["bias_variance"] = oracle.gravity, oracle.noise.bias_sigma**2
    return state


@pytest.mark.parametrize("lever_sigma", [0.0, 0.1], ids=["9 states", "12 states"])
def test_the_kernel_computes_what_the_oracle_computes(lever_sigma: float) -> None:
    rng = np.random.default_rng(7)
    foot = FootSettings(
        filter=FilterSettings(lever_sigma_m=lever_sigma),
        alignment=AlignmentSettings(bias_walk_rad_s_sqrt_s=0.0),
    )
    oracle = random_oracle(rng)
    oracle.noise = Noise(bias_sigma=0.002)
    if lever_sigma == 0.0:
        oracle.lever[:] = oracle.P[9:] = oracle.P[:, 9:] = 0.0
    state, p = record_of(oracle, foot), parameters(foot)[0]
    bias = np.array([0.01, -0.02, 0.005])
    state["bias"] = bias
    n = 400
    accel, gyro = rng.normal(size=(n, 3)) * 8.0 + [0.0, 0.0, 9.8], rng.normal(size=(n, 3)) * 3.0
    clipped, steps = rng.random((n, 3)) < 0.05, rng.uniform(0.001, 0.02, n)
    sigma, motion = rng.uniform(0.0, 0.2, n), rng.normal(0.0, 0.1, (n, 2))
    state["sigma"][:n], state["motion"][:n] = sigma, motion
    state["accel"][:n], state["gyro"][:n], state["clipped"][:n] = accel, gyro, clipped
    for k in range(1, n):
        kernel.mechanise(state, k, steps[k])
        kernel.propagate(state, p, k, steps[k], False)
        oracle.predict(accel[k], gyro[k] - bias, steps[k], clipped[k], accel[k - 1])
        if k % 50 > 30:
            kernel.creep(state, p, k, steps[k])
            kernel.zero_velocity(state, p, k, steps[k])
            oracle.creep(sigma[k], steps[k])
            oracle.zero_velocity(gyro[k] - bias, steps[k], sigma[k], tuple(motion[k]))
        if k % 50 == 49:
            kernel.forget_place(state)
            oracle.forget_place()
        for name in ("position", "velocity", "lever", "P"):
            np.testing.assert_allclose(state[name], getattr(oracle, name), rtol=1e-9, atol=1e-9)
        w, x, y, z = state["attitude"]
        turn = Rotation.from_quat([x, y, z, w]) * oracle.attitude.inv()
        assert turn.magnitude() < 1e-9
    assert np.any(state["lever"] != 0.0) == (lever_sigma > 0.0)


@quick
@given(seeds)
def test_the_transition_is_the_derivative_of_the_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    oracle, accel, rate = random_oracle(rng), rng.normal(size=3) * 20.0, rng.normal(size=3) * 5.0
    dt, step = 0.01, 1e-6
    F = oracle.transition(oracle.force(accel, rate, dt), dt)
    for column in range(12):
        ends = []
        for sign in (1.0, -1.0):
            moved = copy.deepcopy(oracle)
            moved.inject(sign * step * np.eye(12)[column])
            moved.predict(accel, rate, dt, np.zeros(3), accel)
            ends.append(moved)
        np.testing.assert_allclose(ends[1].error_of(ends[0]) / (2 * step), F[:, column], atol=2e-6)


@quick
@given(seeds)
def test_the_measurement_jacobian_is_its_derivative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    oracle, rate, step = random_oracle(rng), rng.normal(size=3) * 5.0, 1e-6
    H = oracle.jacobian(rate)
    for column in range(12):
        plus, minus = copy.deepcopy(oracle), copy.deepcopy(oracle)
        plus.inject(step * np.eye(12)[column])
        minus.inject(-step * np.eye(12)[column])
        slope = (plus.sole_velocity(rate) - minus.sole_velocity(rate)) / (2 * step)
        np.testing.assert_allclose(slope, H[:, column], atol=1e-6)


@quick
@given(seeds, st.floats(0.0, 20.0))
def test_an_update_never_makes_the_covariance_indefinite(seed: int, speed: float) -> None:
    rng = np.random.default_rng(seed)
    foot = FootSettings()
    oracle = random_oracle(rng)
    oracle.velocity[0] += speed
    state, p = record_of(oracle, foot), parameters(foot)[0]
    before = np.trace(state["P"])
    kernel.zero_velocity(state, p, 0, 0.005)
    assert np.array_equal(state["P"], state["P"].T)
    assert np.linalg.eigvalsh(state["P"]).min() > -1e-12
    assert np.trace(state["P"]) < before
