"""Iron on the person, learned while walking (METHODS A5 on line): a new radio at the vest bends the compass, too.

Who turns turns the earth's field in the unit's axes, while what is worn stays where it is: the mean field of each
step, in device axes, is ``(I + S)·b + o``, b the earth's field where gyro and gravity say it lies, o hard and S
soft iron (symmetric). An extended Kalman filter follows b, o, S and the gyro's drift.

Places have iron, too. How much shows in how far the field is off what was expected beyond what is still unknown of
o and S, and so uneven a field counts for little. What was found is used from when it is known twice as well as
before the walk and is significant, and never beyond bounds.
"""

import math

import numpy as np

from bootprint.geomagnetism import EarthField
from bootprint.messages import Float64Array
from pdr_engine.body.settings import HeadingSettings

MOST_HARD_UT, MOST_SOFT = 20.0, 0.1
HARD_SIGMA_UT, SOFT_SIGMA = 5.0, 0.02  # of what a calibration leaves, and a day of wearing brings
_HARD_WALK_UT_SQRT_S, _FIELD_WALK_UT_SQRT_S = 0.02, 0.05
_EARTH_SIGMA_UT = 1.5  # of the model's field
_UNKNOWN_UT = 20.0
_PLACE_STEPS = 40.0  # for which a place's iron is alike
# How uneven the field is shows soon when it gets worse, and is believed to be better only after a while.
_MEMORY_STEPS, _FIRST_STEPS, _ALARM_STEPS = 100.0, 10.0, 8.0
_MOST_UNEVENNESS = 0.5
_GATE = 3.0
_SURE = 0.5  # of the sigma before the walk
_CHI_SQUARE = 9.21  # of two degrees of freedom: one in a hundred is larger
_EARTH, _HARD, _SOFT, _DRIFT, _SIZE = slice(0, 3), slice(3, 6), slice(6, 12), 12, 13


def _symmetric() -> Float64Array:
    """What each of six parameters makes of a symmetric matrix, (6, 3, 3)."""
    basis = np.zeros((6, 3, 3))
    for number, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        basis[number, row, column] = basis[number, column, row] = 1.0
    return basis


_BASIS = _symmetric()


