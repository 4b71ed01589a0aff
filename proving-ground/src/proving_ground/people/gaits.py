"""The gaits: which recorded stride shape each uses, how fast and long its steps are, and how the torso moves.

Step length and frequency: walking keeps the walk ratio (Sekiya and Nagasaki 1998), running gains speed by length
more than by frequency (Cavanagh and Kram 1989), slopes slow a walker down by Tobler's hiking function (1993). Side
steps and crawling follow the few recorded strides of pyshoe-vicon; stairs those of gaitmap-example.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from proving_ground.people.legs import FloatArray, GaitName, Leg
from proving_ground.people.person import Person

ShapeName = Literal["walk", "run", "side_step", "stairs_up", "stairs_down"]
RUN_HZ_PER_M_S = 0.2
RISER_AT_MOST_M = 0.23
_STAIR_PERIOD_S = {True: 0.48, False: 0.44}  # a step up, a step down
_SIDE_STEP_M, _CRAWL_STEP_M = 0.38, 0.22
_OWN_SPEED_M_S = {"backward": 0.85, "side_step": 0.38, "crawl": 0.5}
TURN_S = 1.6
LIFT_SPEED_M_S, LIFT_RAMP_S = 1.0, 1.5
TRANSITION_S = 1.2  # to kneel, lie down or go on all fours, and to rise again


@dataclass(frozen=True)
class TorsoHabit:
    """Amplitudes at the belt: once a step, of bounce (negative: lowest at mid-stance) and of surge along the way;
    once a stride, of sway and twist; ``strike_m_s2`` of the heel's shock."""

    bounce_m: float = 0.0
    surge_m_s: float = 0.0
    sway_m: float = 0.0
    twist_rad: float = 0.0
    strike_m_s2: float = 0.0
    turn_rad: float = 0.0  # of the body towards where a side step goes (METHODS A3: up to 20°)


@dataclass(frozen=True)
class Pace:
    """Steps of a travelling leg: ``period_s`` each, about ``length_m`` long; ``shape`` of the strides, None on all
    fours, where feet only glide."""

    shape: ShapeName | None
    length_m: float
    period_s: float
    strike: float  # of the person's heel strike at 1.3 m/s
    backward: bool = False
    pairs: bool = False  # the second foot joins the first (side steps)


def pace_of(person: Person, leg: Leg) -> Pace:
    """How a person takes the steps of a travelling leg."""
    if leg.gait == "stairs":
        return _stair_pace(person, leg)
    if leg.gait in ("run", "sprint"):
        return _running_pace(person, leg)
    if leg.gait in ("side_step_left", "side_step_right"):
        speed = leg.speed_m_s or _OWN_SPEED_M_S["side_step"]
        return Pace("side_step", _SIDE_STEP_M, _SIDE_STEP_M / (2.0 * speed), 0.8, pairs=True)
    if leg.gait == "crawl":
        speed = leg.speed_m_s or _OWN_SPEED_M_S["crawl"]
        return Pace(None, _CRAWL_STEP_M, _CRAWL_STEP_M / speed, 1.2)
    own = _OWN_SPEED_M_S["backward"] if leg.gait == "backward" else person.walk_speed_m_s
    speed = leg.speed_m_s or own * _on_slope(leg.points_m)
    length_m = float(np.sqrt(person.walk_ratio_m_s * speed))
    return Pace("walk", length_m, length_m / speed, speed / 1.3, backward=leg.gait == "backward")


def _running_pace(person: Person, leg: Leg) -> Pace:
    own = person.sprint_speed_m_s if leg.gait == "sprint" else person.run_speed_m_s
    speed = leg.speed_m_s or own * _on_slope(leg.points_m)
    frequency_hz = (person.run_frequency_hz + RUN_HZ_PER_M_S * speed) * np.sqrt(0.92 / person.leg_length_m)
    return Pace("run", float(speed / frequency_hz), float(1.0 / frequency_hz), min(2.2, 0.9 + 0.5 * speed))


