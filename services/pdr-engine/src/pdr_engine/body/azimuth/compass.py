"""What the magnetometer says of a step's azimuth, and how far it can be believed.

The field is averaged over a step in the level frame, so tilt is compensated by the attitude; METHODS A4 gives the
same from pitch and roll. What tilt is wrong by turns the azimuth by tan(dip) times as much (A4); what iron nearby
does is told by `disturbance`.
"""

import math
from dataclasses import dataclass

from bootprint.geomagnetism import EarthField
from bootprint.messages import Float64Array
from pdr_engine.body.azimuth.disturbance import DisturbanceDetector, field_of
from pdr_engine.body.settings import BodySettings
from pdr_engine.body.steps.attitude import Rows, rotated
from pdr_engine.body.steps.intake import Vector

UNKNOWN_RAD = math.pi / math.sqrt(3.0)  # sigma of an angle of which nothing is known
_SEEN = 200  # samples
_LEAST_UPRIGHT = 0.3
_UNKNOWN = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Reading:
    """Azimuth of the reference axis, clockwise from magnetic north, and its sigma.

    ``trusted``: worth using at all; ``disturbed``: iron or currents are likelier than not. Errors last
    for steps: ``alike_variance`` is what each step would have if all were independent and averaged as slowly,
    ``lasting_variance`` the same for who would rather keep a track's shape than have its azimuth soon.
    """

    azimuth_rad: float
    sigma_rad: float
    trusted: bool = True
    disturbed: bool = False
    lasting_variance: float = UNKNOWN_RAD**2
    alike_variance: float = UNKNOWN_RAD**2


def tilt_compensated(field_ut: Vector, pitch_rad: float, roll_rad: float) -> float:
    """METHODS A4, in axes forward, right, down: azimuth from the field in device axes and the device's tilt.

    Pitch is positive nose up, roll positive right side down.
    """
    x, y, z = field_ut
    sp, cp, sr, cr = math.sin(pitch_rad), math.cos(pitch_rad), math.sin(roll_rad), math.cos(roll_rad)
    ahead = x * cp + y * sp * sr + z * sp * cr
    right = y * cr - z * sr
    return math.atan2(-right, ahead) % math.tau


def two_axis(field_ut: tuple[float, float], pitch_rad: float, roll_rad: float, down_ut: float) -> float:
    """METHODS C3: as `tilt_compensated`, the z coil replaced by the field's known vertical part ``down_ut``.

    The vertical part of the field is −x sin φ + y cos φ sin θ + z cos φ cos θ (φ pitch, θ roll): solved for z.
    """
    x, y = field_ut
    sp, cp, sr, cr = math.sin(pitch_rad), math.cos(pitch_rad), math.sin(roll_rad), math.cos(roll_rad)
    z = (down_ut + x * sp - y * cp * sr) / (cp * cr)
    return tilt_compensated((x, y, z), pitch_rad, roll_rad)


def tilt_error(pitch_error_rad: float, roll_error_rad: float, dip_rad: float, azimuth_rad: float) -> float:
    """METHODS A4 to first order: by how much the azimuth errs when pitch and roll do, in axes forward, right, down.

    A pitch error brings the vertical field into "ahead", which turns the azimuth by sin α; a roll error brings it
    into "right", which turns it by cos α (signs checked against `tilt_compensated` by differences).
    """
    lever = math.tan(dip_rad)
    return lever * (roll_error_rad * math.cos(azimuth_rad) - pitch_error_rad * math.sin(azimuth_rad))


class TwoAxisField:
    """METHODS C3 for any attitude: the z coil is not read, the field's known vertical part stands for it.

    That part is the earth's, or what the whole magnetometer showed in the first seconds, as if calibrated there.
    """

    def __init__(self) -> None:
        self._up_ut: float | None = None
        self._seen_ut: list[float] = []

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self._up_ut = field.up_ut

    def complete(self, rows: Rows, field_ut: Vector) -> Vector:
        """The field with z solved from its vertical part; unknown where the z coil stands level."""
        x, y, z = field_ut
        a, b, c = rows[2]
        if self._up_ut is None:
            self._seen_ut.append(a * x + b * y + c * z)
            if len(self._seen_ut) < _SEEN:
                return field_ut
            self._up_ut = sum(self._seen_ut) / _SEEN
        return (x, y, (self._up_ut - a * x - b * y) / c) if abs(c) > _LEAST_UPRIGHT else _UNKNOWN


class Compass:
    """Reads a step's azimuth and judges it: calibrated, level, and by the disturbance detector."""

    def __init__(self, settings: BodySettings) -> None:
        self._calibration = settings.calibration
        heading = settings.heading
        self._heading = heading
        self._sigma_rad = math.hypot(heading.compass_sigma_rad, heading.disturbance_floor)
        self._two_axis = TwoAxisField() if settings.azimuth == "two-axis" else None
        self._detector = DisturbanceDetector(None, heading.disturbance_floor)

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self._detector = DisturbanceDetector(field, self._heading.disturbance_floor)
        if self._two_axis is not None:
            self._two_axis.know_earth_field(field)

    def level(self, rows: Rows, field_ut: Vector) -> Vector:
        """A sample in the nav frame, from device axes."""
        offset = self._calibration.offset_ut
        x, y, z = (value - shift for value, shift in zip(field_ut, offset, strict=True))
        field = rotated(self._calibration.matrix, (x, y, z))
        return rotated(rows, field if self._two_axis is None else self._two_axis.complete(rows, field))

    def read(
        self, level_ut: Float64Array, turn_rad: float, step_s: float, carried: tuple[float, float] | None
    ) -> Reading:
        """Of a step's samples (n, 3): ahead, left, up. ``turn_rad``: the gyro's since the last step, clockwise.

        ``carried``: the azimuth that is expected, and its sigma.
        """
        field = field_of(level_ut)
        verdict = self._detector.update(field, turn_rad, step_s, carried)
        sigma = verdict.sigma_rad(self._sigma_rad)
        azimuth = field.azimuth_rad % math.tau
        if sigma is None:
            return Reading(azimuth, UNKNOWN_RAD, trusted=False, disturbed=verdict.disturbed)
        heading, share = self._heading, (sigma / self._sigma_rad) ** 2
        lasting, alike = (
            share * self._variance_of(steps) for steps in (heading.correlation_steps, heading.alike_steps)
        )
        return Reading(
            azimuth, sigma, disturbed=verdict.disturbed, lasting_variance=lasting, alike_variance=alike
        )

    def _variance_of(self, alike_steps: float) -> float:
        """Of an undisturbed reading: tilt and sway last for some steps, iron for as long as a place is like this.

        How much iron there is shows in how uneven the field lately was; never more than buildings have.
        """
        heading = self._heading
        uneven = min(self._detector.unevenness, heading.disturbance_floor)
        return heading.sway_steps * heading.compass_sigma_rad**2 + alike_steps * uneven**2
