"""The earth's magnetic field by the World Magnetic Model (NOAA/BGS), through pygeomag.

Each model lives five years; a date before the first or after the last model takes the nearest one's edge.
"""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

from bootprint.config import Origin

_MODELS = {2010: "WMM_2010.COF", 2015: "WMM_2015v2.COF", 2020: "WMM_2020.COF", 2025: "WMM_2025.COF"}
_LIFE_YEARS = 5.0
_NT_PER_UT = 1000.0


@dataclass(frozen=True, slots=True)
class EarthField:
    """The undisturbed field at one place and time, µT, in local ENU axes."""

    east_ut: float
    north_ut: float
    up_ut: float

    @property
    def horizontal_ut(self) -> float:
        """Strength of the horizontal part: what a compass has to work with."""
        return math.hypot(self.east_ut, self.north_ut)

    @property
    def strength_ut(self) -> float:
        """Strength of the whole field."""
        return math.hypot(self.east_ut, self.north_ut, self.up_ut)

    @property
    def declination_rad(self) -> float:
        """Azimuth of magnetic north: positive when it lies east of true north."""
        return math.atan2(self.east_ut, self.north_ut)

    @property
    def dip_rad(self) -> float:
        """Angle below the horizon: positive where the field points down (northern hemisphere)."""
        return math.atan2(-self.up_ut, self.horizontal_ut)


def decimal_year(time_ns: int) -> float:
    """A time, UTC ns, as a year with its fraction."""
    moment = datetime.fromtimestamp(time_ns * 1e-9, UTC)
    start, end = (datetime(year, 1, 1, tzinfo=UTC) for year in (moment.year, moment.year + 1))
    return moment.year + (moment - start) / (end - start)


@lru_cache(maxsize=len(_MODELS))
def _model(epoch: int) -> Any:
    from pygeomag import GeoMag  # its tables are loaded only by those who ask for a field

    return GeoMag(coefficients_file=f"wmm/{_MODELS[epoch]}")


def earth_field(place: Origin, time_ns: int) -> EarthField:
    """The field at a place (WGS84) and time (UTC ns); typically within 0.2 µT of the truth away from iron."""
    year = decimal_year(time_ns)
    epoch = max((start for start in _MODELS if start <= year), default=min(_MODELS))
    year = min(max(year, epoch), epoch + _LIFE_YEARS)
    found = _model(epoch).calculate(
        glat=place.latitude_deg, glon=place.longitude_deg, alt=place.height_m / 1000.0, time=year
    )
    return EarthField(found.y / _NT_PER_UT, found.x / _NT_PER_UT, -found.z / _NT_PER_UT)
