"""Geodesy against the textbook: points whose coordinates follow from the ellipsoid's axes alone."""

import math

import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bootprint.config import Origin
from bootprint.geodesy import (
    LocalFrame,
    azimuth_of,
    ground_offset,
    major_axis_sigma_m,
    moved_place,
    wrap_angle,
    yaw_of_azimuth,
)

A_M = 6_378_137.0
F = 1 / 298.257223563
B_M = A_M * (1 - F)

angles = st.floats(-100.0, 100.0)
near = st.floats(-50_000.0, 50_000.0)


def ecef(latitude_deg: float, longitude_deg: float, height_m: float) -> tuple[float, float, float]:
    """Earth-centred coordinates by the closed form (e.g. Hofmann-Wellenhof et al., GNSS, eq. 8.5)."""
    lat, lon = math.radians(latitude_deg), math.radians(longitude_deg)
    n = A_M**2 / math.hypot(A_M * math.cos(lat), B_M * math.sin(lat))
    across = (n + height_m) * math.cos(lat)
    return across * math.cos(lon), across * math.sin(lon), ((B_M / A_M) ** 2 * n + height_m) * math.sin(lat)


def enu(point: tuple[float, float, float], origin: tuple[float, float, float]) -> tuple[float, float, float]:
    """East, north, up by scalar products with the unit vectors at the origin."""
    lat, lon = math.radians(origin[0]), math.radians(origin[1])
    d = [p - o for p, o in zip(ecef(*point), ecef(*origin), strict=True)]
    east = (-math.sin(lon), math.cos(lon), 0.0)
    north = (-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat))
    up = (math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat))
    return tuple(sum(a * b for a, b in zip(d, axis, strict=True)) for axis in (east, north, up))  # type: ignore[return-value]


def frame(latitude_deg: float, longitude_deg: float, height_m: float = 0.0) -> LocalFrame:
    return LocalFrame(Origin(latitude_deg=latitude_deg, longitude_deg=longitude_deg, height_m=height_m))


def test_the_polar_radius_is_the_published_one() -> None:
    """NIMA TR8350.2, table 3.3: b = 6 356 752.3142 m."""
    assert pytest.approx(6_356_752.3142, abs=5e-5) == B_M
    assert frame(0.0, 0.0).to_enu(90.0, 0.0, 0.0) == pytest.approx((0.0, B_M, -A_M), abs=1e-6)


def test_along_the_equator_the_earth_is_a_circle() -> None:
    a = math.radians(1.0)
    expected = (A_M * math.sin(a), 0.0, A_M * (math.cos(a) - 1.0))
    assert frame(0.0, 10.0).to_enu(0.0, 11.0, 0.0) == pytest.approx(expected, abs=1e-6)


def test_height_is_up() -> None:
    assert frame(47.05, 8.31, 500.0).to_enu(47.05, 8.31, 512.5) == pytest.approx((0.0, 0.0, 12.5), abs=1e-6)


def test_a_minute_of_latitude_at_45_degrees() -> None:
    """The meridian radius at 45° is 6 367 382 m, so a minute of latitude is 1852.22 m."""
    _, north, _ = frame(45.0, 0.0).to_enu(45.0 + 1 / 60, 0.0, 0.0)
    assert north == pytest.approx(1852.22, abs=0.3)


@settings(deadline=None)
@given(
    latitude=st.floats(-89.0, 89.0),
    longitude=st.floats(-180.0, 180.0),
    height=st.floats(-400.0, 9_000.0),
    offset=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-500.0, 500.0)),
)
def test_enu_agrees_with_the_closed_form(
    latitude: float, longitude: float, height: float, offset: tuple[float, float, float]
) -> None:
    origin = (latitude, longitude, height)
    point = (latitude + offset[0], longitude + offset[1], height + offset[2])
    assert frame(*origin).to_enu(*point) == pytest.approx(enu(point, origin), abs=1e-6)


@settings(deadline=None)
@given(
    latitude=st.floats(-85.0, 85.0), longitude=st.floats(-180.0, 180.0), offset=st.tuples(near, near, near)
)
def test_there_and_back(latitude: float, longitude: float, offset: tuple[float, float, float]) -> None:
    local = frame(latitude, longitude, 400.0)
    assert local.to_enu(*local.to_geodetic(*offset)) == pytest.approx(offset, abs=1e-6)


