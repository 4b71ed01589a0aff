"""From compass and gyro to the azimuth of each step: the sources that can be selected.

All follow the same reference axis of the unit. A source is told, step by step, how far the gyro turned since the
last one and what the compass read, and answers with an azimuth from *magnetic* north and its sigma. Without any
compass an azimuth counts from where the unit pointed at the start, and its sigma says that north is unknown.
"""

import math
from typing import NamedTuple, Protocol

from pdr_engine.body.azimuth.compass import UNKNOWN_RAD, Reading
from pdr_engine.body.settings import HeadingSettings

_GATE = 3.0


class Heading(NamedTuple):
    """An azimuth, clockwise from magnetic north, in [0, 2π), and its sigma."""

    azimuth_rad: float
    sigma_rad: float


class Source(Protocol):
    """Something that tells each step's azimuth."""

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """Go on by a step: ``turn_rad`` (gyro, counter-clockwise) in ``step_s``, and the compass's reading."""

    def lose(self, sigma_rad: float) -> None:
        """The stream broke: the unit may have turned by this much unseen."""

    def unbias(self, rate_rad_s: float) -> None:
        """From now on the gyro tells turns (counter-clockwise) that are slower by this bias."""


def wrapped(angle_rad: float) -> float:
    """The angle in [−π, π]."""
    return math.remainder(angle_rad, math.tau)


class GyroAlone:
    """The first compass reading and then the gyro."""

    def __init__(self, settings: HeadingSettings) -> None:
        self._settings = settings
        self._azimuth_rad: float | None = None
        self._start_variance = UNKNOWN_RAD**2
        self._walk_variance = self._age_s = 0.0

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """See `Source`."""
        settings = self._settings
        if self._azimuth_rad is None:
            self._azimuth_rad = reading.azimuth_rad if reading else 0.0
            self._start_variance = reading.sigma_rad**2 if reading else UNKNOWN_RAD**2
        else:
            self._azimuth_rad = (self._azimuth_rad - turn_rad) % math.tau
            self._age_s += step_s
            self._walk_variance += settings.gyro_noise_rad_sqrt_s**2 * step_s
        drift = settings.gyro_drift_rad_s * self._age_s
        variance = self._start_variance + self._walk_variance + drift**2
        return Heading(self._azimuth_rad, min(UNKNOWN_RAD, math.sqrt(variance)))

    def lose(self, sigma_rad: float) -> None:
        """See `Source`."""
        self._walk_variance += sigma_rad**2

    def unbias(self, rate_rad_s: float) -> None:
        """See `Source`: this one follows no bias."""


class CompassAlone:
    """Each step's own reading, believed whatever it is; between readings the gyro."""

    def __init__(self, settings: HeadingSettings) -> None:
        self._gyro = GyroAlone(settings)
        self._settings = settings

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """See `Source`."""
        if reading is None:
            return self._gyro.step(turn_rad, step_s, None)
        self._gyro = GyroAlone(self._settings)
        return self._gyro.step(turn_rad, step_s, reading)

    def lose(self, sigma_rad: float) -> None:
        """See `Source`."""
        self._gyro.lose(sigma_rad)

    def unbias(self, rate_rad_s: float) -> None:
        """See `Source`: this one follows no bias."""


class Combined:
    """Gyro first, compass where the field is trusted (METHODS B8): a Kalman filter of azimuth and gyro drift.

    The errors of a compass are alike over some metres, so each of n steps that share an error is given n times its
    variance. An innovation beyond three sigmas inflates the reading's variance until it is three. Where the field
    is bent it can either keep a track's shape (`Reading.lasting_variance`) or be ``prompt`` in finding north
    (`Reading.alike_variance`, and a first reading that is hardly believed): nothing is both.
    """

    def __init__(self, settings: HeadingSettings, prompt: bool = False) -> None:
        self._settings, self._prompt = settings, prompt
        self._azimuth_rad: float | None = None
        self._drift_rad_s = 0.0
        self._p = [UNKNOWN_RAD**2, 0.0, settings.gyro_drift_rad_s**2]  # aa, ad, dd

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """See `Source`."""
        if self._azimuth_rad is None:
            self._azimuth_rad = reading.azimuth_rad if reading else 0.0
            self._p[0] = self._first_sigma_rad(reading) ** 2
        else:
            self._predict(turn_rad, step_s)
            if reading is not None and reading.trusted:
                self._update(reading)
        return Heading(self._azimuth_rad % math.tau, min(UNKNOWN_RAD, math.sqrt(self._p[0])))

    def lose(self, sigma_rad: float) -> None:
        """See `Source`."""
        self._p[0] += sigma_rad**2

    def unbias(self, rate_rad_s: float) -> None:
        """See `Source`."""
        self._drift_rad_s -= rate_rad_s

    def _first_sigma_rad(self, reading: Reading | None) -> float:
        if reading is None:
            return UNKNOWN_RAD
        return max(reading.sigma_rad, self._settings.first_sigma_rad) if self._prompt else reading.sigma_rad

    def _predict(self, turn_rad: float, step_s: float) -> None:
        assert self._azimuth_rad is not None
        self._azimuth_rad += self._drift_rad_s * step_s - turn_rad
        aa, ad, dd = self._p
        noise, walk = self._settings.gyro_noise_rad_sqrt_s, self._settings.drift_walk_rad_s_sqrt_s
        self._p = [
            aa + 2.0 * step_s * ad + step_s**2 * dd + noise**2 * step_s,
            ad + step_s * dd,
            dd + walk**2 * step_s,
        ]

    def _update(self, reading: Reading) -> None:
        assert self._azimuth_rad is not None
        aa, ad, dd = self._p
        innovation = wrapped(reading.azimuth_rad - self._azimuth_rad)
        variance = reading.alike_variance if self._prompt else reading.lasting_variance
        total = max(aa + variance, (innovation / _GATE) ** 2)
        gain_a, gain_d = aa / total, ad / total
        self._azimuth_rad += gain_a * innovation
        self._drift_rad_s += gain_d * innovation
        self._p = [aa - gain_a * aa, ad - gain_a * ad, dd - gain_d * ad]
