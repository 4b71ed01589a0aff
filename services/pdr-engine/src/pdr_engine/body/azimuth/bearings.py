"""The azimuths of a step: of the selected source, of the gyro alone, and as the compass read it."""

import math
from dataclasses import dataclass

from bootprint.geomagnetism import EarthField
from bootprint.messages import Float64Array
from pdr_engine.body.azimuth.compass import Compass, Reading
from pdr_engine.body.azimuth.heading import GyroAlone, Heading, wrapped
from pdr_engine.body.azimuth.online_calibration import OnlineCalibration
from pdr_engine.body.azimuth.repeated import Repeated
from pdr_engine.body.azimuth.sources import Headings
from pdr_engine.body.settings import BodySettings
from pdr_engine.body.steps.attitude import Rows
from pdr_engine.body.steps.strides import Cut

_UNSEEN_TURN_RAD = 1.0  # what a person may turn in a gap


@dataclass(frozen=True, slots=True)
class Bearing:
    """Of the unit's reference axis, amid a step; ``reading`` None without a magnetometer.

    ``track``: for adding steps up; ``heading``: from north, as it is known now (`Headings`).
    """

    track: Heading
    heading: Heading
    gyro: Heading
    reading: Reading | None

    @property
    def turn_rad(self) -> float:
        """By how much the track's frame is to be turned clockwise for north to be at its top."""
        return wrapped(self.heading.azimuth_rad - self.track.azimuth_rad)

    @property
    def disturbed(self) -> bool:
        """Whether the compass checks nothing."""
        return self.reading is None or self.reading.disturbed


class Bearings:
    """Follows the reference axis from step to step."""

    def __init__(self, settings: BodySettings) -> None:
        self.compass = Compass(settings)
        self._method = (settings.azimuth, settings.heading)
        self._source = Headings(*self._method)
        self._gyro = GyroAlone(settings.heading)
        self.repeated = Repeated(settings.deviations) if settings.deviation_map else None
        self._online = OnlineCalibration(settings.heading) if settings.online_calibration else None
        self._track: Heading | None = None  # what is expected of the compass: the slower of both
        self._rest_turn_rad_s = 0.0
        self._last: tuple[int, float] | None = None  # end and mean yaw of the last step

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self.compass.know_earth_field(field)
        if self._online is not None:
            self._online.know_earth_field(field)

    def step(self, cut: Cut, rest_turn_rad_s: float, rows: Rows, reference: tuple[float, float]) -> Bearing:
        """Go on by a step. ``rest_turn_rad_s``: see `Attitude`; ``rows``: its, of about now.

        ``reference``: east and north part of the reference axis (`Ahead.reference`) in them.
        """
        if self._last is not None and rest_turn_rad_s != self._rest_turn_rad_s:
            self._unbias(rest_turn_rad_s - self._rest_turn_rad_s)
        self._rest_turn_rad_s = rest_turn_rad_s
        before_ns, before_rad = self._last or (cut.end_ns, cut.yaw_rad)
        self._last = (cut.end_ns, cut.yaw_rad)
        turn_rad, since_s = cut.yaw_rad - before_rad, (cut.end_ns - before_ns) * 1e-9
        field_ut = cut.field_ut if self._online is None else self._online.corrected(cut, rows, reference)
        reading = raw = self._read(field_ut, turn_rad, since_s)
        if self.repeated is not None and raw is not None:
            reading = self.repeated.corrected(raw)
        self._track, heading = self._source.step(turn_rad, since_s, reading)
        heading = self._calibrate(cut, since_s, raw) or heading
        if self.repeated is not None and raw is not None:
            self.repeated.learn(raw, heading)
        return Bearing(self._track, heading, self._gyro.step(turn_rad, since_s, reading), reading)

    def lose(self) -> None:
        """The stream broke: nobody knows how far the unit turned."""
        self._source.lose(_UNSEEN_TURN_RAD)
        self._gyro.lose(_UNSEEN_TURN_RAD)
        if self._online is not None:
            self._online.iron.lose(_UNSEEN_TURN_RAD)

    def _unbias(self, rate_rad_s: float) -> None:
        self._source.unbias(rate_rad_s)
        if self._online is not None:
            self._online.iron.unbias(rate_rad_s)

    def _calibrate(self, cut: Cut, step_s: float, reading: Reading | None) -> Heading | None:
        """Learn the iron that is worn; when it is found, azimuth and drift that rested on it begin anew.

        The azimuth from north then, else None.
        """
        if self._online is None:
            return None
        found = self._online.learn(cut, step_s, reading is not None and not reading.disturbed)
        if found is None:
            return None
        self._source = Headings(*self._method)
        self._track, heading = self._source.step(0.0, 0.0, Reading(*found))
        return heading

    def _read(self, field_ut: Float64Array | None, turn_rad: float, since_s: float) -> Reading | None:
        if field_ut is None:
            return None
        carried = None
        if self._track is not None:
            carried = ((self._track.azimuth_rad - turn_rad) % math.tau, self._track.sigma_rad)
        return self.compass.read(field_ut, -turn_rad, since_s, carried)
