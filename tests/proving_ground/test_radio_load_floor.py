"""The information floor: the closed form against the integrals it comes from, and q found in a random walk."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from proving_ground.radio_load.floor import (
    corner_rad_s,
    floor_bits_per_s,
    intensity_m2_s3,
    squad_floor_bits_per_s,
    variance_of_p95_m2,
)
from proving_ground.radio_load.squad_tracks import SquadTracks


@pytest.mark.parametrize(("intensity", "variance_m2"), [(0.02, 4.0), (0.1, 1.0), (0.5, 30.0)])
def test_the_closed_form_is_reverse_water_filling(intensity: float, variance_m2: float) -> None:
    corner = corner_rad_s(intensity, variance_m2)
    level = intensity / corner**4
    below = 2.0 * level * corner
    above = 2.0 * quad(lambda w: intensity / w**4, corner, np.inf)[0]
    assert (below + above) / (2.0 * math.pi) == pytest.approx(variance_m2)
    rate = 2.0 * quad(lambda w: 0.5 * math.log2(intensity / w**4 / level), 0.0, corner)[0] / (2.0 * math.pi)
    p95_m = math.sqrt(variance_m2) * math.sqrt(2.0 * math.log(20.0))
    assert floor_bits_per_s(p95_m, intensity) == pytest.approx(2.0 * rate)


def test_p95_of_a_circular_error() -> None:
    error = np.random.default_rng(1).normal(0.0, math.sqrt(variance_of_p95_m2(5.0)), (200_000, 2))
    assert np.percentile(np.linalg.norm(error, axis=1), 95) == pytest.approx(5.0, rel=0.01)


def test_half_the_error_costs_the_cube_root_of_four() -> None:
    assert floor_bits_per_s(2.5, 0.05) / floor_bits_per_s(5.0, 0.05) == pytest.approx(4.0 ** (1.0 / 3.0))


def test_intensity_is_found_again_at_any_lag() -> None:
    steps = np.random.default_rng(2).normal(0.0, math.sqrt(0.04 * 0.2), (40, 5000, 2))
    velocity = np.cumsum(steps, axis=1)
    for lag_s in (1.0, 5.0, 20.0):
        assert intensity_m2_s3(velocity, lag_s) == pytest.approx(0.04, rel=0.1)


def test_a_squads_floor_is_that_of_its_soldiers() -> None:
    rng = np.random.default_rng(3)
    velocity = np.cumsum(rng.normal(0.0, math.sqrt(0.05 * 0.2), (6, 6000, 2)), axis=1)
    place = np.concatenate([0.2 * np.cumsum(velocity, axis=1), np.zeros((6, 6000, 1))], axis=2)
    tracks = SquadTracks("random", 0, 0.2 * np.arange(6000), place, velocity)
    # Smoothing over 1.5 s and the few walks leave some 15 % of doubt on q, a third of that on its cube root.
    assert squad_floor_bits_per_s(tracks, 5.0) == pytest.approx(6 * floor_bits_per_s(5.0, 0.05), rel=0.1)
