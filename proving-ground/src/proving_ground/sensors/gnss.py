"""What a satellite receiver reports: fixes with correlated errors, accuracies honest or not, coasting, first fixes.

Errors are first-order Gauss-Markov (horizontal and vertical), grown by what hides the sky, plus the bias of
reflections at the place. Without satellites a receiver coasts for a while on its last velocity, as navigation
filters in receivers do, and then reports no fix; a new fix takes its time.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bootprint.config import Origin
from bootprint.geodesy import LocalFrame
from proving_ground.motion import FloatArray, Motion
from proving_ground.sensors.gnss_conditions import GnssConditions, Reception
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.randomness import gauss_markov
from sensor_gateway.recordings.run import GnssSeries

_LOST = 0.05  # signal below which no fix is possible
_WORST_DILUTION = 6.0
_COURSE_SPEED_M_S = 0.3  # below which a receiver gives no course
_SPEED_STEP_S = 0.5
_COASTING_GROWTH_M_S = 0.7  # of the stated accuracy while coasting
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class GnssQuality:
    """A receiver; figures as commonly quoted, not measured here.

    ``sigma_m``, ``sigma_up_m``: errors under open sky; ``correlation_s``: how long they last.
    ``honesty``: stated accuracy over true accuracy; 1 is honest, 0.3 far too sure. ``knows_reflections``: share of
    the reflections' bias that its accuracy allows for. ``coast_s``: how long it goes on without satellites.
    """

    source: str
    period_s: float = 1.0
    sigma_m: float = 1.2
    sigma_up_m: float = 2.2
    white_m: float = 0.15
    correlation_s: float = 60.0
    speed_sigma_m_s: float = 0.08
    honesty: float = 1.0
    knows_reflections: float = 0.5
    coast_s: float = 3.0
    first_fix_s: float = 30.0
    again_s: float = 2.0


GNSS_CLASSES = {
    "honest": GnssQuality(
        "a receiver like u-blox's NEO-M9N: 1.5 m CEP (1.2 m a component), 0.05 m/s, 24 s cold start"
    ),
    "dishonest": GnssQuality(
        "the same receiver in pedestrian navigation mode, which smooths and coasts and hides what it does not know",
        honesty=0.35,
        knows_reflections=0.0,
        coast_s=20.0,
    ),
    "phone": GnssQuality(
        "a phone in a pocket; phone-gps states 22 to 47 m in its last 16 s",
        sigma_m=6.0,
        sigma_up_m=10.0,
        correlation_s=30.0,
        speed_sigma_m_s=0.3,
        honesty=1.5,
        coast_s=10.0,
    ),
}


def measure_gnss(
    motion: Motion,
    duration_s: float,
    mounting: Mounting,
    quality: GnssQuality,
    conditions: GnssConditions,
    origin: Origin,
    rng: np.random.Generator,
) -> GnssSeries:
    """A row an epoch from time zero to ``duration_s``; without a fix all but the satellites is unknown (NaN)."""
    time_s = np.arange(0.0, duration_s, quality.period_s)
    place_m, _ = mounting.carried(motion, time_s)
    reception = conditions.reception(time_s, place_m)
    velocity = _velocity(motion, mounting, time_s)
    tracking, coasting = _phases(reception.signal > _LOST, quality)
    dilution = 1.0 + (_WORST_DILUTION - 1.0) * (1.0 - reception.signal) ** 2
    error = _errors(len(time_s), quality, rng) * np.where(reception.spoofed, 1.0, dilution)[:, None]
    reported = place_m + error + np.where(reception.spoofed[:, None], reception.drag_m, reception.bias_m)
    noisy = velocity + rng.normal(0.0, quality.speed_sigma_m_s, velocity.shape) * dilution[:, None]
    noisy += reception.drag_m_s
    reported, noisy, since_s = _coasted(time_s, reported, noisy, tracking, coasting)
    accuracy = _accuracy(reception, dilution, since_s, quality)
    return _series(time_s, reported, noisy, accuracy, reception.satellites, tracking | coasting, origin)


def _velocity(motion: Motion, mounting: Mounting, time_s: FloatArray) -> FloatArray:
    """Over a second around the epoch, (n, 3): receivers smooth the sway of the body away."""
    behind, ahead = (mounting.carried(motion, time_s + step)[0] for step in (-_SPEED_STEP_S, _SPEED_STEP_S))
    return np.asarray((ahead - behind) / (2.0 * _SPEED_STEP_S))


def _phases(signal: BoolArray, quality: GnssQuality) -> tuple[BoolArray, BoolArray]:
    """Whether each epoch is tracking satellites, and whether it is coasting without them, (n,) each."""
    tracking, coasting = np.zeros(len(signal), dtype=np.bool_), np.zeros(len(signal), dtype=np.bool_)
    needed = round(quality.first_fix_s / quality.period_s)
    patience = 0
    for epoch, received in enumerate(signal):
        needed = needed - 1 if received else max(needed, round(quality.again_s / quality.period_s))
        if received and needed < 0:
            tracking[epoch] = True
            patience = round(quality.coast_s / quality.period_s)
        elif patience > 0:
            coasting[epoch] = True
            patience -= 1
    return tracking, coasting


def _errors(count: int, quality: GnssQuality, rng: np.random.Generator) -> FloatArray:
    """Errors under open sky, (n, 3) ENU."""
    wander = gauss_markov(count, quality.period_s, 1.0, quality.correlation_s, rng, columns=3)
    sigma = np.array([quality.sigma_m, quality.sigma_m, quality.sigma_up_m])
    return np.asarray(wander * sigma + rng.normal(0.0, quality.white_m, (count, 3)))


def _coasted(
    time_s: FloatArray, place_m: FloatArray, velocity: FloatArray, tracking: BoolArray, coasting: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places and velocities with those of coasting epochs carried on from the last fix, and for how long, (n,)."""
    last = np.maximum.accumulate(np.where(tracking, np.arange(len(time_s)), 0))
    since_s = np.where(coasting, time_s - time_s[last], 0.0)
    carried = place_m[last] + since_s[:, None] * velocity[last]
    on = coasting[:, None]
    return np.where(on, carried, place_m), np.where(on, velocity[last], velocity), since_s


