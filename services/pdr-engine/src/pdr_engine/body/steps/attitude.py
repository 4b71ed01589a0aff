"""Attitude of a unit worn anywhere: gyro turns, gravity levels (a complementary filter after Mahony et al. 2008).

The nav frame is level, z up; its yaw is whatever the first sample's attitude gives and drifts with the gyro alone.
While a person walks the accelerometer shows gravity on average only, so it pulls slowly; standing still tells the
gyro's bias. Plain floats: one sample at a time is what makes batches of any size give the same bits.
"""

import math

from pdr_engine.body.settings import AttitudeSettings
from pdr_engine.body.steps.intake import Sample, Vector

_REST_S = 1.0
_SMALL_RAD = 1e-9
Quaternion = tuple[float, float, float, float]
Rows = tuple[Vector, Vector, Vector]


def levelling(accel_m_s2: Vector) -> Quaternion:
    """The shortest turn (w, x, y, z) that takes a specific force to the vertical."""
    size = math.hypot(*accel_m_s2)
    if size == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    x, y, z = (value / size for value in accel_m_s2)
    length = math.sqrt((1.0 + z) ** 2 + x * x + y * y)
    if length < _SMALL_RAD:
        return (0.0, 1.0, 0.0, 0.0)
    return ((1.0 + z) / length, y / length, -x / length, 0.0)


def turned_by(q: Quaternion, x: float, y: float, z: float) -> Quaternion:
    """``q`` followed by the rotation vector (rad, device axes), normalised."""
    angle = math.sqrt(x * x + y * y + z * z)
    share = 0.5 if angle < _SMALL_RAD else math.sin(0.5 * angle) / angle
    cw, cx, cy, cz = math.cos(0.5 * angle), share * x, share * y, share * z
    aw, ax, ay, az = q
    w = aw * cw - ax * cx - ay * cy - az * cz
    i = aw * cx + ax * cw + ay * cz - az * cy
    j = aw * cy - ax * cz + ay * cw + az * cx
    k = aw * cz + ax * cy - ay * cx + az * cw
    size = math.sqrt(w * w + i * i + j * j + k * k)
    return (w / size, i / size, j / size, k / size)