class WornIron:
    """Learns from steps; fields are in µT along ahead, left, up, a ``frame`` (3, 3) has these in device axes."""

    def __init__(self, settings: HeadingSettings) -> None:
        self._settings = settings
        self._earth: EarthField | None = None
        self._x: Float64Array | None = None
        sigmas = [*[_UNKNOWN_UT] * 3, *[HARD_SIGMA_UT] * 3, *[SOFT_SIGMA] * 6, settings.gyro_drift_rad_s]
        self._p = np.diag(np.square(sigmas))
        self._uneven, self._steps = settings.disturbance_floor**2, _FIRST_STEPS

    def know_earth_field(self, field: EarthField) -> None:
        """What the field should be here."""
        self._earth = field

    def lose(self, sigma_rad: float) -> None:
        """See `heading.Source`: where the gyro has north is not known any more, what is worn is."""
        if self._x is not None:
            self._p[:2, :2] += (sigma_rad * float(np.hypot(*self._x[:2]))) ** 2 * np.eye(2)

    def unbias(self, rate_rad_s: float) -> None:
        """See `heading.Source`."""
        if self._x is not None:
            self._x[_DRIFT] -= rate_rad_s

    @property
    def hard_ut(self) -> Float64Array:
        """Hard iron (3,), device axes, as far as it is known."""
        return np.zeros(3) if self._x is None else np.clip(self._x[_HARD], -MOST_HARD_UT, MOST_HARD_UT)

    @property
    def soft(self) -> Float64Array:
        """Soft iron S (3, 3), device axes, as far as it is known."""
        shares = np.zeros(6) if self._x is None else np.clip(self._x[_SOFT], -MOST_SOFT, MOST_SOFT)
        return np.asarray(np.tensordot(shares, _BASIS, 1))

    def sure(self, frame: Float64Array) -> bool:
        """Whether the hard iron's level part, which is what turns a compass, is known twice as well as before the
        walk, and is not likely to be none: a good calibration is not to be spoilt."""
        variance = frame[:2] @ self._p[_HARD, _HARD] @ frame[:2].T
        level_ut = frame[:2] @ self.hard_ut
        known = float(np.trace(variance)) < 2.0 * (_SURE * HARD_SIGMA_UT) ** 2
        return known and float(level_ut @ np.linalg.solve(variance, level_ut)) > _CHI_SQUARE

    def azimuth(self, yaw_rad: float) -> tuple[float, float]:
        """From magnetic north, clockwise, of who faces ``yaw_rad`` in the gyro's frame, and its sigma, rad."""
        assert self._x is not None
        x, y = self._x[:2]
        across = np.array([-y, x]) / max(x * x + y * y, 1e-6)
        sigma = math.sqrt(float(across @ self._p[:2, :2] @ across))
        return (math.atan2(y, x) - yaw_rad) % math.tau, sigma

    def corrected(self, level_ut: Float64Array, frame: Float64Array) -> Float64Array:
        """Fields (n, 3) without what is worn."""
        device = level_ut @ frame - self.hard_ut
        return np.asarray(np.linalg.solve(np.eye(3) + self.soft, device.T).T @ frame.T)

    def step(
        self, level_ut: Float64Array, frame: Float64Array, yaw_rad: float, step_s: float, learns: bool
    ) -> None:
        """A step's mean field (3,), while ahead pointed to ``yaw_rad``, counter-clockwise of the gyro's zero.

        ``learns``: whether the field is clean enough to be learned from.
        """
        cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        if self._x is None:
            self._begin(turn.T @ level_ut)
        else:
            self._predict(step_s)
        if learns:
            self._update(level_ut, frame, frame.T @ turn)

    def _begin(self, field_ut: Float64Array) -> None:
        """The field (3,) in the gyro's frame is all there is; how strong it is the earth's model tells better."""
        self._x = np.zeros(_SIZE)
        self._x[_EARTH] = field_ut
        if self._earth is not None:
            level_ut = max(float(np.hypot(*field_ut[:2])), 1e-3)
            strength = np.zeros((2, _SIZE))
            strength[0, :2], strength[1, 2] = field_ut[:2] / level_ut, 1.0
            model = np.array([math.hypot(self._earth.north_ut, self._earth.east_ut), self._earth.up_ut])
            self._take(model - strength @ self._x, strength, _EARTH_SIGMA_UT**2 * np.eye(2))

    def _predict(self, step_s: float) -> None:
        assert self._x is not None
        x, y = self._x[:2]
        angle = float(self._x[_DRIFT]) * step_s
        turn = np.eye(_SIZE)
        turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        self._x = turn @ self._x
        turn[:2, _DRIFT] = step_s * np.array([-y, x])
        noise = np.zeros(_SIZE)
        noise[_EARTH] = _FIELD_WALK_UT_SQRT_S**2
        noise[:2] += self._settings.gyro_noise_rad_sqrt_s**2 * (x * x + y * y)
        noise[_HARD] = _HARD_WALK_UT_SQRT_S**2
        noise[_DRIFT] = self._settings.drift_walk_rad_s_sqrt_s**2
        self._p = turn @ self._p @ turn.T + np.diag(noise * step_s)

    def _update(self, level_ut: Float64Array, frame: Float64Array, into_device: Float64Array) -> None:
        assert self._x is not None
        shares = np.eye(3) + np.tensordot(self._x[_SOFT], _BASIS, 1)
        earth = into_device @ self._x[_EARTH]
        jacobian = np.zeros((3, _SIZE))
        jacobian[:, _EARTH] = shares @ into_device
        jacobian[:, _HARD] = np.eye(3)
        jacobian[:, _SOFT] = (_BASIS @ earth).T
        innovation = level_ut @ frame - shares @ earth - self._x[_HARD]
        known = jacobian @ self._p @ jacobian.T
        strength = max(float(np.linalg.norm(level_ut)), 1.0)
        variance = self._place_variance() * strength**2
        self._learn_unevenness(innovation / strength, float(np.trace(known)) / strength**2)
        total = float(np.trace(known)) + 3.0 * variance
        variance *= max(1.0, float(innovation @ innovation) / (_GATE**2 * total / 3.0))
        self._take(innovation, jacobian, variance * np.eye(3))

    def _place_variance(self) -> float:
        """Of a step's field, as a share of its strength squared: sway, and the iron of the place."""
        settings = self._settings
        return settings.sway_steps * settings.compass_sigma_rad**2 + _PLACE_STEPS * self._uneven

    def _learn_unevenness(self, innovation: Float64Array, known: float) -> None:
        """Of an innovation (3,) and what was to be expected of its square, both as shares of the strength."""
        beyond = min(max(float(innovation @ innovation) - known, 0.0) / 3.0, _MOST_UNEVENNESS**2)
        self._steps = min(self._steps + 1.0, _MEMORY_STEPS)
        self._uneven += (beyond - self._uneven) / (_ALARM_STEPS if beyond > self._uneven else self._steps)

    def _take(self, innovation: Float64Array, jacobian: Float64Array, noise: Float64Array) -> None:
        """The Kalman update, in Joseph's form."""
        assert self._x is not None
        gain = np.linalg.solve(jacobian @ self._p @ jacobian.T + noise, jacobian @ self._p).T
        self._x = self._x + gain @ innovation
        left = np.eye(_SIZE) - gain @ jacobian
        self._p = left @ self._p @ left.T + gain @ noise @ gain.T
