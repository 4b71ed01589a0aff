"""Itineraries and finite differences for tests of simulated people."""

import numpy as np
from scipy.spatial.transform import Rotation

from proving_ground.people import GaitName, Itinerary, Leg, Motion, Person, PersonMotion, move

GRAVITY = np.array([0.0, 0.0, 9.80665])
EAST_20_M = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]


def walked(gait: GaitName, way: object = None, seed: int = 1, person: Person | None = None) -> PersonMotion:
    """A person facing the way the gait wants who does one leg between two stands of two seconds."""
    way = np.asarray(EAST_20_M if way is None else way, dtype=float)
    facing = {"backward": np.pi, "side_step_left": -0.5 * np.pi, "side_step_right": 0.5 * np.pi}
    ahead = way[1] - way[0]
    yaw = float(np.arctan2(ahead[1], ahead[0])) + facing.get(gait, 0.0)
    legs = (Leg("stand", way[:1], 2.0), Leg(gait, way), Leg("stand", way[-1:], 2.0))
    return move(person or Person(), Itinerary(legs, start_yaw_rad=yaw), seed)


def velocity(motion: Motion, time_s: np.ndarray, step_s: float = 1e-3) -> np.ndarray:
    """Central difference, (n, 3)."""
    return (motion.at(time_s + step_s)[0] - motion.at(time_s - step_s)[0]) / (2.0 * step_s)


def acceleration(motion: Motion, time_s: np.ndarray, step_s: float = 1e-3) -> np.ndarray:
    """Second difference, (n, 3)."""
    behind, here, ahead = (motion.at(time_s + shift)[0] for shift in (-step_s, 0.0, step_s))
    return (ahead - 2.0 * here + behind) / step_s**2


def turn_rate(motion: Motion, time_s: np.ndarray, step_s: float = 1e-3) -> np.ndarray:
    """Rate in body axes, (n, 3)."""
    behind, ahead = (motion.at(time_s + shift)[1] for shift in (-step_s, step_s))
    return (behind.inv() * ahead).as_rotvec() / (2.0 * step_s)


def yaw_of(attitude: Rotation) -> np.ndarray:
    """Yaw, unwrapped, (n,)."""
    forward = attitude.apply([1.0, 0.0, 0.0])
    return np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))