def rows_of(q: Quaternion) -> Rows:
    """The rows of the matrix that takes device axes to the nav frame; the last one is up in device axes."""
    w, x, y, z = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def rotated(rows: Rows, vector: Vector) -> Vector:
    """The vector in the axes whose rows these are."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


class Attitude:
    """Follows the device's attitude sample by sample.

    ``rest_turn_rad_s``: how much rate of turn about the vertical, counter-clockwise, standing still has taken off
    the gyro as bias since the start. Who follows the azimuth's drift has so much less of it to expect.
    """

    def __init__(self, settings: AttitudeSettings) -> None:
        self._settings = settings
        self._q: Quaternion | None = None
        self._age_s = 0.0
        self._rest = RestWindow(settings)
        self.rest_turn_rad_s = 0.0
        self._up: Vector = (0.0, 0.0, 0.0)
        self._step_s = 0.0
        self.rows: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @property
    def bias_rad_s(self) -> Vector:
        """The gyro bias as it is known now, device axes."""
        return self._rest.bias_rad_s

    @property
    def bias_sigma_rad_s(self) -> float:
        """One sigma of each component of what is left of it."""
        return math.sqrt(self._rest.variance)

    def follow(self, sample: Sample) -> Rows:
        """Take the sample in and return the matrix from device axes to the nav frame."""
        ax, ay, az = sample.accel_m_s2
        if self._q is None:
            self._q = levelling(sample.accel_m_s2)
        if sample.breaks:
            self._age_s = 0.0
        ux, uy, uz = self.rows[2] if self._age_s > 0.0 else rows_of(self._q)[2]
        self._take_rest(sample, (ux, uy, uz))
        bx, by, bz = self._rest.bias_rad_s
        pull = self._pull() / max(math.hypot(ax, ay, az), 1.0)
        self._step_s = step_s = sample.step_s
        wx, wy, wz = sample.gyro_rad_s
        ex, ey, ez = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
        self._q = turned_by(
            self._q,
            (wx - bx + pull * ex) * step_s,
            (wy - by + pull * ey) * step_s,
            (wz - bz + pull * ez) * step_s,
        )
        self._learn_bias(ex, ey, ez, pull * step_s)
        self._age_s += step_s
        self.rows = rows_of(self._q)
        return self.rows

    def _take_rest(self, sample: Sample, up: Vector) -> None:
        before, seconds = self._rest.bias_rad_s, self._rest.seconds
        self._rest.take(sample)
        if self._rest.seconds > seconds:
            changes = zip(up, self._rest.bias_rad_s, before, strict=True)
            self.rest_turn_rad_s += sum(axis * (now - then) for axis, now, then in changes)

    def _learn_bias(self, ex: float, ey: float, ez: float, share: float) -> None:
        """What gravity has to pull at all the time is a bias: the integral part, blind about the vertical.

        The vertical is the mean one: a trunk that sways in step with its surge would leak pull into the bias about
        it, and an azimuth's drift would grow for minutes.
        """
        if self._age_s > self._settings.settling_s:
            gain = self._settings.gravity_bias_share * share * self._settings.gravity_rate_per_s
            ux, uy, uz = self._follow_up()
            upward = ex * ux + ey * uy + ez * uz
            bx, by, bz = self._rest.bias_rad_s
            self._rest.bias_rad_s = (
                bx - gain * (ex - upward * ux),
                by - gain * (ey - upward * uy),
                bz - gain * (ez - upward * uz),
            )

    def _follow_up(self) -> Vector:
        """The mean direction of up in device axes (3,), a unit vector."""
        share = self._step_s * self._settings.gravity_rate_per_s
        x, y, z = (mean + share * (up - mean) for mean, up in zip(self._up, self.rows[2], strict=True))
        size = math.sqrt(x * x + y * y + z * z) or 1.0
        self._up = (x / size, y / size, z / size)
        return self._up

    def _pull(self) -> float:
        settled = self._age_s > self._settings.settling_s
        return self._settings.gravity_rate_per_s if settled else self._settings.first_gravity_rate_per_s


class RestWindow:
    """Finds seconds in which the unit is at rest and learns the gyro's bias: a scalar Kalman filter."""

    def __init__(self, settings: AttitudeSettings) -> None:
        self._settings = settings
        self.bias_rad_s: Vector = (0.0, 0.0, 0.0)
        self.variance = settings.bias_sigma_rad_s**2
        self.seconds = 0
        self._restart()

    def _restart(self) -> None:
        self._count, self._span_s = 0, 0.0
        self._sums = [0.0] * 6
        self._squares = [0.0] * 6

    def take(self, sample: Sample) -> None:
        """Add a sample; a full second is judged and a new one begun."""
        if sample.breaks:
            self._restart()
        self._span_s += sample.step_s
        self._count += 1
        for index, value in enumerate((*sample.accel_m_s2, *sample.gyro_rad_s)):
            self._sums[index] += value
            self._squares[index] += value * value
        if self._span_s >= _REST_S:
            self._judge()
            self._restart()

    def _judge(self) -> None:
        mean = [total / self._count for total in self._sums]
        spread = [square / self._count - m * m for square, m in zip(self._squares, mean, strict=True)]
        settings = self._settings
        still = (
            sum(spread[:3]) < settings.rest_accel_std_m_s2**2
            and sum(spread[3:]) < settings.rest_gyro_std_rad_s**2
            and math.hypot(*mean[3:]) < settings.rest_rate_rad_s
        )
        if still:
            self._learn((mean[3], mean[4], mean[5]))

    def _learn(self, rate_rad_s: Vector) -> None:
        gain = self.variance / (self.variance + self._settings.rest_sway_rad_s**2)
        x, y, z = (b + gain * (rate - b) for b, rate in zip(self.bias_rad_s, rate_rad_s, strict=True))
        self.bias_rad_s = (x, y, z)
        self.variance *= 1.0 - gain
        self.seconds += 1
