"""METHODS B2: the compass de-noised step by step, without any gyro.

The azimuth's sine and cosine pass a Savitzky–Golay filter of seven steps and order two (shorter ones while fewer
steps are known), then a Kalman filter in which the azimuth is a second-order Gauss–Markov process (azimuth, rate,
acceleration per step). The smoothing filter is centred three steps back; what is published at once is the same
parabola's end, and the centred value follows as `Cascade.refined`.
"""

import math
from collections import deque

import numpy as np

from bootprint.messages import Float64Array
from pdr_engine.body.azimuth.compass import UNKNOWN_RAD, Reading
from pdr_engine.body.azimuth.heading import Heading, wrapped
from pdr_engine.body.settings import HeadingSettings

WINDOW, ORDER = 7, 2
DELAY = WINDOW // 2
PROCESS_SIGMA_RAD = math.radians(0.01)  # a step
_MARKOV_PER_STEP = 0.05  # how fast rate and acceleration die away


def savitzky_golay(azimuths_rad: Float64Array, position: int) -> float:
    """The parabola through sine and cosine of (n,) azimuths, n odd, at ``position``: an azimuth, rad."""
    from scipy.signal import savgol_coeffs  # scipy is loaded only by who selects this source

    count = len(azimuths_rad)
    weights = savgol_coeffs(count, min(ORDER, count - 1), pos=position, use="dot")
    return math.atan2(float(weights @ np.sin(azimuths_rad)), float(weights @ np.cos(azimuths_rad)))


class Cascade:
    """Both filters in a row; between readings the Kalman filter predicts."""

    def __init__(self, settings: HeadingSettings) -> None:
        from filterpy.kalman import KalmanFilter

        self._settings = settings
        self._readings: deque[float] = deque(maxlen=WINDOW)
        self.refined: float | None = None
        keep = math.exp(-_MARKOV_PER_STEP)
        self._filter = KalmanFilter(dim_x=3, dim_z=1)
        self._filter.F = np.array([[1.0, 1.0, 0.5], [0.0, keep, 1.0], [0.0, 0.0, keep]])
        self._filter.H = np.array([[1.0, 0.0, 0.0]])
        self._filter.Q = np.diag([0.0, 0.0, PROCESS_SIGMA_RAD**2])
        self._filter.P = np.diag([UNKNOWN_RAD**2, math.radians(5.0) ** 2, math.radians(1.0) ** 2])

    def step(self, turn_rad: float, step_s: float, reading: Reading | None) -> Heading:
        """See `azimuth.Source`."""
        self._filter.predict()
        if reading is not None:
            self._readings.append(reading.azimuth_rad)
            self._smooth()
        azimuth, variance = float(self._filter.x[0, 0]), float(self._filter.P[0, 0])
        if reading is not None:
            variance += reading.sigma_rad**2  # iron bends neighbours alike: no filter takes that out
        return Heading(azimuth % math.tau, min(UNKNOWN_RAD, math.sqrt(variance)))

    def lose(self, sigma_rad: float) -> None:
        """See `azimuth.Source`."""
        self._readings.clear()
        self._filter.P[0, 0] += sigma_rad**2

    def unbias(self, rate_rad_s: float) -> None:
        """See `azimuth.Source`: no gyro here."""

    def _smooth(self) -> None:
        """Filter with the longest odd window there is, and let the Kalman filter have its end.

        It weighs the scatter of readings: to a low-pass one that iron bends is no less sure than its neighbours.
        """
        count = len(self._readings) - (1 - len(self._readings) % 2)
        window = np.array(self._readings)[-count:]
        predicted = float(self._filter.x[0, 0])
        found = predicted + wrapped(savitzky_golay(window, count - 1) - predicted)
        self._filter.update(np.array([[found]]), R=np.array([[self._settings.compass_sigma_rad**2]]))
        self.refined = savitzky_golay(window, DELAY) % math.tau if count == WINDOW else None