def _accuracy(
    reception: Reception, dilution: FloatArray, since_s: FloatArray, quality: GnssQuality
) -> tuple[FloatArray, FloatArray]:
    """Stated horizontal and vertical accuracy, m, one sigma, (n,) each; a spoofed receiver sees a perfect sky."""
    scale = np.where(reception.spoofed, 1.0, dilution)
    known = quality.knows_reflections * np.linalg.norm(reception.bias_m, axis=1) * ~reception.spoofed
    growth = _COASTING_GROWTH_M_S * since_s
    horizontal = np.sqrt(2.0 * (quality.sigma_m**2 + quality.white_m**2)) * scale
    vertical = np.hypot(quality.sigma_up_m, quality.white_m) * scale
    return (
        quality.honesty * (np.hypot(horizontal, known) + growth),
        quality.honesty * (np.hypot(vertical, known) + growth),
    )


def _series(
    time_s: FloatArray,
    place_m: FloatArray,
    velocity: FloatArray,
    accuracy: tuple[FloatArray, FloatArray],
    satellites: FloatArray,
    fixed: BoolArray,
    origin: Origin,
) -> GnssSeries:
    lat_deg, lon_deg, alt_m = LocalFrame(origin).all_to_geodetic(place_m).T
    speed = np.linalg.norm(velocity[:, :2], axis=1)
    course_deg = np.degrees(np.arctan2(velocity[:, 0], velocity[:, 1])) % 360.0
    known = {
        "lat_deg": lat_deg,
        "lon_deg": lon_deg,
        "alt_m": alt_m,
        "h_acc_m": accuracy[0],
        "v_acc_m": accuracy[1],
        "speed_m_s": speed,
        "course_deg": np.where(speed > _COURSE_SPEED_M_S, course_deg, np.nan),
    }
    columns = {name: np.where(fixed, values, np.nan) for name, values in known.items()}
    return GnssSeries(
        time_s=time_s, satellites=np.where(fixed, satellites, np.minimum(satellites, 3.0)), **columns
    )
