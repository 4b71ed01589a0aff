"""Air pressure where a soldier goes, and what a barometer makes of it.

The standard atmosphere around the origin (ISO 2533), weather that drifts as a random walk, wind outdoors, doors
that slam, and lift cars that push the air before them. One `Air` is shared by all soldiers of an exercise: its
weather and gusts come of its own seed, so that two barometers side by side feel the same air.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.places import Area
from proving_ground.sensors.randomness import RandomField, flicker
from sensor_gateway.recordings.run import PressureSeries

SEA_LEVEL_PA = 101_325.0
_SEA_LEVEL_K = 288.15
_LAPSE_K_PER_M = 0.0065
_EXPONENT = 5.255877  # g·M/(R·L)
_AIR_KG_PER_M3 = 1.225
_WEATHER_PERIOD_S = 10.0
_SPEED_STEP_S = 0.25
_INNER_SAMPLES = 4  # of the air a sample of the unit
_LEAK = 0.15  # share of the gusts that is felt indoors


def standard_pressure_pa(height_m: FloatArray | float) -> FloatArray:
    """Pressure of the standard atmosphere at heights above sea level (valid to 11 km)."""
    ratio = 1.0 - _LAPSE_K_PER_M * np.asarray(height_m, dtype=np.float64) / _SEA_LEVEL_K
    return np.asarray(SEA_LEVEL_PA * ratio**_EXPONENT, dtype=np.float64)


@dataclass(frozen=True)
class DoorSlam:
    """A door that slams: a damped swing of the air, strongest at the door."""

    time_s: float
    place_m: FloatArray  # (3,)
    peak_pa: float = 30.0
    reach_m: float = 12.0
    frequency_hz: float = 2.0
    decay_s: float = 0.4

    def pressure_pa(self, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        """What it adds at times (n,) and places (n, 3)."""
        since = time_s - self.time_s
        swing = np.sin(2.0 * np.pi * self.frequency_hz * since) * np.exp(
            -np.maximum(since, 0.0) / self.decay_s
        )
        distance = np.linalg.norm(place_m - self.place_m, axis=1)
        return np.where(since > 0.0, self.peak_pa * swing * np.exp(-distance / self.reach_m), 0.0)


@dataclass(frozen=True)
class LiftShaft:
    """A shaft whose car drives the air: inside, pressure changes with the square of the car's speed."""

    area: Area
    piston_pa_per_m2_s2: float = 4.0

    def pressure_pa(self, place_m: FloatArray, climb_m_s: FloatArray) -> FloatArray:
        """What a passenger at places (n, 3) feels who climbs with (n,) m/s: going up compresses the air above."""
        push = self.piston_pa_per_m2_s2 * climb_m_s * np.abs(climb_m_s)
        return np.where(self.area.holds(place_m), push, 0.0)