@settings(deadline=None)
@given(angle=angles)
def test_wrapping_keeps_the_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (math.nextafter(math.pi, 4.0), math.pi),
        (3 * math.pi / 2, -math.pi / 2),
        (-3 * math.pi / 2, math.pi / 2),
        (5 * math.pi, math.pi),
    ],
)
def test_wrapping_at_the_edges(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped)


@pytest.mark.parametrize(
    ("east", "north", "azimuth_deg"),
    [(0, 1, 0), (1, 1, 45), (1, 0, 90), (0, -1, 180), (-1, 0, 270), (-1e-30, 1, 0)],
)
def test_azimuths_run_clockwise_from_north(east: float, north: float, azimuth_deg: float) -> None:
    azimuth = azimuth_of(east, north)
    assert 0.0 <= azimuth < 2.0 * math.pi
    assert math.degrees(azimuth) == pytest.approx(azimuth_deg)


@pytest.mark.parametrize(("azimuth_deg", "yaw_deg"), [(0, 90), (90, 0), (180, -90), (270, 180)])
def test_yaw_runs_counter_clockwise_from_east(azimuth_deg: float, yaw_deg: float) -> None:
    assert math.degrees(yaw_of_azimuth(math.radians(azimuth_deg))) == pytest.approx(yaw_deg)


@settings(deadline=None)
@given(azimuth=angles)
def test_yaw_is_its_own_inverse(azimuth: float) -> None:
    assert math.cos(yaw_of_azimuth(yaw_of_azimuth(azimuth)) - azimuth) == pytest.approx(1.0)


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, math.pi / 4, 2.0])
def test_the_major_axis_is_the_longer_one_however_the_ellipse_lies(turn_rad: float) -> None:
    long_m2, short_m2 = 9.0, 4.0
    cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
    ee = long_m2 * cosine**2 + short_m2 * sine**2
    nn = long_m2 * sine**2 + short_m2 * cosine**2
    assert major_axis_sigma_m(ee, (long_m2 - short_m2) * sine * cosine, nn) == pytest.approx(3.0)


def test_a_covariance_that_is_none_has_no_axis() -> None:
    assert major_axis_sigma_m(-1e-18, 0.0, -1e-18) == 0.0


@settings(max_examples=300)
@given(
    latitude_deg=st.floats(-89.9, 89.9),
    longitude_deg=st.floats(-180.0, 180.0),
    height_m=st.floats(-500.0, 20_000.0),
    east_m=near,
    north_m=near,
    up_m=st.floats(-500.0, 9_000.0),
)
def test_the_closed_form_is_the_library_s_answer(
    latitude_deg: float, longitude_deg: float, height_m: float, east_m: float, north_m: float, up_m: float
) -> None:
    """pymap3d solves the same equations by another way (You 2000)."""
    found = frame(latitude_deg, longitude_deg, height_m).to_geodetic(east_m, north_m, up_m)
    expected = pymap3d.enu2geodetic(east_m, north_m, up_m, latitude_deg, longitude_deg, height_m)
    across = math.cos(math.radians(found[0]))  # of a degree of longitude near a pole little is left
    assert found[0] == pytest.approx(expected[0], abs=1e-9)
    assert (found[1] - expected[1] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-9 / across)
    assert found[2] == pytest.approx(expected[2], abs=1e-6)


@pytest.mark.parametrize(("latitude_deg", "z_m"), [(90.0, B_M + 100.0), (-90.0, -B_M - 100.0)])
def test_a_hundred_metres_above_the_poles(latitude_deg: float, z_m: float) -> None:
    found = frame(latitude_deg, 0.0).to_geodetic(0.0, 0.0, 100.0)
    assert found[0] == pytest.approx(latitude_deg)
    assert found[2] == pytest.approx(abs(z_m) - B_M, abs=1e-6)


@given(
    st.floats(-89.0, 89.0), st.floats(-180.0, 180.0), st.floats(-3000.0, 3000.0), st.floats(-3000.0, 3000.0)
)
def test_a_place_moved_is_as_far_off_as_it_was_moved(
    latitude: float, longitude: float, east: float, north: float
) -> None:
    moved = moved_place((latitude, longitude), east, north)
    assert ground_offset((latitude, longitude), moved) == pytest.approx((east, north), abs=2e-3)


def test_no_move_leaves_the_poles_or_the_map() -> None:
    for pole in (90.0, -90.0):
        latitude, longitude = moved_place((pole, 10.0), 1000.0, 1000.0)
        assert abs(latitude) <= 90.0
        assert abs(longitude) <= 180.0