def _stair_pace(person: Person, leg: Leg) -> Pace:
    rise = float(leg.points_m[-1, 2] - leg.points_m[0, 2])
    period_s = _STAIR_PERIOD_S[rise >= 0.0] * np.sqrt(person.leg_length_m / 0.92)
    length_m = np.sqrt(person.walk_ratio_m_s * person.walk_speed_m_s) * 0.8
    if leg.speed_m_s is not None:
        period_s = _horizontal_m(leg.points_m) / leg.speed_m_s / stair_steps(leg, length_m).sum()
    shape: ShapeName = "stairs_up" if rise >= 0.0 else "stairs_down"
    return Pace(shape, float(length_m), float(period_s), 1.3 if rise >= 0.0 else 2.2)


def stair_steps(leg: Leg, length_m: float) -> FloatArray:
    """Steps on each piece of a stair's way (k − 1,): one a riser where it climbs, of this length on landings."""
    run = np.linalg.norm(np.diff(leg.points_m[:, :2], axis=0), axis=1)
    rise = np.abs(np.diff(leg.points_m[:, 2]))
    risers = np.maximum(np.round(rise / leg.riser_m), np.ceil(rise / RISER_AT_MOST_M))
    flat = np.maximum(1.0, np.round(run / length_m))
    return np.asarray(np.where(rise > 0.5 * leg.riser_m, np.maximum(risers, 1.0), flat))


def _horizontal_m(points_m: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points_m[:, :2], axis=0), axis=1).sum())


def _on_slope(points_m: FloatArray) -> float:
    """Speed on a way's slope over speed on the flat, after Tobler."""
    slope = (points_m[-1, 2] - points_m[0, 2]) / max(1e-6, _horizontal_m(points_m))
    return float(np.exp(-3.5 * abs(slope + 0.05)) / np.exp(-3.5 * 0.05))


def torso_habit(person: Person, pace: Pace) -> TorsoHabit:
    """How the torso moves with the steps; amplitudes after Zijlstra and Hof (2003) and Gard et al. (2004)."""
    if pace.shape == "run":
        # Half of what a body falls and rises in the quarter of a step that it flies at least.
        bounce = -0.6 * 9.81 * (0.25 * pace.period_s) ** 2
        return TorsoHabit(bounce, 0.10, 0.008, 0.09, 30.0)
    if pace.shape == "side_step":
        return TorsoHabit(0.010, 0.05, 0.0, 0.12, 4.0, 0.15)
    if pace.shape is None:
        return TorsoHabit(0.012, 0.06, 0.03, 0.10, 4.0)
    # The hip's inverted pendulum would rise by step²/(8 leg); knee and ankle leave some six tenths of it.
    bounce = 0.6 * pace.length_m**2 / (16.0 * person.leg_length_m)
    sway = 0.022 / max(0.7, 1.0 / (1.8 * pace.period_s))
    return TorsoHabit(bounce, 0.09 * pace.length_m / 0.7, sway, 0.07, 11.0 * pace.strike)


@dataclass(frozen=True)
class Posture:
    """How the torso is carried: its height as a share of the belt's when standing, how far it is ahead of the feet
    as a share of the leg's length, its lean forward; and the pitch of the feet, toes down."""

    height_share: float = 1.0
    ahead_share: float = 0.0
    lean_rad: float = 0.03
    left_pitch_rad: float = 0.0
    right_pitch_rad: float = 0.0
    right_back_share: float = 0.0  # of the leg's length: where the kneeling leg's foot is


UPRIGHT = Posture()
POSTURES: dict[GaitName, Posture] = {
    "kneel": Posture(0.58, -0.1, 0.1, 0.0, 0.9, 0.45),
    "prone": Posture(0.13, 0.95, 1.45, 1.3, 1.3),
    "crawl": Posture(0.5, 0.45, 1.3, 1.3, 1.3),
    "run": Posture(0.97, 0.0, 0.12),
    "sprint": Posture(0.96, 0.0, 0.18),
    "backward": Posture(0.99, 0.0, -0.02),
    "side_step_left": Posture(0.97),
    "side_step_right": Posture(0.97),
}
LOW: tuple[GaitName, ...] = ("kneel", "prone", "crawl")  # gaits that are gone down for
