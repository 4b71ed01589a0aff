"""Physical values to the whole numbers a frame carries, and back; every rounding has a stated bound.

Positions lie on one lattice for the whole earth: cells of 180°/2^26 (0.30 m of latitude) times 2^resolution,
nested, so that a relay that uses the sender's resolution gives back exactly what it heard.
"""

import math
from typing import Final

from bootprint.messages import Mode

TICK_NS: Final = 100_000_000
RESOLUTIONS: Final = 8
LATITUDE_BITS: Final = 26
LONGITUDE_BITS: Final = 27
TIME_BITS: Final = 16
HEIGHT_MIN_M: Final = -1024
HEIGHT_BITS: Final = 14
FLOOR_MIN: Final = -32
FLOOR_BITS: Final = 7
DIRECTIONS: Final = 16
SPEEDS_M_S: Final = tuple(0.3 * 1.28**code for code in range(16))
STANDING_BELOW_M_S: Final = SPEEDS_M_S[0] / 2
PACES: Final = (2, 4, 6, 8)
"""The speeds of people on foot: codes of `SPEEDS_M_S`."""
ACCURACIES_M: Final = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 50.0, 1000.0)
AGE_CODES: Final = 256
LONGEST_AGE_TICKS: Final = 63 << 6
MODES: Final[tuple[Mode, ...]] = ("unplaced", "gnss", "boots", "body", "camera", "coasting", "lost")

_FINEST_CELL_DEG: Final = 180.0 / (1 << LATITUDE_BITS)
_METRES_PER_DEG: Final = 40_007_863.0 / 360.0  # WGS84 meridian


def cell_deg(resolution: int) -> float:
    """Edge of a lattice cell, in degrees of latitude and of longitude; exact in binary."""
    return _FINEST_CELL_DEG * (1 << resolution)


def cell_m(resolution: int) -> float:
    """Edge of a lattice cell in metres of latitude (of longitude: times the cosine of latitude)."""
    return cell_deg(resolution) * _METRES_PER_DEG


def resolution_for(cell_limit_m: float) -> int:
    """The coarsest resolution whose cells are no larger than ``cell_limit_m``, the finest if none is."""
    fitting = [resolution for resolution in range(RESOLUTIONS) if cell_m(resolution) <= cell_limit_m]
    return max(fitting, default=0)


def wrap(value: int, bits: int) -> int:
    """The number congruent to ``value`` modulo 2^bits that is nearest to zero (−2^(bits−1) included)."""
    half = 1 << (bits - 1)
    return (value + half) % (2 * half) - half


def unwrap(low: int, bits: int, near: int) -> int:
    """The number whose low ``bits`` bits are ``low`` that is nearest to ``near``."""
    return near + wrap(low - near, bits)


def latitude_index(latitude_deg: float, resolution: int) -> int:
    """The lattice row of a latitude; the pole itself belongs to the last row."""
    rows = 1 << (LATITUDE_BITS - 1 - resolution)
    return min(math.floor(latitude_deg / cell_deg(resolution)), rows - 1)


def longitude_index(longitude_deg: float, resolution: int) -> int:
    """The lattice column of a longitude; +180° is the same column as −180°."""
    return wrap(math.floor(longitude_deg / cell_deg(resolution)), LONGITUDE_BITS - resolution)


def is_row(index: int, resolution: int) -> bool:
    """Whether there is such a row between the poles."""
    rows = 1 << (LATITUDE_BITS - 1 - resolution)
    return -rows <= index < rows


def latitude_code(row: int, resolution: int) -> int:
    """A row's south edge as 26 bits from −90°."""
    return (row << resolution) + (1 << (LATITUDE_BITS - 1))


def longitude_code(column: int, resolution: int) -> int:
    """A column's west edge as 27 bits from −180°."""
    return (column << resolution) + (1 << (LONGITUDE_BITS - 1))


def latitude_row(code: int, resolution: int) -> int:
    """The row that holds the edge which `latitude_code` gives."""
    return (code - (1 << (LATITUDE_BITS - 1))) >> resolution


def longitude_column(code: int, resolution: int) -> int:
    """The column that holds the edge which `longitude_code` gives."""
    return (code - (1 << (LONGITUDE_BITS - 1))) >> resolution


def cell_centre_deg(index: int, resolution: int) -> float:
    """The middle of a row (or column), at most half a cell from all that belongs to it."""
    return (index + 0.5) * cell_deg(resolution)


def tick_of(time_ns: int) -> int:
    """The nearest tick of 0.1 s since 1970; at most 0.05 s away."""
    return (time_ns + TICK_NS // 2) // TICK_NS


def height_index(height_m: float) -> int:
    """Height in whole metres, held within −1024 … 15,359 m."""
    return min(max(round(height_m), HEIGHT_MIN_M), HEIGHT_MIN_M + (1 << HEIGHT_BITS) - 1)


def floor_code(floor: int) -> int:
    """Floor −32 … 95, held within."""
    return min(max(floor - FLOOR_MIN, 0), (1 << FLOOR_BITS) - 1)


def accuracy_code(accuracy_m: float) -> int:
    """The class whose bound is not below ``accuracy_m``; the last class is "worse than 50 m, or unknown"."""
    return next(
        (code for code, bound in enumerate(ACCURACIES_M) if accuracy_m <= bound), len(ACCURACIES_M) - 1
    )


def direction_code(azimuth_deg: float) -> int:
    """The nearest 1/16 turn clockwise from true north, right to 11.25°."""
    return round(azimuth_deg / 360.0 * DIRECTIONS) % DIRECTIONS


def direction_deg(code: int) -> float:
    """The azimuth of a direction's code, 0 to below 360."""
    return code * 360.0 / DIRECTIONS


def velocity_codes(east_m_s: float, north_m_s: float) -> tuple[int, int] | None:
    """(direction, speed) codes, None when standing.

    Direction is right to 11.25°, speed to a factor of √1.28 (13 %) between 0.27 and 13.8 m/s, held above.
    """
    speed = math.hypot(east_m_s, north_m_s)
    if speed < STANDING_BELOW_M_S:
        return None
    direction = direction_code(math.degrees(math.atan2(east_m_s, north_m_s)))
    nearest = round(math.log(speed / SPEEDS_M_S[0]) / math.log(1.28))
    return direction, min(max(nearest, 0), len(SPEEDS_M_S) - 1)


def velocity_of(direction: int, speed: int) -> tuple[float, float]:
    """(east, north) m/s of a pair of codes."""
    azimuth = direction * 2 * math.pi / DIRECTIONS
    return SPEEDS_M_S[speed] * math.sin(azimuth), SPEEDS_M_S[speed] * math.cos(azimuth)


def age_code(ticks: int) -> int:
    """Age in ticks as 3-bit exponent and 5-bit mantissa, rounded up: what is relayed never looks younger.

    Exact below 6.4 s, then within 1/32; ages above 403.2 s do not fit (ValueError).
    """
    if ticks < 32:
        return ticks
    for exponent in range(1, 8):
        mantissa = -(-ticks >> (exponent - 1))
        if mantissa < 64:
            return exponent << 5 | (mantissa - 32)
    raise ValueError(f"age of {ticks / 10} s is more than a frame can say")


def age_ticks(code: int) -> int:
    """Age in ticks of a code."""
    exponent, mantissa = code >> 5, code & 31
    return mantissa if exponent == 0 else (32 + mantissa) << (exponent - 1)
