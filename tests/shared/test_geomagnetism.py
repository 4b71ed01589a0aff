"""The earth's field: directions and dates, against what charts of the world tell."""

import math
from datetime import UTC, datetime

import pytest

from bootprint.config import Origin
from bootprint.geomagnetism import EarthField, decimal_year, earth_field


def ns(year: int, month: int = 1, day: int = 1) -> int:
    return int(datetime(year, month, day, tzinfo=UTC).timestamp()) * 10**9


# Declination and dip as printed on charts for 2025, rounded to a degree.
CHARTED = {
    "Seattle": (47.6, -122.3, 15.0, 68.0),
    "Munich": (48.1, 11.6, 4.0, 64.0),
    "Sydney": (-33.9, 151.2, 13.0, -64.0),
    "Cape Town": (-33.9, 18.4, -26.0, -65.0),
}


@pytest.mark.parametrize("city", CHARTED)
def test_declination_and_dip_are_those_of_the_charts(city: str) -> None:
    latitude, longitude, declination, dip = CHARTED[city]
    field = earth_field(Origin(latitude_deg=latitude, longitude_deg=longitude, height_m=0.0), ns(2025, 7))
    assert math.degrees(field.declination_rad) == pytest.approx(declination, abs=1.0)
    assert math.degrees(field.dip_rad) == pytest.approx(dip, abs=1.5)
    assert 20.0 < field.strength_ut < 67.0


def test_components_of_a_plain_field() -> None:
    field = EarthField(east_ut=3.0, north_ut=4.0, up_ut=-12.0)
    assert field.horizontal_ut == pytest.approx(5.0)
    assert field.strength_ut == pytest.approx(13.0)
    assert field.declination_rad == pytest.approx(math.atan2(3.0, 4.0))
    assert field.dip_rad == pytest.approx(math.atan2(12.0, 5.0))


def test_a_date_without_a_model_takes_the_nearest_ones_edge() -> None:
    place = Origin(latitude_deg=48.0, longitude_deg=11.0, height_m=500.0)
    assert earth_field(place, ns(1990)) == earth_field(place, ns(2010))
    assert earth_field(place, ns(2040)) == earth_field(place, ns(2030))


def test_the_field_drifts_from_model_to_model_without_a_leap() -> None:
    place = Origin(latitude_deg=48.0, longitude_deg=11.0, height_m=500.0)
    before, after = earth_field(place, ns(2024, 12, 31)), earth_field(place, ns(2025, 1, 2))
    assert abs(before.declination_rad - after.declination_rad) < math.radians(0.2)


def test_decimal_year_knows_leap_years() -> None:
    assert decimal_year(ns(2024, 7, 2)) == pytest.approx(2024.5)
    assert decimal_year(ns(2025, 1, 1)) == 2025.0
