"""What a magnetometer on a simulated boot measures: the earth's field, iron on the boot, iron in the building.

The earth's field is the World Magnetic Model's (`bootprint.geomagnetism`). Iron on the boot turns with it: an
offset (hard iron) and a matrix (soft iron). Iron in the building stands still and is made of dipoles; those under
a floor make the field change from one footfall to the next, as the steel of reinforced concrete does.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from bootprint.geomagnetism import EarthField
from proving_ground.simulation.walker import FloatArray, FootMotion

_UT_M3_PER_A_M2 = 0.1  # mu0 / 4 pi
_EVERY = 10  # samples
_CLOSEST_M = 0.05  # nobody's boot is nearer to the middle of a piece of iron


@dataclass(frozen=True)
class Dipoles:
    """Pieces of iron: where they are, ENU (k, 3) m, and their moments, ENU (k, 3) A·m²."""

    place_m: FloatArray
    moment_a_m2: FloatArray

    def field_ut(self, place_m: FloatArray) -> FloatArray:
        """Their field (n, 3) µT at these places (n, 3): B = µ0/4π · (3·(m·r̂)·r̂ − m)/r³."""
        field = np.zeros_like(place_m)
        for iron, moment in zip(self.place_m, self.moment_a_m2, strict=True):
            away = place_m - iron
            distance = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), _CLOSEST_M)
            ahead = away / distance
            field += _UT_M3_PER_A_M2 * (3.0 * (ahead @ moment)[:, None] * ahead - moment) / distance**3
        return field


NO_IRON = Dipoles(np.zeros((0, 3)), np.zeros((0, 3)))


@dataclass(frozen=True)
class Magnetometer:
    """One unit on its boot: measured = ``soft_iron`` · field + ``hard_iron_ut`` + white noise, sensor axes."""

    noise_ut: float = 0.3
    hard_iron_ut: tuple[float, float, float] = (0.0, 0.0, 0.0)
    soft_iron: npt.ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def measure(self, field_ut: FloatArray, rng: np.random.Generator) -> FloatArray:
        """What it tells of a field (n, 3) µT given in its own axes."""
        noise = rng.normal(0.0, self.noise_ut, field_ut.shape)
        return np.asarray(field_ut @ np.asarray(self.soft_iron).T + self.hard_iron_ut + noise)


def iron_under(path_m: FloatArray, spacing_m: float, moment_a_m2: float, rng: np.random.Generator) -> Dipoles:
    """Dipoles of random direction, 0.2 to 0.6 m below a path (n, 3) and up to a metre aside of it."""
    legs = np.linalg.norm(np.diff(path_m, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(legs)])
    at = np.arange(0.0, arc[-1], spacing_m)
    place = np.column_stack([np.interp(at, arc, path_m[:, axis]) for axis in range(3)])
    place += rng.uniform([-1.0, -1.0, -0.6], [1.0, 1.0, -0.2], place.shape)
    return Dipoles(place, np.asarray(rng.normal(0.0, moment_a_m2, place.shape)))


def boot_field(
    motion: FootMotion,
    time_s: FloatArray,
    mounting: Rotation,
    earth: EarthField,
    magnetometer: Magnetometer,
    rng: np.random.Generator,
    iron: Dipoles = NO_IRON,
) -> FloatArray:
    """Samples (n, 3) µT of a magnetometer on this foot, in the axes of the inertial unit beside it."""
    attitude = motion.at(time_s)[1]
    field = np.array([earth.east_ut, earth.north_ut, earth.up_ut]) + _on_the_way(iron, motion, time_s)
    return magnetometer.measure((attitude * mounting).inv().apply(field), rng)


def _on_the_way(iron: Dipoles, motion: FootMotion, time_s: FloatArray) -> FloatArray:
    """The iron's field (n, 3), every tenth sample computed and the others between: a foot in stance is as slow."""
    coarse = np.append(time_s[:-1:_EVERY], time_s[-1])
    field = iron.field_ut(motion.at(coarse)[0])
    return np.column_stack([np.interp(time_s, coarse, column) for column in field.T])
