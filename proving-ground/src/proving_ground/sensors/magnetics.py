"""The magnetic field where a soldier goes: the earth's, iron in buildings and vehicles, and the device's own.

Iron is dipoles: B = μ₀/4π · (3(m·r̂)r̂ − m)/r³ (Jackson, Classical Electrodynamics, 5.56). Reinforcement, beams,
rails of lift shafts and pipes are rows of dipoles of random moment (`iron_row`): near them the field ripples over
about their distance, as it does in recorded buildings.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from bootprint.geomagnetism import EarthField
from proving_ground.motion import FloatArray
from proving_ground.sensors.imu_quality import MagnetometerQuality
from proving_ground.sensors.randomness import coarse, interpolated

_UT_M3_PER_A_M2 = 0.1  # μ₀/4π = 1e-7 T·m/A
_CORE_M = 0.15
_PATH_PERIOD_S = 0.02  # the field along a path is computed at 50 Hz and interpolated
_LEAST_UT = 0.01  # a dipole's reach is where its field falls below this
_CHUNK = 64
_MESH_PER_M2, _MESH_A_M2 = 4.0, 0.6
_WAIST_M = 1.2
# Sources at a distance d make a field of the same strength and ripples in proportion when moments grow with d².
_BEAMS_PER_M2, _BEAM_A, _BEAM_CORE = 0.1, 110.0, 0.7


def _no_points() -> FloatArray:
    return np.zeros((0, 3))


@dataclass(frozen=True)
class Dipoles:
    """Pieces of iron: ``place_m`` (k, 3) ENU, ``moment_a_m2`` (k, 3), ``core_m`` (k,) or (1,) their size.

    Inside its core a piece's field stops growing: nothing is a point, a beam least of all.
    """

    place_m: FloatArray = field(default_factory=_no_points)
    moment_a_m2: FloatArray = field(default_factory=_no_points)
    core_m: FloatArray = field(default_factory=lambda: np.array([_CORE_M]))

    def __len__(self) -> int:
        return len(self.place_m)

    def __add__(self, other: "Dipoles") -> "Dipoles":
        return Dipoles(
            np.concatenate([self.place_m, other.place_m]),
            np.concatenate([self.moment_a_m2, other.moment_a_m2]),
            np.concatenate([np.broadcast_to(part.core_m, (len(part),)) for part in (self, other)]),
        )

    def field_ut(self, place_m: FloatArray) -> FloatArray:
        """Their field at places (n, 3), µT, (n, 3) ENU; what is too far to matter is left out."""
        total = np.zeros((len(place_m), 3))
        reach_m = np.cbrt(_UT_M3_PER_A_M2 / _LEAST_UT * np.linalg.norm(self.moment_a_m2, axis=1))[:, None]
        low_m, high_m = (np.ascontiguousarray((self.place_m + side * reach_m).T) for side in (-1.0, 1.0))
        for start in range(0, len(place_m), _CHUNK):
            part = place_m[start : start + _CHUNK]
            near = np.ones(len(self), dtype=np.bool_)
            for axis in range(3):
                near &= (low_m[axis] <= part[:, axis].max()) & (high_m[axis] >= part[:, axis].min())
            total[start : start + _CHUNK] = self._sum(part, np.flatnonzero(near))
        return total

    def _sum(self, place_m: FloatArray, chosen: npt.NDArray[np.int64]) -> FloatArray:
        moment = self.moment_a_m2[chosen]
        core_m = np.broadcast_to(self.core_m, (len(self),))[chosen]
        apart = place_m[:, None] - self.place_m[chosen]
        square = (apart**2).sum(axis=2) + core_m**2
        inverse = square**-1.5
        along = 3.0 * (apart * moment).sum(axis=2) * inverse / square
        return np.asarray(_UT_M3_PER_A_M2 * (np.einsum("nk,nkc->nc", along, apart) - inverse @ moment))


def iron_row(
    from_m: FloatArray, to_m: FloatArray, spacing_m: float, moment_a_m2: float, seed: int
) -> Dipoles:
    """Iron along a line (3,) to (3,): a piece about every ``spacing_m``, moments of random size and direction."""
    rng = np.random.default_rng(seed)
    count = max(1, round(float(np.linalg.norm(to_m - from_m)) / spacing_m))
    share = (np.arange(count) + rng.uniform(0.0, 1.0, count)) / count
    return Dipoles(from_m + share[:, None] * (to_m - from_m), rng.normal(0.0, moment_a_m2, (count, 3)))


def lift_shaft(place_m: FloatArray, top_m: float, seed: int, moment_a_m2: float = 30.0) -> Dipoles:
    """Guide rails and counterweight of a lift: two upright rows of iron from ``place_m`` (3,) to a height."""
    rails = [place_m + np.array([aside, 0.0, 0.0]) for aside in (-0.9, 0.9)]
    rows = [
        iron_row(rail, np.array([rail[0], rail[1], top_m]), 1.0, moment_a_m2, seed + number)
        for number, rail in enumerate(rails)
    ]
    return rows[0] + rows[1]


def spread_iron(
    low_m: FloatArray, high_m: FloatArray, per_m2: float, moment_a_m2: float, core_m: float, seed: int
) -> Dipoles:
    """Iron spread at random over a box (3,) to (3,), so many pieces a m² of plan: radiators, cabinets, beams."""
    rng = np.random.default_rng(seed)
    count = rng.poisson(per_m2 * (high_m[0] - low_m[0]) * (high_m[1] - low_m[1]))
    moments = rng.normal(0.0, moment_a_m2, (count, 3))
    return Dipoles(rng.uniform(low_m, high_m, (count, 3)), moments, np.array([core_m]))


def storey_iron(low_m: FloatArray, high_m: FloatArray, seed: int, strength: float = 1.0) -> Dipoles:
    """The iron of one storey, from its floor's corner (3,) to its ceiling's (3,): mesh in the floor, beams above.

    At ``strength`` 1 the field a metre above the floor varies by 3 to 9 µT over some metres, as in the malls of
    msindoor20; feet feel the mesh besides, over decimetres.
    """
    floor_m, ceiling_m = low_m[2], high_m[2]
    mesh = spread_iron(
        np.array([low_m[0], low_m[1], floor_m - 0.20]),
        np.array([high_m[0], high_m[1], floor_m - 0.10]),
        *(_MESH_PER_M2, strength * _MESH_A_M2, _CORE_M, seed),
    )
    distance_m = max(ceiling_m - floor_m - _WAIST_M, 1.0)
    beams = spread_iron(
        np.array([low_m[0], low_m[1], ceiling_m]),
        np.array([high_m[0], high_m[1], ceiling_m + 0.3]),
        *(_BEAMS_PER_M2, strength * _BEAM_A * distance_m**2, _BEAM_CORE * distance_m, seed + 1),
    )
    return mesh + beams


@dataclass(frozen=True)
class DeviceIron:
    """The device's own iron, in sensor axes: B' = soft·B + hard (µT)."""

    hard_ut: FloatArray = field(default_factory=lambda: np.zeros(3))
    soft: FloatArray = field(default_factory=lambda: np.eye(3))

    @staticmethod
    def drawn(quality: MagnetometerQuality, rng: np.random.Generator) -> "DeviceIron":
        """What a calibration of this quality leaves."""
        return DeviceIron(
            rng.normal(0.0, quality.hard_iron_ut, 3),
            np.eye(3) + rng.normal(0.0, quality.soft_iron, (3, 3)),
        )


@dataclass(frozen=True)
class Magnetics:
    """The field's sources. ``device`` None: every unit has iron of its own, drawn by its quality."""

    earth: EarthField
    dipoles: Dipoles = field(default_factory=Dipoles)
    device: DeviceIron | None = None

    def field_ut(self, place_m: FloatArray) -> FloatArray:
        """The field at places (n, 3), µT, (n, 3) ENU, without the device's own."""
        earth = np.array([self.earth.east_ut, self.earth.north_ut, self.earth.up_ut])
        return earth + self.dipoles.field_ut(place_m)


def measure_field(
    surroundings: Magnetics,
    time_s: FloatArray,
    place_m: FloatArray,
    attitude: Rotation,
    quality: MagnetometerQuality,
    rng: np.random.Generator,
) -> FloatArray:
    """Field (n, 3) µT in sensor axes at times (n,), places (n, 3) and attitudes (sensor to ENU).

    A magnetometer that is slower than the unit repeats its last sample.
    """
    device = surroundings.device or DeviceIron.drawn(quality, rng)
    grid_s = coarse(time_s, _PATH_PERIOD_S)
    path_ut = surroundings.field_ut(interpolated(grid_s, time_s, place_m))
    local_ut = attitude.inv().apply(interpolated(time_s, grid_s, path_ut))
    clean_ut = local_ut @ device.soft.T + device.hard_ut
    noisy_ut = clean_ut + rng.normal(0.0, quality.noise_ut, clean_ut.shape)
    read_ut = np.round(noisy_ut / quality.resolution_ut) * quality.resolution_ut
    turn = np.floor(time_s * quality.rate_hz + 1e-6)
    first = np.concatenate([[True], np.diff(turn) > 0.0])
    return np.asarray(read_ut[np.maximum.accumulate(np.where(first, np.arange(len(time_s)), 0))])
