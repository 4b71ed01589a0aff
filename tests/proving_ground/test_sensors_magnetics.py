"""Magnetic fields: dipoles by hand, the earth in turned axes, the device's iron, and iron that is far away."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bootprint.geomagnetism import EarthField
from proving_ground.sensors import (
    DeviceIron,
    Dipoles,
    Magnetics,
    iron_row,
    lift_shaft,
    spread_iron,
    storey_iron,
)
from proving_ground.sensors.imu_quality import MagnetometerQuality
from proving_ground.sensors.magnetics import measure_field

EARTH = EarthField(east_ut=1.0, north_ut=16.0, up_ut=-48.0)
EXACT = MagnetometerQuality(0.0, 0.0, 0.0, 1e-9, 1000.0)
POINT = np.array([1e-6])
TIME_S = np.arange(0.0, 1.0, 0.005)


def read(
    surroundings: Magnetics, attitude: Rotation, quality: MagnetometerQuality = EXACT, seed: int = 1
) -> np.ndarray:
    place_m = np.zeros((len(TIME_S), 3))
    turned = attitude * Rotation.identity(len(TIME_S))
    return measure_field(surroundings, TIME_S, place_m, turned, quality, np.random.default_rng(seed))


def test_a_dipole_s_field_ahead_and_beside() -> None:
    """10 A·m² at 2 m: 2·μ₀/4π·m/r³ = 2e-7·10/8 T = 0.25 µT along the moment ahead, half of it against beside."""
    dipole = Dipoles(np.zeros((1, 3)), np.array([[10.0, 0.0, 0.0]]), POINT)
    field = dipole.field_ut(np.array([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, -2.0]]))
    np.testing.assert_allclose(field, [[0.25, 0.0, 0.0], [-0.125, 0.0, 0.0], [-0.125, 0.0, 0.0]], atol=1e-9)


def test_a_dipole_s_field_has_neither_source_nor_curl() -> None:
    dipole = Dipoles(np.zeros((1, 3)), np.array([[3.0, -8.0, 5.0]]), POINT)
    here, step = np.array([0.7, 0.9, -1.1]), 1e-4
    slope = np.array(
        [
            (dipole.field_ut((here + offset)[None]) - dipole.field_ut((here - offset)[None]))[0]
            / (2.0 * step)
            for offset in np.eye(3) * step
        ]
    )
    assert np.trace(slope) == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_allclose(slope, slope.T, atol=1e-5)


def test_inside_its_core_a_piece_of_iron_is_no_singularity() -> None:
    piece = Dipoles(np.zeros((1, 3)), np.array([[0.0, 0.0, 10.0]]), np.array([0.5]))
    assert np.linalg.norm(piece.field_ut(np.zeros((1, 3)))) == pytest.approx(0.1 * 10.0 / 0.5**3)


def test_what_is_left_out_as_too_far_does_not_matter() -> None:
    iron = spread_iron(np.array([-40.0, -40.0, -1.0]), np.array([40.0, 40.0, 0.0]), 0.5, 5.0, 0.15, 3)
    path = np.column_stack([np.linspace(-30.0, 30.0, 400), np.zeros(400), np.full(400, 0.3)])
    everything = iron._sum(path, np.arange(len(iron)))
    assert np.abs(everything).max() > 3.0
    np.testing.assert_allclose(iron.field_ut(path), everything, atol=0.1)


def test_together_they_make_the_sum() -> None:
    row = iron_row(np.zeros(3), np.array([10.0, 0.0, 0.0]), 2.0, 5.0, 1)
    shaft = lift_shaft(np.array([3.0, 4.0, 0.0]), 9.0, 2)
    assert len(row) == 5
    assert (np.diff(row.place_m[:, 0]) > 0.0).all()
    assert shaft.place_m[:, 2].max() <= 9.0
    here = np.array([[2.0, 1.0, 1.0]])
    np.testing.assert_allclose(
        (row + shaft).field_ut(here), row.field_ut(here) + shaft.field_ut(here), atol=0.03
    )


def test_the_earth_is_read_in_the_sensor_s_axes() -> None:
    """Facing north: ahead is north, left is west, up is up."""
    read_ut = read(Magnetics(EARTH, device=DeviceIron()), Rotation.from_euler("Z", np.pi / 2.0))
    np.testing.assert_allclose(read_ut, np.tile([16.0, -1.0, -48.0], (200, 1)), atol=1e-6)


def test_the_device_s_iron_turns_with_the_device() -> None:
    device = DeviceIron(np.array([5.0, 0.0, -2.0]), np.diag([1.1, 1.0, 0.9]))
    for yaw in (0.0, np.pi):
        read_ut = read(Magnetics(EARTH, device=device), Rotation.from_euler("Z", yaw))
        sign = np.cos(yaw)
        expected = [1.1 * sign * 1.0 + 5.0, sign * 16.0, 0.9 * -48.0 - 2.0]
        np.testing.assert_allclose(read_ut[0], expected, atol=1e-6)


def test_noise_resolution_and_residual_iron_have_their_sizes() -> None:
    noisy = read(Magnetics(EARTH), Rotation.identity(), replace(EXACT, noise_ut=0.5))
    np.testing.assert_allclose(noisy.std(axis=0), 0.5, rtol=0.2)
    coarse = read(Magnetics(EARTH), Rotation.identity(), replace(EXACT, resolution_ut=0.6))
    np.testing.assert_allclose(coarse[0], [0.6 * 2, 0.6 * 27, -48.0])
    iron = [
        read(Magnetics(EARTH), Rotation.identity(), replace(EXACT, hard_iron_ut=2.0), seed)[0]
        for seed in range(150)
    ]
    np.testing.assert_allclose(np.std(iron, axis=0), 2.0, rtol=0.2)


def test_a_slow_magnetometer_repeats_its_last_sample() -> None:
    read_ut = read(Magnetics(EARTH), Rotation.identity(), replace(EXACT, noise_ut=1.0, rate_hz=50.0))
    changes = np.flatnonzero(np.diff(read_ut[:, 0])) + 1
    np.testing.assert_array_equal(changes, np.arange(4, 200, 4))


def test_a_storey_ripples_where_people_walk_and_more_at_their_feet() -> None:
    iron = storey_iron(np.array([-5.0, -5.0, 0.0]), np.array([65.0, 5.0, 5.0]), 1)
    east = np.linspace(0.0, 60.0, 600)
    waist, feet = (
        np.linalg.norm(
            Magnetics(EARTH, iron).field_ut(np.column_stack([east, 0 * east, 0 * east + z])), axis=1
        )
        for z in (1.2, 0.05)
    )
    assert waist.std() > 1.0
    # The same iron at a tenth of the distance: the feet's field changes from one decimetre to the next.
    assert np.abs(np.diff(feet)).mean() > 3.0 * np.abs(np.diff(waist)).mean()