@dataclass(frozen=True)
class Air:
    """The air of an exercise. ``origin_height_m`` above sea level of the frame's zero.

    ``drift_pa_per_sqrt_h``: random walk of the weather (a calm day 30, a front 150). ``wind_m_s``: mean wind;
    its gusts press with some of ½ρv², over about ``gust_s`` and ``gust_m``. ``indoors``: little is felt there.
    """

    origin_height_m: float = 0.0
    drift_pa_per_sqrt_h: float = 50.0
    offset_pa: float = 0.0
    wind_m_s: float = 0.0
    gust_s: float = 3.0
    gust_m: float = 20.0
    indoors: tuple[Area, ...] = ()
    doors: tuple[DoorSlam, ...] = ()
    lifts: tuple[LiftShaft, ...] = ()
    seed: int = 0
    _gusts: RandomField = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        scales = [self.gust_s, self.gust_m, self.gust_m]
        object.__setattr__(self, "_gusts", RandomField.drawn(scales, 1, self.seed))

    def pressure_pa(self, time_s: FloatArray, place_m: FloatArray, climb_m_s: FloatArray) -> FloatArray:
        """Pressure at times (n,) and places (n, 3) of somebody who climbs with (n,) m/s, (n,)."""
        pressure = standard_pressure_pa(self.origin_height_m + place_m[:, 2]) + self.offset_pa
        pressure += self._weather_pa(time_s) + self._wind_pa(time_s, place_m)
        for door in self.doors:
            pressure += door.pressure_pa(time_s, place_m)
        for lift in self.lifts:
            pressure += lift.pressure_pa(place_m, climb_m_s)
        return pressure

    def _weather_pa(self, time_s: FloatArray) -> FloatArray:
        """A random walk from 0 at time zero that is the same however much of it is asked for."""
        count = int(np.ceil(max(float(time_s.max(initial=0.0)), 0.0) / _WEATHER_PERIOD_S)) + 1
        sigma = self.drift_pa_per_sqrt_h * np.sqrt(_WEATHER_PERIOD_S / 3600.0)
        steps = np.random.default_rng(self.seed).normal(0.0, sigma, count)
        walk = np.concatenate([[0.0], np.cumsum(steps)])
        return np.asarray(np.interp(time_s, np.arange(count + 1) * _WEATHER_PERIOD_S, walk))

    def _wind_pa(self, time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        if not self.wind_m_s:
            return np.zeros(len(time_s))
        # Gusts are about a third of the mean wind (turbulence intensity near the ground), so v² varies by 2·⅓·v².
        sigma = 0.5 * _AIR_KG_PER_M3 * self.wind_m_s**2 * 2.0 / 3.0
        points = np.column_stack([time_s, place_m[:, :2]])
        return np.asarray(sigma * self._gusts.at(points)[:, 0] * self._shelter(place_m))

    def _shelter(self, place_m: FloatArray) -> FloatArray:
        inside = np.zeros(len(place_m), dtype=np.bool_)
        for area in self.indoors:
            inside |= area.holds(place_m)
        return np.where(inside, _LEAK, 1.0)


@dataclass(frozen=True, slots=True)
class BarometerQuality:
    """``noise_pa`` a sample, ``bias_pa`` sigma of the unit's offset, ``instability_pa`` of its wander.

    ``response_s``: time constant of its own low-pass, which takes most of a walker's bounce.
    """

    source: str
    rate_hz: float
    response_s: float
    noise_pa: float
    bias_pa: float
    instability_pa: float
    resolution_pa: float


BAROMETER_CLASSES = {
    "industrial": BarometerQuality(
        "Xsens MTi-3 with its barometer, as recorded in chest-xsens: new every 0.2 s, 0.25 Pa from one to the next",
        *(5.0, 0.35, 0.15, 50.0, 0.5, 0.05),
    ),
    "consumer": BarometerQuality(
        "Bosch Sensortec, BMP280 as commonly quoted: 1.3 Pa RMS unfiltered, ±1 hPa absolute",
        *(10.0, 0.1, 1.3, 50.0, 2.0, 0.16),
    ),
}


def measure_pressure(
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    quality: BarometerQuality,
    air: Air,
    rng: np.random.Generator,
) -> PressureSeries:
    """Samples from time zero to ``duration_s`` of a barometer on a moving body."""
    time_s = np.arange(0.0, duration_s, 1.0 / quality.rate_hz)
    inner_s = np.arange(len(time_s) * _INNER_SAMPLES) / (quality.rate_hz * _INNER_SAMPLES)
    pressure = _felt(motion, mounting, air, inner_s)
    keep = np.exp(-1.0 / (quality.rate_hz * _INNER_SAMPLES * max(quality.response_s, 1e-6)))
    lagging, _ = lfilter([1.0 - keep], [1.0, -keep], pressure, zi=keep * pressure[:1])
    read = lagging[::_INNER_SAMPLES] + rng.normal(0.0, quality.bias_pa)
    read += rng.normal(0.0, quality.noise_pa, len(time_s))
    read += flicker(len(time_s), 1.0 / quality.rate_hz, quality.instability_pa, rng, columns=1)[:, 0]
    return PressureSeries(time_s, np.round(read / quality.resolution_pa) * quality.resolution_pa)


def _felt(motion: Motion, mounting: Mounting, air: Air, time_s: FloatArray) -> FloatArray:
    """The air's pressure on a sensor at times (n,), (n,)."""
    place_m, _ = mounting.carried(motion, time_s)
    behind, ahead = (
        mounting.carried(motion, time_s + step)[0][:, 2] for step in (-_SPEED_STEP_S, _SPEED_STEP_S)
    )
    return air.pressure_pa(time_s, place_m, (ahead - behind) / (2.0 * _SPEED_STEP_S))
