"""Simulated walks of both boots: people of a seed on a route, an inertial unit on each foot, perhaps a receiver.

Where wanted, the feet's headings drift in opposite directions, as FOI saw it (METHODS D4): each gyro turns a little
too far while the foot swings, the left one to the one side, the right one to the other. A bias would be learned at
rest; this is not there at rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.config import Origin
from proving_ground.motion import FloatArray
from proving_ground.people import GaitName, Itinerary, Leg, Person, PersonMotion, move
from proving_ground.people.foot import INSTEP_M
from proving_ground.sensors import (
    GNSS_CLASSES,
    GnssConditions,
    ImuClass,
    Mounting,
    imu_class,
    measure_gnss,
    measure_imu,
)
from sensor_gateway.recordings.run import FEET, GnssSeries, ImuSeries, Run, Truth

ORIGIN = Origin(latitude_deg=58.39, longitude_deg=15.58, height_m=70.0)
UNIT = imu_class("industrial")
REST_S = 8.0
_MOUNTINGS_DEG = {"left_foot": (5.0, -25.0, 15.0), "right_foot": (-4.0, -22.0, -18.0)}
_RECEIVER = Mounting(np.array([0.0, 0.0, 0.4]))  # on the shoulder, above the belt
_SWINGING_RAD_S = 1.0
_TRUTH_S = 0.1


@dataclass(frozen=True, slots=True)
class DualWalk:
    """A run of both feet with the truth of the body and of each foot, and the azimuth of the first leg, degrees."""

    run: Run
    azimuth_deg: float


def dual_walk(
    way_m: Sequence[tuple[float, float]],
    seed: int,
    *,
    person: Person | None = None,
    gait: GaitName = "walk",
    unit: ImuClass = UNIT,
    opposite_drift_rad_s: float = 0.0,
    satellites: bool = False,
) -> DualWalk:
    """A person of this seed goes along a way (k points in the plane), at rest before and after it."""
    rng = np.random.default_rng([seed, 7])
    motion = _gone(way_m, person or Person.drawn(rng), gait, seed)
    imus = {place: _imu(motion, place, unit, rng) for place in FEET}
    if opposite_drift_rad_s != 0.0:
        signs = dict(zip(FEET, (1.0, -1.0), strict=True))
        imus = {place: drifting(imu, signs[place] * opposite_drift_rad_s) for place, imu in imus.items()}
    times = np.arange(0.0, motion.duration_s, _TRUTH_S)
    feet = {place: Truth(times, getattr(motion, place).at(times)[0]) for place in FEET}
    east, north = way_m[1][0] - way_m[0][0], way_m[1][1] - way_m[0][1]
    run = Run(
        name=f"walk-{seed}",
        kind="dual",
        path=Path(),
        imus=imus,
        truth={"body": motion.truth(), **feet},
        gnss=_gnss(motion, rng) if satellites else None,
        origin=(ORIGIN.latitude_deg, ORIGIN.longitude_deg, ORIGIN.height_m),
    )
    return DualWalk(run, math.degrees(math.atan2(east, north)))


def _gone(way_m: Sequence[tuple[float, float]], person: Person, gait: GaitName, seed: int) -> PersonMotion:
    way = np.array([(east, north, 0.0) for east, north in way_m])
    legs = (Leg("stand", way[:1], REST_S), Leg(gait, way), Leg("stand", way[-1:], REST_S / 2))
    ahead = way[1] - way[0]
    return move(person, Itinerary(legs, start_yaw_rad=float(np.arctan2(ahead[1], ahead[0]))), seed)


def _imu(motion: PersonMotion, place: str, unit: ImuClass, rng: np.random.Generator) -> ImuSeries:
    rotation = Rotation.from_euler("xyz", _MOUNTINGS_DEG[place], degrees=True)
    return measure_imu(
        getattr(motion, place), motion.duration_s, Mounting(INSTEP_M, rotation), unit, None, rng
    )


def _gnss(motion: PersonMotion, rng: np.random.Generator) -> GnssSeries:
    quality = next(iter(GNSS_CLASSES.values()))
    return measure_gnss(motion.torso, motion.duration_s, _RECEIVER, quality, GnssConditions(), ORIGIN, rng)


def drifting(imu: ImuSeries, rate_rad_s: float) -> ImuSeries:
    """The unit turns so much too far about the vertical of its rest, in the mean of a walk; at rest not at all."""
    up: FloatArray = np.median(imu.accel_m_s2[imu.time_s < REST_S / 2], axis=0)
    swings = np.linalg.norm(imu.gyro_rad_s, axis=1) > _SWINGING_RAD_S
    share = max(float(np.mean(swings)), 1e-3)
    return replace(
        imu, gyro_rad_s=imu.gyro_rad_s + np.outer(swings, up / np.linalg.norm(up)) * rate_rad_s / share
    )
