"""What is no walking, through the whole chain: somebody stands and gestures, or rides in a vehicle.

A vehicle's body bounces on its springs at one to two hertz, driven by the road (a quarter car's sprung mass as a
resonance), and shakes with its axles at ten to twelve; its turns and brakes are slow. Gestures are single moves of
hand or trunk, some decimetres in half a second, at random.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.spatial.transform import Rotation

from pdr_engine.body import BodySettings
from pdr_engine.body.pieces import FloatArray
from proving_ground.evaluation.body.recorded_run import BODY, walk_body
from proving_ground.evaluation.body.wearers import CENTRAL_EUROPE, PLACEMENTS, RATE_HZ
from proving_ground.people.attitude import attitude_of
from proving_ground.people.smooth import SmoothCurve, Tremble
from proving_ground.sensors import Magnetics, imu_class, measure_imu
from sensor_gateway.recordings.run import ImuSeries, Run
from sensor_gateway.recordings.tables import STANDARD_GRAVITY_M_S2

DURATION_S = 300.0
_GESTURE_S, _LONGEST_REST_S = (0.4, 1.2), 6.0
_GESTURE_M, _GESTURE_RAD = np.array([0.15, 0.15, 0.2]), np.array([0.3, 0.3, 0.4])
_SWAY = np.array([4e-3, 3e-3, 1e-3, 4e-3, 4e-3, 4e-3])
_SPRUNG_HZ, _SPRUNG_DAMPING = 1.4, 0.3
_AXLE_HZ, _AXLE_DAMPING, _AXLE_SHARE = 11.0, 0.1, 0.5
_HEAVE_SHARE = np.array([0.3, 0.4, 1.0])  # of it ahead, to the left and up
_TURN_HZ, _DRIVING_M_S2 = 0.05, np.array([0.8, 0.8, 0.0])  # curves and brakes
_TURNING_RAD_S, _ROCKING_S_M = 0.08, 0.06
# Heave of the seat, RMS (ISO 2631-1 calls 0.3 a little uncomfortable and 2 extremely so).
RIDES_M_S2 = {"car on a good road": 0.3, "truck on a poor road": 0.9, "cross-country": 1.8}


@dataclass(frozen=True)
class _Moved:
    """Something that sways and makes moves of its own: place m and Euler angles rad, (n, 6) at knots."""

    curve: SmoothCurve
    tremble: Tremble

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """See `Motion`."""
        pose = self.curve(time_s) + self.tremble(time_s)
        return pose[:, :3], attitude_of(pose[:, 3:])


def gestures(placement: str, seed: int) -> int:
    """Steps told while somebody stands and gestures for five minutes."""
    rng = np.random.default_rng([seed, list(PLACEMENTS).index(placement)])
    knots_s, poses = [0.0], [np.zeros(6)]
    share = 1.0 if placement == "hand" else 0.4
    while knots_s[-1] < DURATION_S:
        poses += [poses[-1], share * rng.normal(size=6) * np.concatenate([_GESTURE_M, _GESTURE_RAD])]
        begin_s = knots_s[-1] + rng.uniform(0.1, _LONGEST_REST_S)
        knots_s += [begin_s, begin_s + rng.uniform(*_GESTURE_S)]
    curve = SmoothCurve(np.array(knots_s), np.array(poses), np.zeros((len(poses), 6)))
    unit = replace(imu_class("consumer"), rate_hz=RATE_HZ, bandwidth_hz=0.4 * RATE_HZ)
    moved = _Moved(curve, Tremble(_SWAY, rng))
    return _told(measure_imu(moved, DURATION_S, PLACEMENTS[placement], unit, Magnetics(CENTRAL_EUROPE), rng))


def ride(name: str, placement: str, seed: int) -> int:
    """Steps told in five minutes of a ride."""
    rng = np.random.default_rng([seed, list(PLACEMENTS).index(placement)])
    rms, count = RIDES_M_S2[name], round(DURATION_S * RATE_HZ)
    spring = np.column_stack([_resonance(_SPRUNG_HZ, _SPRUNG_DAMPING, count, rng) for _ in range(3)])
    axle = np.column_stack([_resonance(_AXLE_HZ, _AXLE_DAMPING, count, rng) for _ in range(3)])
    shake = rms * (spring + _AXLE_SHARE * axle) * _HEAVE_SHARE
    slow = np.column_stack([_resonance(_TURN_HZ, 0.7, count, rng) for _ in range(3)]) * _DRIVING_M_S2
    rates = np.column_stack([_resonance(_SPRUNG_HZ, _SPRUNG_DAMPING, count, rng) for _ in range(3)])
    turns = rates * rms * _ROCKING_S_M + np.column_stack([*np.zeros((2, count)), _TURNING_RAD_S * slow[:, 1]])
    back = PLACEMENTS[placement].rotation.inv()
    imu = ImuSeries(
        np.arange(count) / RATE_HZ,
        back.apply(shake + slow + np.array([0.0, 0.0, STANDARD_GRAVITY_M_S2])),
        back.apply(turns),
    )
    return _told(imu)


def _resonance(frequency_hz: float, damping: float, count: int, rng: np.random.Generator) -> FloatArray:
    """White noise through a damped spring (n,), of unit RMS."""
    turn = 2.0 * np.pi * frequency_hz
    b, a = bilinear([2.0 * damping * turn, turn**2], [1.0, 2.0 * damping * turn, turn**2], RATE_HZ)
    swing = lfilter(b, a, rng.normal(size=count))
    return np.asarray(swing / swing.std())


def _told(imu: ImuSeries) -> int:
    return len(walk_body(Run("idle", "body", Path(), {BODY: imu}), BodySettings()).steps)


def idle_table(seeds: range = range(1, 4, 2)) -> str:
    """Markdown: steps told in five minutes, the mean over these seeds, and the most."""
    head = " | ".join(("gestures", *RIDES_M_S2))
    lines = [f"| steps told: mean (most) | {head} |", "|---" * (2 + len(RIDES_M_S2)) + "|"]
    for placement in PLACEMENTS:
        counts = [[gestures(placement, seed) for seed in seeds]]
        counts += [[ride(name, placement, seed) for seed in seeds] for name in RIDES_M_S2]
        cells = " | ".join(f"{np.mean(row):.0f} ({max(row)})" for row in counts)
        lines.append(f"| {placement} | {cells} |")
    return "\n".join(lines) + "\n"
