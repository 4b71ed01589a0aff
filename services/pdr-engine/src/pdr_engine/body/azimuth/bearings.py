"""The azimuths of a step: of the selected source, of the gyro alone, and as the compass read it."""

import math
from dataclasses import dataclass

from bootprint.geomagnetism import EarthField
from pdr_engine.body.azimuth.compass import Compass, Reading
from pdr_engine.body.azimuth.heading import GyroAlone, Heading
from pdr_engine.body.azimuth.repeated import Repeated
from pdr_engine.body.azimuth.sources import source_of
from pdr_engine.body.settings import BodySettings
from pdr_engine.body.steps.strides import Cut

_UNSEEN_TURN_RAD = 1.0  # what a person may turn in a gap


@dataclass(frozen=True, slots=True)
class Bearing:
    """Of the unit's reference axis, amid a step; ``reading`` None without a magnetometer."""

    heading: Heading
    gyro: Heading
    reading: Reading | None

    @property
    def disturbed(self) -> bool:
        """Whether the compass checks nothing."""
        return self.reading is None or self.reading.disturbed


class Bearings:
    """Follows the reference axis from step to step."""

    def __init__(self, settings: BodySettings) -> None:
        self.compass = Compass(settings)
        self._source = source_of(settings.azimuth, settings.heading)
        self._gyro = GyroAlone(settings.heading)
        self.repeated = Repeated(settings.deviations) if settings.deviation_map else None
        self._heading: Heading | None = None
        self._rest_turn_rad_s = 0.0
        self._last: tuple[int, float] | None = None  # end and mean yaw of the last step

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self.compass.know_earth_field(field)

    def step(self, cut: Cut, rest_turn_rad_s: float) -> Bearing:
        """Go on by a step. ``rest_turn_rad_s``: see `Attitude`."""
        if self._last is not None and rest_turn_rad_s != self._rest_turn_rad_s:
            self._source.unbias(rest_turn_rad_s - self._rest_turn_rad_s)
        self._rest_turn_rad_s = rest_turn_rad_s
        before_ns, before_rad = self._last or (cut.end_ns, cut.yaw_rad)
        self._last = (cut.end_ns, cut.yaw_rad)
        turn_rad, since_s = cut.yaw_rad - before_rad, (cut.end_ns - before_ns) * 1e-9
        reading = raw = self._read(cut, turn_rad, since_s)
        if self.repeated is not None and raw is not None:
            reading = self.repeated.corrected(raw)
        self._heading = self._source.step(turn_rad, since_s, reading)
        if self.repeated is not None and raw is not None:
            self.repeated.learn(raw, self._heading)
        return Bearing(self._heading, self._gyro.step(turn_rad, since_s, reading), reading)

    def lose(self) -> None:
        """The stream broke: nobody knows how far the unit turned."""
        self._source.lose(_UNSEEN_TURN_RAD)
        self._gyro.lose(_UNSEEN_TURN_RAD)

    def _read(self, cut: Cut, turn_rad: float, since_s: float) -> Reading | None:
        if cut.field_ut is None:
            return None
        carried = None
        if self._heading is not None:
            carried = ((self._heading.azimuth_rad - turn_rad) % math.tau, self._heading.sigma_rad)
        return self.compass.read(cut.field_ut, -turn_rad, since_s, carried)
