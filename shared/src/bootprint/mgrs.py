"""Places as MGRS grid references, e.g. ``34V CL 33420 82690``, as maps and radios say them.

UTM by Krüger's series in the third flattening n, here to n³: good to a centimetre within a zone (Karney, Transverse
Mercator with an accuracy of a few nanometers, 2011, eq. 7-11 and 35).
"""

import math
from typing import Final

_A_M: Final = 6_378_137.0
_F: Final = 1.0 / 298.257223563
_N: Final = _F / (2.0 - _F)
_ECCENTRICITY: Final = math.sqrt(_F * (2.0 - _F))
_RECTIFYING_M: Final = _A_M / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA: Final = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 5.0 * _N**3 / 16.0,
    13.0 * _N**2 / 48.0 - 3.0 * _N**3 / 5.0,
    61.0 * _N**3 / 240.0,
)
_SCALE: Final = 0.9996
_BANDS: Final = "CDEFGHJKLMNPQRSTUVWX"
_COLUMNS: Final = ("STUVWXYZ", "ABCDEFGH", "JKLMNPQR")
_ROWS: Final = ("FGHJKLMNPQRSTUVABCDE", "ABCDEFGHJKLMNPQRSTUV")
_SQUARE_M: Final = 100_000


def mgrs(latitude_deg: float, longitude_deg: float) -> str:
    """The square metre that a place lies in; "–" towards the poles, where MGRS goes by other rules."""
    if not -80.0 <= latitude_deg < 84.0:
        return "–"
    zone = _zone(latitude_deg, longitude_deg)
    easting_m, northing_m = utm(latitude_deg, longitude_deg, zone)
    band = _BANDS[min(19, int((latitude_deg + 80.0) // 8.0))]
    column = _COLUMNS[zone % 3][int(easting_m // _SQUARE_M) - 1]
    row = _ROWS[zone % 2][int(northing_m // _SQUARE_M) % 20]
    return f"{zone}{band} {column}{row} {int(easting_m) % _SQUARE_M:05d} {int(northing_m) % _SQUARE_M:05d}"


def utm(latitude_deg: float, longitude_deg: float, zone: int) -> tuple[float, float]:
    """Easting and northing in a zone, m; south of the equator with its false northing of 10,000 km."""
    phi, lam = math.radians(latitude_deg), math.radians(longitude_deg - (6 * zone - 183))
    sine = math.sin(phi)
    t = math.sinh(math.atanh(sine) - _ECCENTRICITY * math.atanh(_ECCENTRICITY * sine))
    xi, eta = math.atan2(t, math.cos(lam)), math.asinh(math.sin(lam) / math.hypot(t, math.cos(lam)))
    east, north = eta, xi
    for order, alpha in enumerate(_ALPHA, start=1):
        east += alpha * math.cos(2 * order * xi) * math.sinh(2 * order * eta)
        north += alpha * math.sin(2 * order * xi) * math.cosh(2 * order * eta)
    false_northing_m = 0.0 if latitude_deg >= 0.0 else 1e7
    return 500_000.0 + _SCALE * _RECTIFYING_M * east, false_northing_m + _SCALE * _RECTIFYING_M * north


def _zone(latitude_deg: float, longitude_deg: float) -> int:
    """Six degrees each, but for the south-west of Norway and for Svalbard."""
    if 56.0 <= latitude_deg < 64.0 and 3.0 <= longitude_deg < 12.0:
        return 32
    if latitude_deg >= 72.0 and 0.0 <= longitude_deg < 42.0:
        return 31 + 2 * int((longitude_deg + 3.0) // 12.0)
    return min(60, int((longitude_deg + 180.0) // 6.0) + 1)
