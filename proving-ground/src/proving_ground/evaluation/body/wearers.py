"""Simulated people with a unit at belt, chest, back or in the hand: the module's samples, and what was true.

A unit on the trunk moves with it. One in the hand is held ahead: the arm gives way, so it follows the trunk a
little later and bounces some more (what `LengthSettings.hand_factor` found on recorded walks), and trembles.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bootprint.geomagnetism import EarthField
from pdr_engine.body.pieces import FloatArray
from proving_ground.motion import Motion
from proving_ground.people import GaitName, Itinerary, Leg, Person, PersonMotion, move
from proving_ground.people.attitude import attitude_of
from proving_ground.people.smooth import Tremble
from proving_ground.sensors import (
    BAROMETER_CLASSES,
    Air,
    Magnetics,
    Mounting,
    imu_class,
    measure_imu,
    measure_pressure,
)
from sensor_gateway.recordings.run import PressureSeries, Run

RATE_HZ = 100.0
CENTRAL_EUROPE = EarthField(1.1, 21.4, -43.2)
# Metres forward, left and up of the belt, and how the unit is turned there: sensor axes to the body's.
PLACEMENTS: dict[str, Mounting] = {
    "belt": Mounting(np.array([0.12, -0.06, 0.0]), Rotation.from_euler("ZYX", [0.08, 0.1, 0.05])),
    "chest": Mounting(np.array([0.12, 0.0, 0.30]), Rotation.from_euler("ZYX", [0.0, -1.4, 0.0])),
    "back": Mounting(np.array([-0.13, 0.04, 0.25]), Rotation.from_euler("ZYX", [np.pi, 0.15, 0.0])),
    "hand": Mounting(np.array([0.35, -0.10, 0.12]), Rotation.from_euler("ZYX", [0.10, -0.25, 0.05])),
}
HAND = "hand"
_ARM_DELAY_S, _ARM_GAIN = 0.03, 0.18  # of the trunk's bounce
_BOUNCE_S = 0.6  # over which it is told from what lasts
_HAND_TREMBLE = np.array([2e-3, 2e-3, 2e-3, 0.01, 0.01, 0.015])  # m, rad
_HAND_BAND_HZ = (0.3, 6.0)


@dataclass(frozen=True)
class HeldAhead:
    """A hand before its bearer, in the torso's frame."""

    torso: Motion
    tremble: Tremble

    def at(self, time_s: FloatArray) -> tuple[FloatArray, Rotation]:
        """See `Motion`."""
        place, attitude = self.torso.at(time_s - _ARM_DELAY_S)
        around = [
            self.torso.at(time_s - _ARM_DELAY_S + apart)[0][:, 2]
            for apart in np.linspace(-0.4, 0.4, 5) * _BOUNCE_S
        ]
        place[:, 2] += _ARM_GAIN * (place[:, 2] - np.mean(around, axis=0))
        shake = self.tremble(time_s)
        return place + shake[:, :3], attitude * attitude_of(shake[:, 3:])


def worn(
    motion: PersonMotion, placement: str, seed: int, barometer: str | None = None, air: Air | None = None
) -> Run:
    """What a consumer unit at this placement, 100 Hz, makes of a walk; the same for the same seed."""
    rng = np.random.default_rng([seed, list(PLACEMENTS).index(placement)])
    mounting = PLACEMENTS[placement]
    carrier: Motion = motion.torso
    if placement == HAND:
        carrier = HeldAhead(motion.torso, Tremble(_HAND_TREMBLE, rng, _HAND_BAND_HZ, fall=2.0))
    unit = replace(imu_class("consumer"), rate_hz=RATE_HZ, bandwidth_hz=0.4 * RATE_HZ)
    imu = measure_imu(carrier, motion.duration_s, mounting, unit, Magnetics(CENTRAL_EUROPE), rng)
    pressure: PressureSeries | None = None
    if barometer is not None:
        quality = BAROMETER_CLASSES[barometer]
        pressure = measure_pressure(carrier, motion.duration_s, mounting, quality, air or Air(), rng)
    truth = {"body": motion.truth()}
    return Run(placement, "body", Path(), {"body": imu}, truth, pressure)


def walked(person: Person, legs: Iterator[Leg] | list[Leg], seed: int, start_s: float = 4.0) -> PersonMotion:
    """A person on these legs."""
    return move(person, Itinerary(tuple(legs), start_s=start_s), seed)


class Way:
    """Legs one after the other, each by how far it leads from where the one before ended."""

    def __init__(self) -> None:
        self.place = np.zeros(3)

    def to(
        self,
        gait: GaitName,
        *moves: tuple[float, float, float],
        riser_m: float = 0.16,
        speed_m_s: float | None = None,
        facing_rad: float | None = None,
    ) -> Leg:
        """The leg that leads by these moves (east, north, up), m."""
        points = self.place + np.vstack([np.zeros(3), np.cumsum(moves, axis=0)])
        self.place = points[-1]
        return Leg(gait, points, speed_m_s=speed_m_s, facing_rad=facing_rad, riser_m=riser_m)

    def hold(self, gait: GaitName, duration_s: float) -> Leg:
        """Standing, kneeling or lying here."""
        return Leg(gait, self.place, duration_s=duration_s)


def footfalls_s(motion: PersonMotion) -> FloatArray:
    """When feet came down (n,), s."""
    begins_s = np.concatenate([foot.begin_s for foot in motion.footfalls.values()])
    return np.sort(begins_s[np.isfinite(begins_s) & (begins_s > 0.0)])
